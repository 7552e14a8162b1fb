"""Homotopy: a sequence of relaxed NLPs whose parameter sigma goes to the complementarity asked for."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fesd_robot.errors import SolverError
from fesd_robot.mpcc.assembly import Compile, RelaxedNlp, assemble
from fesd_robot.mpcc.ipopt import NlpPoint, converged, solve_nlp
from fesd_robot.mpcc.problem import Mpcc, Residuals
from fesd_robot.mpcc.relaxation import Relaxation, scholtes
from fesd_robot.native import kkt_library

SETTLED = 5e-3
"""Below this sigma of rank 1 the active set hardly changes: NLPs start warm, sigma falls by its factor squared."""

_TRIALS = ("first", "again")
"""An NLP that fails is tried again from the same point, with the adaptive barrier."""

_FINAL = ("interrupted", "time limit", "iteration limit")
"""Ends of an NLP after which another trial is pointless."""

_WARM_PUSHES = ("warm_start_bound_push", "warm_start_slack_bound_push", "warm_start_mult_bound_push")


@dataclass(frozen=True)
class HomotopyOptions:
    """How sigma is driven to zero.

    Args:
        tolerance: product a b asked for in every pair; the last sigma.
        sigma_start, sigma_factor: first sigma and the factor from one NLP to the next.
        rank_ratio: how much larger sigma is for pairs of rank 1, if there are any, until rank 0 has reached the
            tolerance.
        max_iterations: IPOPT iterations per NLP.
        time_limit: seconds for the whole homotopy.
        linear_solver: ``fesd`` is our own (`native.kkt_library`), ``auto`` that or MUMPS where it cannot be compiled;
            else one of IPOPT's.
        compile: whether the NLP's functions become machine code: ``always``, ``never``, or ``auto``: large ones where
            there is a C compiler.
        feasibility: largest constraint violation of a solved problem; IPOPT is asked for a tenth of it at the end.
        ipopt: further IPOPT options, by IPOPT's names.

    Raises:
        ValueError: a tolerance, factor or ratio outside its range.
    """

    tolerance: float = 1e-8
    sigma_start: float = 1.0
    sigma_factor: float = 0.35
    rank_ratio: float = 1000.0
    max_iterations: int = 1000
    time_limit: float | None = None
    linear_solver: str = "mumps"
    compile: Compile = "auto"
    feasibility: float = 1e-8
    ipopt: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not 0 < self.tolerance <= self.sigma_start:
            raise ValueError(f"need 0 < tolerance <= sigma_start, found {self.tolerance:g} and {self.sigma_start:g}")
        if not 0 < self.sigma_factor < 1:
            raise ValueError(f"sigma_factor must be between 0 and 1, found {self.sigma_factor:g}")
        if not self.rank_ratio >= 1:
            raise ValueError(f"rank_ratio must be at least 1, found {self.rank_ratio:g}")

    def sigmas(self) -> list[tuple[float, float]]:
        """The sequence of sigma for pairs of rank 0 and 1; both end at the tolerance exactly."""
        values = [(self.sigma_start, self.sigma_start * self.rank_ratio)]
        while max(values[-1]) > self.tolerance:
            factor = self.sigma_factor if values[-1][1] > SETTLED else self.sigma_factor**2
            smaller = [value * factor for value in values[-1]]
            first, second = (self.tolerance if value < 1.0001 * self.tolerance else value for value in smaller)
            values.append((first, second))
        return values


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
    relaxation: Relaxation = scholtes,
    nlp: RelaxedNlp | None = None,
    progress: Callable[[NlpReport], None] | None = None,
    stop: Callable[[int, float], bool] | None = None,
) -> MpccSolution:
    """Solve an MPCC by relaxed NLPs with sigma -> tolerance, IPOPT's tolerance tied to sigma.

    Every pair 0 <= G, 0 <= H, G H = 0 is held at G H <= sigma. An NLP that fails twice ends the homotopy; the best
    point so far is returned with its residuals, and `solved` is False.

    Args:
        nlp: the relaxed problem, if it was assembled before (for a problem with the same blocks).
        progress: called after every NLP.
        stop: called once an IPOPT iteration with (iteration, objective); True ends the solve.

    Source: Scholtes 2001; Nurkanovic, Pozharskiy, Diehl, arXiv 2312.11022 (comparison of homotopies).
    """
    options = options or HomotopyOptions()
    if not any(block.pair_ranks.any() for block in problem.blocks):
        options = replace(options, rank_ratio=1.0)
    begin = time.perf_counter()
    nlp = nlp or assemble(problem, relaxation, options.compile)
    build_seconds = time.perf_counter() - begin
    point = NlpPoint(problem.start, np.zeros(problem.size), np.zeros(len(nlp.lower)))
    reports: list[NlpReport] = []
    best, status, finished = point, "not started", False
    violation = problem.residuals(point.x).constraint_violation
    begin = time.perf_counter()
    for sigmas in options.sigmas():
        for trial in _TRIALS:
            remaining = None if options.time_limit is None else options.time_limit - (time.perf_counter() - begin)
            if remaining is not None and remaining <= 0:
                status = "time limit"
                break
            result = solve_nlp(
                nlp,
                sigma=sigmas,
                start=point,
                lower=problem.lower,
                upper=problem.upper,
                options=_ipopt_options(options, sigmas, remaining, trial),
                stop=stop,
            )
            status = result.status
            residuals = problem.residuals(result.point.x)
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
    else:
        finished = True
    residuals = problem.residuals(best.x)
    feasible = (
        residuals.constraint_violation <= options.feasibility and residuals.complementarity <= 1.01 * options.tolerance
    )
    return MpccSolution(
        w=best.x,
        residuals=residuals,
        feasible=feasible,
        solved=finished and feasible,
        status=status,
        reports=reports,
        build_seconds=build_seconds,
        solve_seconds=time.perf_counter() - begin,
    )


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
    options: HomotopyOptions, sigmas: tuple[float, float], remaining: float | None, trial: str
) -> dict[str, Any]:
    """IPOPT's options for one sigma; no NLP is solved more accurately than its sigma deserves."""
    sigma, sigma_of_rank_1 = sigmas
    last = sigma_of_rank_1 <= 1.0001 * options.tolerance
    tolerance = max(min(0.1 * sigma, 1e-3), 1e-9)
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
