"""Piecewise smooth optimal control problems in Stewart's form, written down once and posed to either tool."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import casadi as ca
import numpy as np

from fesd_robot.dcs import Model, Subsystem, stewart
from fesd_robot.fesd import FesdOptions, OptimalControlProblem, Transcription, make_tableau
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import HomotopyOptions, Run, solve
from scripts.benchmarks.compare import nosnoc_tool
from scripts.benchmarks.compare.outcome import Outcome, Settings, show_nlp
from scripts.benchmarks.compare.samples import Samples

TABLEAU = make_tableau("radau_iia", 2)
SIGNS = np.array([[1], [-1]])

Judge = Callable[[Samples], tuple[float, dict[str, str]]]
"""Trajectory -> cost, and what else tells two motions apart: label -> text."""


@dataclass(frozen=True)
class Side:
    """A switching function c, and the field on each side of its zero, SX (n_x)."""

    switching: ca.SX
    positive: ca.SX
    negative: ca.SX


@dataclass(frozen=True)
class SwitchedProblem:
    """min int running dt + terminal(x(T)), x' = sum over `sides` of the field on the side where x is.

    Radau IIA with two stages. The solver starts at x = x(0), u = 0 everywhere.

    Attributes:
        name: for messages.
        state, control: SX symbols (n_x), (n_u).
        sides: independent switches; their fields add up.
        running, terminal: SX in (x, u) and in x.
        initial: x(0), (n_x).
        target: x(T), (n_x), NaN where it is free.
        state_limit, control_limit: largest magnitudes.
        duration: s. intervals, elements: control intervals, finite elements of each.
        form, equilibration, weight, width: of the discretisation, in the words of `FesdOptions`.
        comp_tol: nosnoc's tolerance, its authors' choice.
    """

    name: str
    state: ca.SX
    control: ca.SX
    sides: Sequence[Side]
    running: ca.SX
    terminal: ca.SX
    initial: np.ndarray
    target: np.ndarray
    state_limit: np.ndarray
    control_limit: float
    duration: float
    intervals: int
    elements: int
    form: Literal["integral", "differential"]
    equilibration: Literal["mean", "difference", "difference_tanh"]
    weight: float
    comp_tol: float
    width: float = 0.1

    def judge(self, samples: Samples) -> tuple[float, dict[str, str]]:
        """Return the cost of a trajectory, and how far its end is from where it must be."""
        cost = samples.cost(self.state, self.control, self.running, self.terminal)
        if np.isnan(self.target).all():
            return cost, {}
        return cost, {"error of x(T)": f"{np.nanmax(np.abs(samples.points[-1, -1] - self.target)):.1e}"}


def optimal_control_problem(problem: SwitchedProblem) -> OptimalControlProblem:
    """Return a problem in fesd-robot's words."""
    n_u, count = problem.control.numel(), problem.intervals
    system = stewart(
        Model(problem.state, problem.control),
        [
            Subsystem(
                name=f"switch {i}",
                switching=side.switching,
                sign_matrix=SIGNS,
                fields=ca.horzcat(side.positive, side.negative),
            )
            for i, side in enumerate(problem.sides)
        ],
    )
    return OptimalControlProblem(
        system=system,
        duration=problem.duration,
        intervals=count,
        initial_lower=problem.initial,
        initial_upper=problem.initial,
        state_lower=-problem.state_limit,
        state_upper=problem.state_limit,
        terminal_lower=np.nan_to_num(problem.target, nan=-np.inf),
        terminal_upper=np.nan_to_num(problem.target, nan=np.inf),
        control_lower=np.full(n_u, -problem.control_limit),
        control_upper=np.full(n_u, problem.control_limit),
        running_cost={"running": problem.running},
        terminal_cost={"terminal": problem.terminal},
    )


