"""The problem of arXiv 2205.05337, section 4.6: its objective by simulation, and ways to optimise it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import TypeVar

import casadi as ca
import numpy as np

from fesd_robot.dcs import ComplementaritySystem, Model, Subsystem, stewart
from fesd_robot.fesd import FesdOptions, SimulationSettings, StepEquilibration, make_tableau, simulate
from fesd_robot.fesd.ocp import OptimalControlProblem
from fesd_robot.fesd.tableau import Tableau
from fesd_robot.fesd.transcription import Transcription
from fesd_robot.mpcc import HomotopyOptions, Run, solve
from fesd_robot.mpcc.assembly import assemble
from fesd_robot.mpcc.relaxations import scholtes

Number = TypeVar("Number", float, np.ndarray)

DURATION, ELEMENTS, TARGET = 2.0, 25, 5 / 3
LEFT, RIGHT = -2.0, -0.8
TABLEAU = make_tableau("gauss_legendre", 2)
SIGMA = 1e-9
"""Last, or only, relaxation of the complementarity products."""
_COMMON = HomotopyOptions(tolerance=SIGMA, sigma_start=1.0, velocity_level_ratio=1.0, linear_solver="mumps")
SOLVERS = {
    "homotopy": replace(_COMMON, sigma_factor=0.1),
    "single NLP": replace(_COMMON, sigma_start=SIGMA),
}


def exact_objective(x0: Number) -> Number:
    """V for -6 <= x0 <= 0."""
    return -(x0**3) / 9 + (2 + x0 / 3) ** 3 / 3 + ((1 + x0) / 3) ** 2


def exact_gradient(x0: Number) -> Number:
    """Derivative of V for -6 <= x0 <= 0."""
    return -(x0**2) / 3 + (2 + x0 / 3) ** 2 / 3 + 2 * (1 + x0) / 9


def crossing(with_cost: bool) -> ComplementaritySystem:
    """x' = 3 left of zero and 1 right of it; with the integral of x^2 as second state, which makes gradients exact."""
    state = ca.SX.sym("x", 1 + with_cost)
    fields = ca.SX([[3.0, 1.0]])
    return stewart(
        Model(state),
        Subsystem(
            fields=ca.vertcat(fields, ca.SX.zeros(int(with_cost), 2)),
            switching=state[0],
            sign_matrix=np.array([[-1], [1]]),
            region_names=("left", "right"),
        ),
        drift=ca.vertcat(0, state[0] ** 2) if with_cost else None,
    )


@dataclass(frozen=True)
class Point:
    """The objective at one x0: value, derivative, and dx(2)/dx0."""

    value: float
    gradient: float
    end: float


class Objective:
    """V(x0) by simulation, with or without switch detection."""

    def __init__(self, switch_detection: bool, tableau: Tableau = TABLEAU) -> None:
        self.system = crossing(with_cost=True)
        # The lengths of an interval's elements are free, so all of them must be in one interval; fixed steps need not.
        self.steps, elements = (1, ELEMENTS) if switch_detection else (ELEMENTS, 1)
        self.options = FesdOptions(tableau=tableau, elements=elements, switch_detection=switch_detection)

    def __call__(self, x0: float) -> Point:
        """Return value and derivatives."""
        start = np.array([x0, 0.0])
        simulation = simulate(
            self.system,
            start,
            self.steps,
            DURATION,
            options=self.options,
            settings=SimulationSettings(sensitivities=True),
        )
        assert simulation.sensitivity
        (x, cost), sensitivity = simulation.states[-1], simulation.sensitivity.initial
        gradient = sensitivity[1, 0] + 2 * (x - TARGET) * sensitivity[0, 0]
        return Point(cost + (x - TARGET) ** 2, gradient, sensitivity[0, 0])


