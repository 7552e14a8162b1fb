"""The result of a simulation: elements, states, phases, switch times, quadratures, sensitivities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.errors import FesdRobotError, ModelError
from fesd_robot.fesd.tableau import Tableau
from fesd_robot.fesd.trajectory import Element
from fesd_robot.instants import SAME_PART


@dataclass(frozen=True)
class StepReport:
    """How one simulation step was solved.

    Attributes:
        step, steps: number of the step, from 0, and of all steps; of those so far where their number is not given.
        time: numerical time at its end.
        method: ``modes`` where the modes were found directly, ``homotopy`` where relaxed NLPs were needed,
            ``homotopy, modes`` where their result was then solved exactly.
        trials: sequences of modes, or homotopies, that were tried.
        iterations: Newton and IPOPT iterations in all.
        residual: largest residual of the step's equations.
        switches: number of switches in the step.
    """

    step: int
    steps: int
    time: float
    method: str
    trials: int
    iterations: int
    residual: float
    switches: int


@dataclass(frozen=True)
class Note:
    """Something about a motion that its user should know.

    Attributes:
        time: numerical time.
        text: what: several motions go on from a point, or switches accumulate.
    """

    time: float
    text: str


@dataclass(frozen=True)
class Phase:
    """A time span without a switch: start, end, and the active regions or step values in words.

    Attributes:
        start, end: numerical time.
        mode: (n_pairs) booleans, where H may be positive; behind them, whether each impulse acts at the start.
        regions: the mode in words.
    """

    start: float
    end: float
    mode: np.ndarray
    regions: str


@dataclass(frozen=True)
class Sensitivity:
    """Derivatives of the end state.

    Attributes:
        initial: dx(T)/dx(0), (n_x, n_x).
        parameters: dx(T)/dp, (n_x, n_p).
        controls: dx(T)/du_k of every interval, (steps, n_x, n_u).
    """

    initial: np.ndarray
    parameters: np.ndarray
    controls: np.ndarray


@dataclass(frozen=True)
class Simulation:
    """A simulated trajectory.

    Attributes:
        system, tableau: what was simulated and by which scheme.
        elements: finite elements in time order.
        modes: the mode of every element, (n_pairs + n_impulses) each, whose last entries say which impulses act at its
            left boundary; without switch detection that of its last stage.
        times, states: start, ends of the steps, and the states there, (steps + 1), (steps + 1, n_x).
        quadratures: name -> integral from the start to `times`, (steps + 1).
        reports: how every step was solved.
        sensitivity: derivatives of the end state, if they were asked for.
        notes: where several motions go on, and where switches accumulate.
    """

    system: ComplementaritySystem
    tableau: Tableau
    elements: list[Element]
    modes: list[np.ndarray]
    times: np.ndarray
    states: np.ndarray
    quadratures: Mapping[str, np.ndarray]
    reports: list[StepReport]
    sensitivity: Sensitivity | None = None
    notes: Sequence[Note] = ()

    @property
    def unique(self) -> bool:
        """Whether no note says that several motions go on from a point."""
        return not any(note.text.startswith("not ") for note in self.notes)

    @property
    def phases(self) -> list[Phase]:
        """The time spans between the switches."""
        phases: list[Phase] = []
        pairs = len(self.system.pairs)
        for element, mode in zip(self.elements, self.modes, strict=True):
            if phases and (mode[:pairs] == phases[-1].mode[:pairs]).all() and not mode[pairs:].any():
                phases[-1] = replace(phases[-1], end=element.end)
            elif element.step > 0:
                phases.append(Phase(element.start, element.end, mode, self.system.in_words(mode)))
        return phases

    @property
    def switch_times(self) -> np.ndarray:
        """Numerical times at which the mode changes."""
        return np.array([phase.start for phase in self.phases[1:]])

    def at(self, times: np.ndarray | Sequence[float]) -> np.ndarray:
        """Return the states at any times between start and end by the scheme's dense output, (m, n_x).

        Raises:
            ModelError: a time outside the simulation.
        """
        wanted = np.atleast_1d(np.asarray(times, dtype=float))
        slack = SAME_PART * max(abs(self.times[-1]), 1.0)
        outside = wanted[(wanted < self.times[0] - slack) | (wanted > self.times[-1] + slack)]
        if outside.size:
            raise ModelError(f"time {outside[0]:g} is outside the simulation, {self.times[0]:g} to {self.times[-1]:g}")
        starts = np.array([element.start for element in self.elements])
        which = np.clip(np.searchsorted(starts, wanted, side="right") - 1, 0, len(starts) - 1)
        result = np.empty((len(wanted), self.states.shape[1]))
        for index in np.unique(which):
            chosen = which == index
            result[chosen] = self.elements[index].at(self.tableau, wanted[chosen])
        return result


class SimulationError(FesdRobotError):
    """A step that could not be solved.

    Attributes:
        simulation: everything up to the step.
        step: its number, from 0.
        time: numerical time of its left end.
        state: the state there, (n_x).
        residual: largest residual or product of the best attempt.
    """

    def __init__(
        self, message: str, simulation: Simulation, *, step: int, time: float, state: np.ndarray, residual: float
    ) -> None:
        super().__init__(message)
        self.simulation = simulation
        self.step = step
        self.time = time
        self.state = state
        self.residual = residual


def passed_bound(
    system: ComplementaritySystem, states: np.ndarray, bounds: tuple[np.ndarray, np.ndarray], tolerance: float
) -> tuple[str, float] | None:
    """Return in words which bound a motion passes most, and by how much; None if none by more than a tolerance.

    Args:
        system: whose states they are.
        states: of the motion, (points, n_x).
        bounds: lower and upper, (n_x) each.
        tolerance: in the units of the states.
    """
    below, above = bounds[0] - states, states - bounds[1]
    beyond = np.maximum(below, above)
    point, i = divmod(int(np.argmax(beyond)), beyond.shape[1])
    if beyond[point, i] <= tolerance:
        return None
    side, bound = ("lower", bounds[0][i]) if below[point, i] > 0.0 else ("upper", bounds[1][i])
    words = f"its motion takes {system.state_names[i]} to {states[point, i]:.6g}, beyond state_{side} {bound:.6g}"
    return words, float(beyond[point, i])
