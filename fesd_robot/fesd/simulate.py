"""Integration of a complementarity system step by step, every switch located exactly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.errors import DimensionError, FesdRobotError
from fesd_robot.fesd.ocp import OptimalControlProblem
from fesd_robot.fesd.options import FesdOptions
from fesd_robot.fesd.transcription import Element, Transcription
from fesd_robot.mpcc import HomotopyOptions, solve
from fesd_robot.mpcc.assembly import assemble
from fesd_robot.mpcc.relaxation import scholtes

STARTS = ((1e-2, 0.1, 1.0), (1.0, 0.1, 1.0), (1.0, 0.35, 100.0), (1e-1, 0.1, 1.0), (1e-4, 0.1, 1.0))
"""First sigma, factor and rank ratio of a step's homotopy, and those that are tried when it fails."""


class SimulationError(FesdRobotError):
    """A step that could not be solved.

    Attributes:
        elements: the finite elements computed before it.
    """

    def __init__(self, message: str, elements: Sequence[Element]) -> None:
        super().__init__(message)
        self.elements = list(elements)


@dataclass(frozen=True)
class Simulation:
    """A simulated trajectory: finite elements in time order, and the states between the steps, (steps + 1, n_x)."""

    elements: list[Element]
    states: np.ndarray


def simulate(
    system: ComplementaritySystem,
    initial: np.ndarray,
    controls: np.ndarray,
    duration: float,
    *,
    options: FesdOptions | None = None,
    solver: HomotopyOptions | None = None,
    state_lower: np.ndarray | None = None,
    parameters: np.ndarray | None = None,
) -> Simulation:
    """Integrate x' = f(x, u, z) over `duration` in equal simulation steps.

    Each step is one control interval of finite elements whose lengths are free, solved as an MPCC of its own.

    Args:
        initial: x(0), (n_x).
        controls: u of every step, (n_u, steps).
        duration: numerical time of all steps.
        options: elements per step, scheme, equilibration.
        solver: homotopy of each step; its first sigma, factor and rank ratio are those of `STARTS`.
        state_lower: bounds of the state, (n_x); minus infinity if omitted.
        parameters: values of the system's parameters, (n_p).

    Raises:
        DimensionError: `initial` or `controls` of the wrong shape.
        SimulationError: a step was not solved; the message names its time, the exception keeps what was computed.

    Source: Nurkanovic et al., arXiv 2205.05337, section 4.
    """
    n_x, n_u = system.state.numel(), system.control.numel()
    if np.shape(initial) != (n_x,):
        raise DimensionError(f"initial has shape {np.shape(initial)}, expected ({n_x},)")
    if np.ndim(controls) != 2 or controls.shape[0] != n_u:
        raise DimensionError(f"controls has shape {np.shape(controls)}, expected ({n_u}, steps)")
    options = options or FesdOptions(elements=2)
    solver = solver or HomotopyOptions(tolerance=1e-9, max_iterations=200)
    steps = controls.shape[1]
    length = duration / steps
    values = np.zeros((0, 1)) if parameters is None else np.asarray(parameters, dtype=float).reshape(-1, 1)
    lower = np.full(n_x, -np.inf) if state_lower is None else state_lower

    def step_problem(x: np.ndarray, u: np.ndarray) -> Transcription:
        free = np.full(n_x, np.inf)
        return Transcription(
            OptimalControlProblem(
                system=system,
                duration=length,
                intervals=1,
                parameters=values,
                initial_lower=x,
                initial_upper=x,
                state_lower=lower,
                state_upper=free,
                terminal_lower=-free,
                terminal_upper=free,
                control_lower=u,
                control_upper=u,
                state_guess=lambda _: x,
                control_guess=u.reshape(-1, 1),
            ),
            options,
        )

    template = step_problem(np.asarray(initial, dtype=float), controls[:, 0])
    nlp = assemble(template.problem, scholtes)
    state, elements, states = np.asarray(initial, dtype=float), list[Element](), [np.asarray(initial, dtype=float)]
    for k in range(steps):
        lower_bounds, upper_bounds, start = step_problem(state, controls[:, k]).bounds_and_start()
        problem = replace(template.problem, lower=lower_bounds, upper=upper_bounds, start=start)
        for sigma, factor, ratio in STARTS:
            trial = replace(solver, sigma_start=max(sigma, solver.tolerance), sigma_factor=factor, rank_ratio=ratio)
            solution = solve(problem, trial, nlp=nlp)
            if solution.feasible:  # a step has no objective of its own that an NLP would have to converge in
                break
        if not solution.feasible:
            residuals = solution.residuals
            raise SimulationError(
                f"simulation step {k} at time {k * length:.6g} was not solved ({solution.status}): violation "
                f"{residuals.constraint_violation:.1e} at {residuals.worst_constraint}, complementarity "
                f"{residuals.complementarity:.1e}; state {np.array2string(state, precision=4)}",
                elements,
            )
        found = template.unpack(solution.w)
        elements += [replace(e, interval=k, start=e.start + k * length) for e in found]
        state = found[-1].x[-1]
        states.append(state)
    return Simulation(elements, np.array(states))
