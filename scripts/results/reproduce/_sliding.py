"""The sliding-mode problem of arXiv 2205.05337, section 5.3: its variants, and an optimisation with its replay."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from fesd_robot.dcs import ComplementaritySystem, Model, Subsystem, stewart
from fesd_robot.fesd import FesdOptions, OptimalControlProblem, Transcription, make_tableau
from fesd_robot.mpcc import HomotopyOptions, Run, solve
from fesd_robot.mpcc.assembly import assemble
from fesd_robot.mpcc.relaxations import scholtes
from scripts.results.reproduce._filippov import CURVATURES, replay

DURATION, INTERVALS = 4.0, 6
START = np.array([2 * np.pi / 3, np.pi / 3])
TARGET = np.array([-np.pi / 6, -np.pi / 4])
TOLERANCE = 1e-12
"""Largest product of a complementarity pair."""
_COMMON = HomotopyOptions(sigma_start=1.0, sigma_factor=0.1, max_iterations=300, linear_solver="auto", compile="never")
HOMOTOPY = replace(_COMMON, tolerance=1e-10)
LAST = replace(_COMMON, sigma_start=TOLERANCE, tolerance=TOLERANCE, ipopt={"tol": TOLERANCE})
"""For the last products a barrier parameter tied to IPOPT's usual tolerance would be too large."""
TITLES = {"radau_iia": "Radau IIA", "lobatto_iiic": "Lobatto IIIC"}


@dataclass(frozen=True)
class Variant:
    """What differs between the printed, the plotted and the timed problem.

    Attributes:
        name: short name, and key of the reference values.
        about: in words.
        gain: v' = gain u.
        control_cost: the cost is v^T v + control_cost u^T u.
        control_bound, speed_bound: largest |u_i| and |v_i|.
    """

    name: str
    about: str
    gain: float
    control_cost: float
    control_bound: float
    speed_bound: float = math.inf

    def cost(self, controls: np.ndarray) -> float:
        """Return the exact cost of controls, (2, N): v is linear on every interval."""
        h, v, total = DURATION / controls.shape[1], np.zeros(2), 0.0
        for u in controls.T:
            a = self.gain * u
            total += h * (self.control_cost * u @ u + v @ v + h * v @ a + h**2 / 3 * a @ a)
            v = v + h * a
        return float(total)


VARIANTS = [
    Variant("V1", "as plotted: v' = 2u, cost ∫ v² dt, |u| ≤ 10", 2.0, 0.0, 10.0),
    Variant("V2", "as printed: v' = u, cost ∫ u² + v² dt, |u| ≤ 10, |v| ≤ 2", 1.0, 1.0, 10.0, 2.0),
    Variant("V3", "as timed: v' = 2u, cost ∫ u² + v² dt, |u| ≤ 5", 2.0, 1.0, 5.0),
]


def system_of(variant: Variant) -> ComplementaritySystem:
    """Return the dynamics, a Cartesian product of two subsystems with two regions each."""
    q, v, u = ca.SX.sym("q", 2), ca.SX.sym("v", 2), ca.SX.sym("u", 2)
    surfaces = (q[0] + CURVATURES[0] * q[1] ** 2, q[1] - CURVATURES[1] * q[0] ** 3)
    subsystems = [
        Subsystem(
            fields=ca.SX(np.outer(np.eye(4)[i], [-1.0, 1.0])),
            switching=surface,
            sign_matrix=np.array([[1], [-1]]),
            region_names=("positive", "negative"),
            name=f"phi_{i + 1}",
        )
        for i, surface in enumerate(surfaces)
    ]
    model = Model(ca.vertcat(q, v), u, state_names=("q1", "q2", "v1", "v2"), control_names=("u1", "u2"))
    return stewart(model, subsystems, drift=ca.vertcat(v, variant.gain * u))


def problem_of(variant: Variant, start: int = 0) -> OptimalControlProblem:
    """Return the problem; start 0 is a straight line at rest, 1 stays where it begins, others have random controls."""
    system = system_of(variant)
    v, free, initial = system.state[2:], np.full(2, np.inf), np.append(START, np.zeros(2))
    bounds = np.append(free, np.full(2, variant.speed_bound))
    way = (TARGET - START) * (start != 1)
    shape = (2, INTERVALS)
    return OptimalControlProblem(
        system=system,
        duration=DURATION,
        intervals=INTERVALS,
        initial_lower=initial,
        initial_upper=initial,
        state_lower=-bounds,
        state_upper=bounds,
        terminal_lower=np.append(TARGET, -free),
        terminal_upper=np.append(TARGET, free),
        control_lower=np.full(2, -variant.control_bound),
        control_upper=np.full(2, variant.control_bound),
        state_guess=lambda time: np.append(START + way * time / DURATION, np.zeros(2)),
        control_guess=np.zeros(shape) if start < 2 else np.random.default_rng(start).uniform(-1, 1, shape),
        running_cost={"cost": ca.sumsqr(v) + variant.control_cost * ca.sumsqr(system.control)},
    )


@dataclass(frozen=True)
class OptimisedRun:
    """An optimisation and what its controls really do.

    Attributes:
        scheme, stages, elements, detection: the discretisation.
        solved: to the tolerance.
        objective: as discretised.
        cost: of the controls, exact.
        error: distance between q(T) under the controls and the target.
        times: switch times under the controls.
        controls: (2, N).
        path: the positions of the discrete solution, (m, 2).
        iterations, complementarity, status: of the solver.
        seconds: processor time of the solver.
    """

    scheme: str
    stages: int
    elements: int
    detection: bool
    solved: bool
    objective: float
    cost: float
    error: float
    times: list[float]
    controls: np.ndarray
    path: np.ndarray
    iterations: int
    complementarity: float
    status: str
    seconds: float

    @property
    def label(self) -> str:
        """The discretisation in words."""
        how = "FESD" if self.detection else "fixed steps"
        return f"{TITLES[self.scheme]} {self.stages}, {self.elements} elements, {how}"


def optimise(
    variant: Variant, scheme: str, stages: int, elements: int, detection: bool = True, start: int = 0
) -> OptimisedRun:
    """Optimise by a homotopy to 1e-10 and an NLP at the tolerance, and replay the controls."""
    tableau = make_tableau(scheme, stages)
    options = FesdOptions(
        tableau=tableau, elements=elements, switch_detection=detection, step_equilibration="difference_tanh"
    )
    transcription = Transcription(problem_of(variant, start), options)
    problem = transcription.problem
    nlp = assemble(problem, scholtes, "never")
    begin = time.process_time()
    first = solve(problem, Run(HOMOTOPY), nlp=nlp)
    solution = solve(replace(problem, start=first.w), Run(LAST), nlp=nlp)
    seconds = time.process_time() - begin
    controls = transcription.controls(solution.w)
    try:
        truth = replay(START, controls, DURATION, variant.gain)
        error, times = float(np.linalg.norm(truth.end - TARGET)), truth.times
    except ArithmeticError:  # an optimisation that failed may leave anything
        error, times = math.nan, []
    path = [e.at(tableau, np.linspace(e.start, e.end, 9))[:, :2] for e in transcription.unpack(solution.w)]
    return OptimisedRun(
        scheme=scheme,
        stages=stages,
        elements=elements,
        detection=detection,
        solved=solution.solved,
        objective=transcription.cost_terms(solution.w)["cost"],
        cost=variant.cost(controls),
        error=error,
        times=times,
        controls=controls,
        path=np.vstack(path),
        iterations=first.iterations + solution.iterations,
        complementarity=solution.residuals.complementarity,
        status=solution.status,
        seconds=seconds,
    )
