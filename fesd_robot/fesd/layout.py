"""Where the variables of one control interval sit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fesd_robot.complementarity import NOWHERE, Label, Place
from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd.options import FesdOptions


@dataclass(frozen=True)
class IntervalLayout:
    """Order of an interval's own variables: u, per element (h, jump, per stage (K, X, z), right end), then auxiliaries.

    Attributes:
        n_x, n_z, n_u: sizes of state, algebraic variables and control.
        stages, elements: stages of the scheme and elements of the interval.
        slopes: the stage derivatives K_j are variables (differential and lifted form).
        stage_states: the stage states X_j are variables (integral and lifted form).
        end_state: the right end has a state of its own, for it is no stage, or the stages have no states.
        end_algebraic: the right end has algebraic variables of its own.
        auxiliary: variables of the step equilibration at the end of the interval.
        jump_size: variables of a jump at the left boundary of every element; the first are `jump_states` after it.
        jump_states: numbers of the states that jump.
    """

    n_x: int
    n_z: int
    n_u: int
    stages: int
    elements: int
    slopes: bool = False
    stage_states: bool = True
    end_state: bool = False
    end_algebraic: bool = False
    auxiliary: int = 0
    jump_size: int = 0
    jump_states: tuple[int, ...] = ()

    @property
    def own_end(self) -> bool:
        """Whether the right end has any variables of its own."""
        return self.end_state or self.end_algebraic

    @property
    def _stage_size(self) -> int:
        return (self.slopes + self.stage_states) * self.n_x + self.n_z

    @property
    def _element_size(self) -> int:
        return (
            self._first_stage
            + self.stages * self._stage_size
            + self.end_state * self.n_x
            + self.end_algebraic * self.n_z
        )

    @property
    def _first_stage(self) -> int:
        return 1 + self.jump_size

    @property
    def size(self) -> int:
        """Number of variables of the interval, without the point it starts from."""
        return self.n_u + self.elements * self._element_size + self.auxiliary

    def step(self, element: int) -> int:
        """Return the index of h."""
        return self.n_u + element * self._element_size

    def jump(self, element: int) -> slice:
        """Return the indices of the variables y of the jump at the left boundary."""
        first = self.step(element) + 1
        return slice(first, first + self.jump_size)

    def jumped(self, element: int) -> np.ndarray:
        """Return the indices of the states after the jump at the left boundary, of those that jump."""
        return self.step(element) + 1 + np.arange(len(self.jump_states))

    def slope(self, element: int, stage: int) -> slice:
        """Return the indices of K_j."""
        first = self.step(element) + self._first_stage + stage * self._stage_size
        return slice(first, first + self.slopes * self.n_x)

    def state(self, element: int, stage: int) -> slice:
        """Return the indices of X_j; for ``stage = stages`` those of the state at the right end."""
        if stage == self.stages and not self.end_state:
            stage -= 1
        if stage == self.stages:
            first = self.step(element) + self._first_stage + self.stages * self._stage_size
            return slice(first, first + self.n_x)
        first = self.slope(element, stage).stop
        return slice(first, first + self.stage_states * self.n_x)

    def algebraic(self, element: int, point: int) -> slice:
        """Return the indices of z at a stage; for ``point = stages`` those at the right end."""
        if point == self.stages and not self.end_algebraic:
            point -= 1
        if point == self.stages:
            first = self.step(element) + self._first_stage + self.stages * self._stage_size + self.end_state * self.n_x
        else:
            first = self.step(element) + self._first_stage + (point + 1) * self._stage_size - self.n_z
        return slice(first, first + self.n_z)

    def end(self, element: int) -> np.ndarray:
        """Return the indices of (x, z) at the right end of an element, (n_x + n_z)."""
        x, z = self.state(element, self.stages), self.algebraic(element, self.stages)
        return np.concatenate([np.arange(x.start, x.stop), np.arange(z.start, z.stop)])

    def labels(self, system: ComplementaritySystem) -> list[Label]:
        """Return the labels of the own variables of the interval, (size)."""
        labels = [Label("step equilibration", str(i)) for i in range(self.size)]

        def put(where: slice, kind: str, names: Sequence[str], place: Place) -> None:
            labels[where] = [Label(kind, name, place=place) for name in names]

        put(slice(0, self.n_u), "control", system.control_names, NOWHERE)
        for n in range(self.elements):
            labels[self.step(n)] = Label("step", place=Place(element=n))
            if system.jump is not None:
                names = [system.state_names[i] for i in system.jump.states]
                put(self.jump(n), "jump", [*names, *system.jump.algebraic_names], Place(element=n))
            for j in range(self.stages + self.own_end):
                at_end = j == self.stages
                place = Place(element=n, name="right end") if at_end else Place(element=n, stage=j + 1)
                if self.slopes and not at_end:
                    put(self.slope(n, j), "slope", system.state_names, place)
                if self.end_state if at_end else self.stage_states:
                    put(self.state(n, j), "state", system.state_names, place)
                if not at_end or self.end_algebraic:
                    put(self.algebraic(n, j), "algebraic variable", system.algebraic_names, place)
        return labels

    @property
    def auxiliaries(self) -> slice:
        """Indices of the variables of the step equilibration."""
        return slice(self.size - self.auxiliary, self.size)


def layout_of(system: ComplementaritySystem, options: FesdOptions, elements: int) -> IntervalLayout:
    """Return the layout of an interval with this many elements."""
    tableau = options.tableau
    pairs = len(system.pairs)
    lcc = options.switch_detection and options.step_equilibration == "linear_complementarity"
    return IntervalLayout(
        n_x=system.state.numel(),
        n_z=system.algebraic.numel(),
        n_u=system.control.numel(),
        stages=tableau.stages,
        elements=elements,
        slopes=options.form != "integral",
        stage_states=options.form != "differential",
        end_state=not tableau.ends_at_stage or options.form == "differential",
        end_algebraic=not tableau.ends_at_stage and options.switch_detection,
        auxiliary=(elements - 1) * (4 * pairs + 1) if lcc else 0,
        jump_size=0 if system.jump is None else system.jump.size,
        jump_states=() if system.jump is None else system.jump.states,
    )