def ours(describe: Callable[[], SwitchedProblem], settings: Settings) -> Outcome:
    """Solve with fesd-robot."""
    begin = time.perf_counter(), time.process_time()
    problem = describe()
    ocp = optimal_control_problem(problem)
    transcription = Transcription(
        ocp,
        FesdOptions(
            tableau=TABLEAU,
            elements=problem.elements,
            form=problem.form,
            step_equilibration=problem.equilibration,
            equilibration_weight=problem.weight,
            equilibration_width=problem.width,
        ),
    )
    return solved(transcription, settings, begin, problem.judge)


def solved(transcription: Transcription, settings: Settings, begin: tuple[float, float], judge: Judge) -> Outcome:
    """Run fesd-robot's homotopy and return the run in the words of the comparison.

    Args:
        begin: `time.perf_counter` and `time.process_time` before the description of the problem.
        judge: trajectory -> (cost, what else tells two motions apart).
    """
    options = HomotopyOptions(tolerance=settings.tolerance, sigma_start=1.0, linear_solver=settings.linear_solver)
    polisher = BranchTranscription(transcription)
    solution = solve(transcription.problem, Run(options, report=show_nlp), polisher=polisher)
    wall, cpu = time.perf_counter() - begin[0], time.process_time() - begin[1]
    cost, further = judge(Samples.of(transcription.unpack(solution.w), transcription.options.tableau))
    residuals = solution.residuals
    return Outcome(
        verdict="solved" if solution.solved else "not solved",
        last_nlp=solution.status,
        wall_seconds=wall,
        cpu_seconds=cpu,
        iterations=solution.iterations,
        complementarity=residuals.complementarity,
        constraint_violation=residuals.constraint_violation,
        objective=residuals.objective,
        cost=cost,
        variables=transcription.problem.size,
        constraints=transcription.problem.constraints,
        further=further,
        homotopy=[
            {
                "sigma": step.sigma,
                "iterations": step.iterations,
                "seconds": step.seconds,
                "status": step.status,
                "objective": step.residuals.objective,
                "complementarity": step.residuals.complementarity,
                "constraint_violation": step.residuals.constraint_violation,
            }
            for step in solution.reports
        ],
        details={"solve_seconds": solution.solve_seconds, "cost_terms": transcription.cost_terms(solution.w)},
    )


def nosnoc(describe: Callable[[], SwitchedProblem], settings: Settings) -> Outcome:
    """Solve with nosnoc."""
    import nosnoc

    begin = time.perf_counter(), time.process_time()
    problem = describe()
    modes = nosnoc.StepEquilibrationMode
    opts = nosnoc_tool.options()
    opts.terminal_time = problem.duration
    opts.N_stages, opts.N_finite_elements = problem.intervals, problem.elements
    opts.irk_scheme, opts.n_s = nosnoc.IrkSchemes.RADAU_IIA, TABLEAU.stages
    opts.irk_representation = nosnoc.IrkRepresentation[problem.form.upper()]
    opts.step_equilibration = {
        "mean": modes.HEURISTIC_MEAN,
        "difference": modes.HEURISTIC_DELTA,
        "difference_tanh": modes.L2_RELAXED_SCALED,
    }[problem.equilibration]
    opts.rho_h, opts.step_equilibration_sigma = problem.weight, problem.width
    opts.comp_tol = problem.comp_tol
    model = nosnoc.NosnocModel(
        name=problem.name,
        x=problem.state,
        x0=problem.initial,
        u=problem.control,
        F=[ca.horzcat(side.positive, side.negative) for side in problem.sides],
        c=[side.switching for side in problem.sides],
        S=[SIGNS] * len(problem.sides),
    )
    fixed = np.flatnonzero(~np.isnan(problem.target)).tolist()
    ocp = nosnoc.NosnocOcp(
        lbu=np.full(problem.control.numel(), -problem.control_limit),
        ubu=np.full(problem.control.numel(), problem.control_limit),
        lbx=-problem.state_limit,
        ubx=problem.state_limit,
        f_q=problem.running,
        f_terminal=problem.terminal,
        g_terminal=problem.state[fixed] - ca.DM(problem.target[fixed]),
    )
    solution = nosnoc_tool.run(opts, model, ocp, begin)
    return solution.outcome(*problem.judge(solution.samples(TABLEAU)))
