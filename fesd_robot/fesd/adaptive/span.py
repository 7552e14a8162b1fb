"""A simulation over a span of time, its steps chosen by error and switches."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import TypedDict

import casadi as ca
import numpy as np

from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.errors import ModelError, OptionError, nearest
from fesd_robot.fesd.adaptive.integrate import Accepted, Integration, IntegrationFailure
from fesd_robot.fesd.adaptive.one_element import OneElement
from fesd_robot.fesd.adaptive.point_modes import PointModes
from fesd_robot.fesd.simulation import Simulation, SimulationError, StepReport, passed_bound
from fesd_robot.fesd.tableau import Tableau, make_tableau
from fesd_robot.fesd.trajectory import Element, element_integrals

LARGE = 60
"""Variables of a stage from which on three stages cost less than five."""


BEYOND = 1e-10
"""By how much a state may pass its bound."""


class StepChoice(TypedDict, total=False):
    """Settings of a simulation over a span of time.

    Attributes:
        rtol: relative tolerance of the local errors, 1e-6 if omitted.
        atol: absolute tolerance, a number or (n_x), rtol / 1000 if omitted.
        max_step: longest step.
        tableau: Radau IIA of at least 2 stages; if omitted 5, 7 for an rtol below 1e-7, 3 where the system is large.
        control: u, (n_u), or (n_u, parts) on equal parts of the span; only a system without controls does without.
    """

    rtol: float
    atol: float | np.ndarray
    max_step: float
    tableau: Tableau
    control: np.ndarray


def unknown_choice(name: str) -> str:
    """Return a sentence about an argument that does not exist."""
    return f"simulate has no argument '{name}'{nearest(name, StepChoice.__annotations__)}"


@dataclass(frozen=True)
class StepControl:
    """How long the steps of a simulation over a span may be.

    Attributes:
        rtol, atol: local errors are kept below atol + rtol |x| in root mean square; atol a number or (n_x).
        max_step: longest step.
        tableau: Radau IIA of at least two stages.

    Raises:
        OptionError: a value outside its range, or another scheme.
    """

    rtol: float
    atol: float | np.ndarray
    max_step: float
    tableau: Tableau

    def __post_init__(self) -> None:
        if not 1e-13 <= self.rtol < 1.0:
            raise OptionError(f"rtol is {self.rtol:g}, must be from 1e-13 to below 1")
        if not np.all(np.asarray(self.atol) > 0.0):
            raise OptionError(f"atol is {self.atol}, must be positive")
        if not self.max_step > 0.0:
            raise OptionError(f"max_step is {self.max_step:g}, must be positive")
        if not isinstance(self.tableau, Tableau):
            raise OptionError(
                f"tableau is a {type(self.tableau).__name__}, must be a Tableau, such as make_tableau('radau_iia', 5)"
            )
        if self.tableau.scheme != "radau_iia" or self.tableau.stages < 2:
            raise OptionError(
                f"tableau is {self.tableau.scheme} with {self.tableau.stages} stages, a span of time needs "
                "radau_iia with at least 2; give a number of steps for other schemes"
            )

    @classmethod
    def of(cls, system: ComplementaritySystem, choice: StepChoice) -> StepControl:
        """Return the control with defaults for values left out; see `StepChoice`.

        Raises:
            OptionError: as the class, or a name that does not exist.
        """
        for name in choice:
            if name not in StepChoice.__annotations__:
                raise OptionError(unknown_choice(name))
        rtol = choice.get("rtol", 1e-6)
        large = system.state.numel() + system.algebraic.numel() > LARGE
        tableau = choice.get("tableau") or _radau(3 if large else 5 if rtol >= 1e-7 else 7)
        return cls(rtol, choice.get("atol", rtol * 1e-3), choice.get("max_step", np.inf), tableau)


@cache
def _radau(stages: int) -> Tableau:
    return make_tableau("radau_iia", stages)


def simulate_span(
    system: ComplementaritySystem,
    initial: np.ndarray,
    span: tuple[float, float],
    controls: np.ndarray,
    parameters: np.ndarray,
    control: StepControl,
    *,
    bounds: tuple[np.ndarray, np.ndarray],
    progress: Callable[[StepReport], None] | None = None,
) -> Simulation:
    """Integrate over a span of time from switch to switch; see `simulate`.

    Every step is one finite element of one mode. It ends at a switch if there is one, where the unknown length belongs
    to the square system (``G = 0`` at the right end), or H, with the hidden constraints of a sliding mode, is zero.

    Args:
        system: the dynamics, without vanishing constraints.
        initial: x(t_0), (n_x).
        span: t_0 and t_1.
        controls: u on equal parts of the span, (n_u, parts).
        parameters: (n_p).
        control: tolerances and scheme.
        bounds: lower and upper bounds of the state, (n_x) each.
        progress: called after every step.

    Raises:
        ModelError: a system with vanishing constraints.
        SimulationError: the motion cannot be continued, or passes a bound.
    """
    if system.jump is not None:
        raise ModelError("a span of time needs a state that is continuous, this system's jumps; give a number of steps")
    if system.vanishing:
        raise ModelError(
            "a span of time needs pairs 0 <= G _|_ H >= 0 only, this system has vanishing constraints; give a number "
            "of steps"
        )
    equations, points = OneElement.of(system, control.tableau), PointModes.of(system)
    borders = np.linspace(span[0], span[1], controls.shape[1] + 1)
    z = np.asarray(system.guess(initial, controls[:, 0], parameters), dtype=float)
    integration = Integration(
        equations, points, controls[:, 0], parameters, control.rtol, control.atol, control.max_step, span[0],
        initial, z, np.zeros(len(system.pairs), dtype=bool),
    )  # fmt: skip
    integrals = ca.Function("quadratures", system.arguments, [ca.vertcat(*system.quadratures.values(), ca.SX(0, 1))])
    elements: list[Element] = []
    modes: list[np.ndarray] = []
    totals, reports = [np.zeros(len(system.quadratures))], list[StepReport]()

    def result() -> Simulation:
        return Simulation(
            system,
            control.tableau,
            elements,
            modes,
            np.array([span[0], *(one.end for one in elements)]),
            np.array([initial, *(one.x[-1] for one in elements)]),
            dict(zip(system.quadratures, np.array(totals).T, strict=True)),
            reports,
            notes=tuple(integration.notes),
        )

    def refused(reason: str, time: float, state: np.ndarray, residual: float) -> SimulationError:
        return SimulationError(
            f"simulation step {len(elements)} at time {time:.6g} was not solved ({reason}); state "
            f"{np.array2string(state, precision=6)}, residual {residual:.1e}",
            result(), step=len(elements), time=time, state=state, residual=residual,
        )  # fmt: skip

    for k, (begin, end) in enumerate(pairwise(borders)):
        try:
            integration.begin(float(begin), controls[:, k])
            while integration.time < end:
                accepted = integration.step(float(end))
                if passed := passed_bound(system, accepted.solved.x, bounds, BEYOND):
                    raise refused(passed[0], accepted.start, accepted.x_left, passed[1])
                element = _element(accepted, k, controls[:, k])
                elements.append(element)
                modes.append(accepted.mode)
                totals.append(totals[-1] + element_integrals(integrals, control.tableau, [element], parameters))
                solved = accepted.solved
                reports.append(
                    StepReport(
                        len(reports), len(reports) + 1, element.end, "modes", accepted.attempts, accepted.iterations,
                        solved.residual, int(accepted.switched),
                    )
                )  # fmt: skip
                if progress:
                    progress(reports[-1])
        except IntegrationFailure as failure:
            words = "; ".join([*(note.text for note in integration.notes[-1:]), str(failure)])
            raise refused(words, integration.time, integration.x, np.inf) from None
    return result()


def _element(accepted: Accepted, interval: int, u: np.ndarray) -> Element:
    solved = accepted.solved
    return Element(
        interval, accepted.start, solved.h, accepted.x_left, accepted.z_left, solved.x, solved.z, u, solved.slopes
    )