def golden_section(function: Callable[[float], float], low: float, high: float, width: float) -> float:
    """Return where a function with one minimum in between has it."""
    part = (np.sqrt(5.0) - 1) / 2
    inner = [high - part * (high - low), low + part * (high - low)]
    values = [function(x) for x in inner]
    while high - low > width:
        if values[0] < values[1]:
            high, inner[1], values[1] = inner[1], inner[0], values[0]
            inner[0] = high - part * (high - low)
            values[0] = function(inner[0])
        else:
            low, inner[0], values[0] = inner[0], inner[1], values[1]
            inner[1] = low + part * (high - low)
            values[1] = function(inner[1])
    return 0.5 * (low + high)


def local_minima(objective: Objective, grid: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return x0 and V of the local minima, refined."""
    inside = np.flatnonzero((values[1:-1] < values[:-2]) & (values[1:-1] <= values[2:])) + 1
    where = [golden_section(lambda x: objective(x).value, grid[i - 1], grid[i + 1], 1e-6) for i in inside]
    return np.array([[x, objective(x).value] for x in where])


@dataclass
class Optima:
    """Results of one way to optimise x0 by the start; failed runs are missing in `by_start`."""

    name: str
    published: str
    by_start: dict[float, float] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)
    iterations: int = 0

    @property
    def values(self) -> np.ndarray:
        """The optima, in the order of the starts."""
        return np.array(list(self.by_start.values()))


class Optimizer:
    """The optimal control problem with x0 free, started from simulations.

    Args:
        switch_detection: or fixed steps.
        equilibration: what makes steps equal where no switch is.
    """

    def __init__(self, switch_detection: bool, equilibration: StepEquilibration) -> None:
        system = crossing(with_cost=False)
        x = system.state
        ocp = OptimalControlProblem(
            system=system,
            duration=DURATION,
            state_guess=lambda time: np.array([-1.0]),
            running_cost={"x squared": x**2},
            terminal_cost={"distance at the end": (x - TARGET) ** 2},
        )
        options = FesdOptions(
            tableau=TABLEAU,
            elements=ELEMENTS,
            switch_detection=switch_detection,
            step_equilibration=equilibration,
        )
        self.system, self.options = system, options
        self.transcription = Transcription(ocp, options)
        self.nlp = assemble(self.transcription.problem, scholtes)

    def starts(self, points: Iterable[float]) -> dict[float, np.ndarray]:
        """Return the simulated points of the MPCC by x0."""
        packed = {}
        for x0 in points:
            simulation = simulate(self.system, np.array([x0]), 1, DURATION, options=self.options)
            packed[x0] = self.transcription.pack(simulation.elements)
        return packed

    def run(self, optima: Optima, solver: HomotopyOptions, starts: dict[float, np.ndarray]) -> Optima:
        """Optimise from every start."""
        for x0, start in starts.items():
            solution = solve(replace(self.transcription.problem, start=start), Run(solver), nlp=self.nlp)
            optima.iterations += solution.iterations
            if solution.solved:
                optima.by_start[x0] = float(solution.w[0])
            else:
                optima.failures.append(f"{optima.name} from {x0:.3f}: {solution.status}")
        return optima


def optimise(starts: np.ndarray, published: dict[str, list[float]]) -> list[Optima]:
    """All four ways to optimise, from all starts, and FESD with the quadratic equilibration from some."""
    ways = []
    discretised: tuple[tuple[bool, StepEquilibration, str], ...] = (
        (True, "difference_product", "fesd"),
        (False, "none", "fixed-step"),
    )
    for detection, equilibration, label in discretised:
        optimizer = Optimizer(detection, equilibration)
        simulated = optimizer.starts(starts)
        for mode, solver in SOLVERS.items():
            values = published[f"{label} {mode}"]
            shown = f"{min(values):g} … {max(values):g}" if max(values) > min(values) else f"{values[0]:g}"
            title = f"{'FESD' if detection else 'fixed steps'}, {mode}"
            ways.append(optimizer.run(Optima(title, shown), solver, simulated))
    optimizer = Optimizer(True, "mean")
    quadratic = Optima("FESD, homotopy, quadratic equilibration", ways[0].published)
    ways.append(optimizer.run(quadratic, SOLVERS["homotopy"], optimizer.starts(starts[::5])))
    return ways
