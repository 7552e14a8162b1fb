"""Homotopy: a sequence of relaxed NLPs whose parameter sigma goes to the complementarity asked for."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fesd_robot.errors import SolverError
from fesd_robot.mpcc.assembly import RelaxedNlp, assemble
from fesd_robot.mpcc.ipopt import NlpPoint, converged, solve_nlp
from fesd_robot.mpcc.options import HomotopyOptions
from fesd_robot.mpcc.problem import Mpcc, Residuals
from fesd_robot.mpcc.relaxations import Relaxation, relaxation_named
from fesd_robot.mpcc.schedule import SETTLED, Sigmas, chosen_start
from fesd_robot.native import kkt_library

_TRIALS = ("first", "again")
"""An NLP that fails is tried again from the same point, with the adaptive barrier."""

_FINAL = ("interrupted", "time limit", "iteration limit")
"""Ends of an NLP after which another trial is pointless."""

_WARM_PUSHES = ("warm_start_bound_push", "warm_start_slack_bound_push", "warm_start_mult_bound_push")


@dataclass(frozen=True)
class NlpReport:
    """One NLP of the homotopy as it is shown in the progress table."""

    sigma: float
    sigma_of_rank_1: float
    status: str
    iterations: int
    seconds: float
    residuals: Residuals


@dataclass(frozen=True)
class MpccSolution:
    """The end of a homotopy.

    Attributes:
        w: the returned point.
        residuals: recomputed at w.
        feasible: constraints and complementarity within the tolerances.
        solved: feasible, and the last NLP converged at the last sigma.
        status: the last NLP's status in words.
        reports: every NLP.
        build_seconds, solve_seconds: derivatives and the NLPs.
    """

    w: np.ndarray
    residuals: Residuals
    feasible: bool
    solved: bool
    status: str
    reports: list[NlpReport]
    build_seconds: float
    solve_seconds: float

    @property
    def iterations(self) -> int:
        """IPOPT iterations in all."""
        return sum(report.iterations for report in self.reports)


def solve(
    problem: Mpcc,
    options: HomotopyOptions | None = None,
    *,
    relaxation: Relaxation | None = None,
    nlp: RelaxedNlp | None = None,
    progress: Callable[[NlpReport], None] | None = None,
    stop: Callable[[int, float], bool] | None = None,
) -> MpccSolution:
    """Solve an MPCC by relaxed NLPs with sigma -> tolerance, IPOPT's tolerance tied to sigma.

    Every pair 0 <= G, 0 <= H, G H = 0 is held at G H <= sigma, or what the relaxation says. An NLP that fails twice
    ends the homotopy; the best point so far is returned with its residuals, and `solved` is False.

    Args:
        relaxation: instead of the options' one.
        nlp: the relaxed problem, if it was assembled before (for a problem with the same blocks); its relaxation and
            steering are the ones it was assembled with.
        progress: called after every NLP.
        stop: called once an IPOPT iteration with (iteration, objective); True ends the solve.

    Raises:
        ModelError: the relaxation cannot hold one-sided pairs, and the problem has some.
        SolverError: IPOPT could not be started.

    Source: Scholtes 2001; Nurkanovic, Pozharskiy, Diehl, arXiv 2312.11022 (comparison of homotopies).
    """
    options = options or HomotopyOptions()
    if not any(block.pair_ranks.any() for block in problem.blocks):
        options = replace(options, rank_ratio=1.0)
    begin = time.perf_counter()
    nlp = nlp or assemble(
        problem, relaxation or relaxation_named(options.relaxation), options.compile, options.steering
    )
    build_seconds = time.perf_counter() - begin
    size, elastic = problem.size, nlp.slacks.count > 0
    sigma_start = options.sigma_start or max(chosen_start(problem, options.rank_ratio), options.tolerance)
    last = options.tolerance if elastic else nlp.relaxation.last_sigma(options.tolerance)
    steps = options.steps(sigma_start, last)
    slack_upper = nlp.slacks.upper(sigma_start, options.rank_ratio)
    lower, upper = np.append(problem.lower, np.zeros(nlp.slacks.count)), np.append(problem.upper, slack_upper)
    start = np.append(problem.start, 0.5 * slack_upper)
    point = NlpPoint(start, np.zeros(len(start)), np.zeros(len(nlp.lower)))
    reports: list[NlpReport] = []
    best, status, finished, exact = point, "not started", False, False
    violation = problem.residuals(problem.start).constraint_violation
    begin = time.perf_counter()
    sigmas = steps.start()
    while not finished:
        for trial in _TRIALS:
            remaining = None if options.time_limit is None else options.time_limit - (time.perf_counter() - begin)
            if remaining is not None and remaining <= 0:
                status = "time limit"
                break
            result = solve_nlp(
                nlp,
                sigma=sigmas,
                start=point,
                lower=lower,
                upper=upper,
                options=_ipopt_options(options, sigmas, remaining, trial, elastic or steps.is_last(sigmas)),
                stop=stop,
            )
            status = result.status
            residuals = problem.residuals(result.point.x[:size])
            reports.append(NlpReport(*sigmas, status, result.iterations, result.seconds, residuals))
            if progress:
                progress(reports[-1])
            if result.converged or residuals.constraint_violation < max(violation, options.feasibility):
                best, violation = result.point, residuals.constraint_violation
            if result.converged or status in _FINAL:
                break
        if not converged(status):
            break
        point, violation = result.point, 0.0
        exact = point.x[size:].max(initial=0.0) <= options.tolerance and _is_feasible(residuals, options)
        finished = steps.is_last(sigmas) or (elastic and exact)
        sigmas = steps.after(sigmas, result.iterations)
    residuals = problem.residuals(best.x[:size])
    feasible = _is_feasible(residuals, options)
    if finished and elastic and not exact:
        finished, status = False, "slack left"
    return MpccSolution(
        w=best.x[:size],
        residuals=residuals,
        feasible=feasible,
        solved=finished and feasible,
        status=status,
        reports=reports,
        build_seconds=build_seconds,
        solve_seconds=time.perf_counter() - begin,
    )


def _is_feasible(residuals: Residuals, options: HomotopyOptions) -> bool:
    product, violation = residuals.complementarity, residuals.constraint_violation
    return violation <= options.feasibility and product <= 1.01 * options.tolerance


def _linear_solver(name: str) -> dict[str, Any]:
    """IPOPT's options that choose a linear solver; ours stands in for HSL's MA27."""
    if name not in ("auto", "fesd"):
        return {"linear_solver": name}
    library = kkt_library()
    if library:
        return {"linear_solver": "ma27", "hsllib": str(library), "linear_system_scaling": "none"}
    if name == "fesd":
        raise SolverError("linear solver 'fesd' needs a C++ compiler (the log says what failed; valid: auto, mumps)")
    return {"linear_solver": "mumps"}


def _ipopt_options(
    options: HomotopyOptions, sigmas: Sigmas, remaining: float | None, trial: str, last: bool
) -> dict[str, Any]:
    """IPOPT's options for one sigma; no NLP but one that may be the last is more accurate than its sigma deserves."""
    sigma, sigma_of_rank_1 = sigmas
    tolerance = max(min(0.1 * (options.tolerance if last else sigma), 1e-3), 1e-9)
    settings: dict[str, Any] = {
        **_linear_solver(options.linear_solver),
        "max_iter": options.max_iterations,
        "tol": tolerance,
        "constr_viol_tol": min(0.1 * options.feasibility, 0.005 * options.tolerance) if last else min(tolerance, 1e-6),
        "acceptable_iter": 0,
        "mu_strategy": "monotone",
        "bound_relax_factor": 0.0,
        "honor_original_bounds": "no",
    }
    if sigma_of_rank_1 <= SETTLED:
        settings |= {"warm_start_init_point": "yes", "mu_init": max(sigma, 1e-9), **dict.fromkeys(_WARM_PUSHES, 1e-8)}
    if trial == "again":
        settings |= {"mu_strategy": "adaptive", "mu_oracle": "quality-function"}
    if remaining is not None:
        settings["max_wall_time"] = remaining
    return {**settings, **options.ipopt}
