"""Homotopy: a sequence of relaxed NLPs whose parameter sigma goes to the complementarity asked for."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fesd_robot.errors import SolverError
from fesd_robot.mpcc.assembly import RelaxedNlp, assemble
from fesd_robot.mpcc.ipopt import NlpPoint, NlpResult, solve_nlp
from fesd_robot.mpcc.options import HomotopyOptions
from fesd_robot.mpcc.polishing import ITERATIONS, BranchNlp, Polisher, PolishingReport
from fesd_robot.mpcc.problem import Mpcc, Residuals
from fesd_robot.mpcc.relaxations import Relaxation, relaxation_named
from fesd_robot.mpcc.schedule import SETTLED, Sigmas, chosen_start
from fesd_robot.native import ipopt_options, kkt_library

_TRIALS = ("first", "again")
"""An NLP that fails is tried again from the same point, with the adaptive barrier."""

_FINAL = ("interrupted", "time limit", "iteration limit")
"""Ends of an NLP after which another trial is pointless."""

LOSS = 0.2
"""Share of the cost that an exact point may lose against the relaxed one; a structure that costs more was misread."""

LOOSE_TOLERANCE = 1e-2
"""IPOPT's tolerance while loose; constraints hold to the sigma of rank 1 where that is smaller."""

_WARM_PUSHES = ("warm_start_bound_push", "warm_start_slack_bound_push", "warm_start_mult_bound_push")


@dataclass(frozen=True)
class NlpReport:
    """One NLP as it is shown in the progress table; both sigmas are zero in an NLP of the finish."""

    sigma: float
    velocity_level_sigma: float
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
        solved: feasible, and the last NLP converged at the last sigma or in the finish.
        exact: the finish found a point whose products are zero to round-off.
        status: the last NLP's status in words.
        reports: every NLP.
        build_seconds, solve_seconds: derivatives and the NLPs.
    """

    w: np.ndarray
    residuals: Residuals
    feasible: bool
    solved: bool
    exact: bool
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
    polisher: Polisher[Any] | None = None,
    progress: Callable[[NlpReport], None] | None = None,
    stop: Callable[[int, float], bool] | None = None,
) -> MpccSolution:
    """Solve an MPCC by relaxed NLPs with sigma -> tolerance, IPOPT's tolerance tied to sigma.

    Every pair 0 <= G, 0 <= H, G H = 0 is held at G H <= sigma, or what the relaxation says. An NLP that fails twice
    ends the homotopy; the best point so far is returned with its residuals, and `solved` is False.

    With a polisher the homotopy is a sketch first: NLPs of a few iterations (`options.loose_iterations`), converged or
    not, down to `options.polish_at`. What vanishes where is read off there, and the smooth problem on that structure is
    solved; its end is exact. Where no structure fits, the homotopy goes on with NLPs that converge, and the finish is
    tried again at its end.

    Args:
        relaxation: instead of the options' one.
        nlp: the relaxed problem, if it was assembled before (for a problem with the same blocks); its relaxation and
            steering are the ones it was assembled with.
        polisher: reads structures of this problem, see `finish`.
        progress: called after every NLP.
        stop: called once an IPOPT iteration with (iteration, objective); True ends the solve.

    Raises:
        ModelError: the relaxation cannot hold one-sided pairs, and the problem has some.
        SolverError: IPOPT could not be started.

    Source: Scholtes 2001; Nurkanovic, Pozharskiy, Diehl, arXiv 2312.11022 (comparison of homotopies).
    """
    options = options or HomotopyOptions()
    if not any(block.pair_ranks.any() for block in problem.blocks):
        options = replace(options, velocity_level_ratio=1.0)
    begin = time.perf_counter()
    nlp = nlp or assemble(
        problem, relaxation or relaxation_named(options.relaxation), options.compile, options.steering
    )
    smooth = BranchNlp.of(polisher, options.compile) if polisher and options.finish else None
    return _Run(problem, options, nlp, smooth, progress, stop).solved(time.perf_counter() - begin)


class _Run:
    """One homotopy: where it is, and what it has seen."""

    def __init__(
        self,
        problem: Mpcc,
        options: HomotopyOptions,
        nlp: RelaxedNlp,
        smooth: BranchNlp | None,
        progress: Callable[[NlpReport], None] | None,
        stop: Callable[[int, float], bool] | None,
    ) -> None:
        self._problem, self._options, self._nlp, self._smooth = problem, options, nlp, smooth
        self._progress, self._stop = progress, stop
        self._elastic = nlp.slacks.count > 0
        sigma_start = options.sigma_start or max(chosen_start(problem, options.velocity_level_ratio), options.tolerance)
        last = options.tolerance if self._elastic else nlp.relaxation.last_sigma(options.tolerance)
        self._steps = options.steps(sigma_start, last)
        slack_upper = nlp.slacks.upper(sigma_start, options.velocity_level_ratio)
        self._lower = np.append(problem.lower, np.zeros(nlp.slacks.count))
        self._upper = np.append(problem.upper, slack_upper)
        start = np.append(problem.start, 0.5 * slack_upper)
        self._point = self._best = NlpPoint(start, np.zeros(len(start)), np.zeros(len(nlp.lower)))
        self._violation = problem.residuals(problem.start).constraint_violation
        self._reports: list[NlpReport] = []
        self._status = "not started"
        self._begin = time.perf_counter()

    def solved(self, build_seconds: float) -> MpccSolution:
        """Run to the end."""
        size, sigmas = self._problem.size, self._steps.start()
        exact: PolishingReport | None = None
        candidate: PolishingReport | None = None
        loose, finished = self._smooth is not None and not self._elastic, False
        while not finished:
            loose = loose and not self._steps.is_last(sigmas)
            result = self._nlp_at(sigmas, loose)
            if result is None or not (result.converged or (loose and result.status == "iteration limit")):
                break
            self._point = result.point
            slack = self._point.x[size:].max(initial=0.0)
            settled = slack <= self._options.tolerance and self._is_feasible(self._reports[-1].residuals)
            finished = self._steps.is_last(sigmas) or (self._elastic and settled)
            if self._smooth and (finished or (loose and sigmas[0] <= self._options.polish_at)):
                found, loose = self._polish(), False
                relaxed = self._problem.residuals(self._point.x[:size]).objective
                if found and _keeps_cost(found.residuals.objective, relaxed, sigmas[0]):
                    exact = found
                if exact or self._status in ("interrupted", "time limit"):
                    break
                candidate = found or candidate
            if finished and self._elastic and not settled:
                finished, self._status = False, "slack left"
                break
            sigmas = self._steps.after(sigmas, result.iterations)
        if exact is None and not (finished and self._is_feasible(self._problem.residuals(self._best.x[:size]))):
            exact = candidate
        w = exact.w if exact else self._best.x[:size]
        residuals = self._problem.residuals(w)
        feasible = self._is_feasible(residuals)
        return MpccSolution(
            w=w,
            residuals=residuals,
            feasible=feasible,
            solved=(finished or exact is not None) and feasible,
            exact=exact is not None,
            status=exact.status if exact else self._status,
            reports=self._reports,
            build_seconds=build_seconds,
            solve_seconds=time.perf_counter() - self._begin,
        )

    def _nlp_at(self, sigmas: Sigmas, loose: bool) -> NlpResult | None:
        """Solve the NLP at these sigmas, twice if it fails; None when the time is over."""
        for trial in _TRIALS:
            remaining = self._remaining()
            if remaining is not None and remaining <= 0:
                self._status = "time limit"
                return None
            last = self._elastic or self._steps.is_last(sigmas)
            settings = _ipopt_options(self._options, sigmas, remaining, trial, last, loose)
            result = solve_nlp(
                self._nlp,
                sigma=sigmas,
                start=self._point,
                lower=self._lower,
                upper=self._upper,
                options=settings,
                stop=self._stop,
            )
            residuals = self._problem.residuals(result.point.x[: self._problem.size])
            self._report(NlpReport(*sigmas, result.status, result.iterations, result.seconds, residuals))
            better = residuals.constraint_violation < max(self._violation, self._options.feasibility)
            if loose or result.converged or better:
                self._best = result.point
                self._violation = 0.0 if result.converged else residuals.constraint_violation
            if result.converged or result.status in _FINAL:
                break
        return result

    def _polish(self) -> PolishingReport | None:
        def report(found: PolishingReport) -> None:
            self._report(NlpReport(0.0, 0.0, found.status, found.iterations, found.seconds, found.residuals))

        before = self._status
        assert self._smooth is not None
        exact = self._smooth.solve(
            self._problem,
            self._point.x[: self._problem.size],
            options={**_linear_solver(self._options.linear_solver), **self._options.ipopt},
            iterations=min(ITERATIONS, self._options.max_iterations),
            feasibility=self._options.feasibility,
            remaining=self._remaining,
            report=report,
            stop=self._stop,
        )
        if exact is None and self._status not in ("interrupted", "time limit"):
            self._status = before
        return exact

    def _report(self, report: NlpReport) -> None:
        self._reports.append(report)
        self._status = report.status
        if self._progress:
            self._progress(report)

    def _remaining(self) -> float | None:
        limit = self._options.time_limit
        return None if limit is None else limit - (time.perf_counter() - self._begin)

    def _is_feasible(self, residuals: Residuals) -> bool:
        product, violation = residuals.complementarity, residuals.constraint_violation
        return violation <= self._options.feasibility and product <= 1.01 * self._options.tolerance


def _keeps_cost(exact: float, relaxed: float, sigma: float) -> bool:
    """Whether an exact point costs little more than the relaxed one, which gains up to about sqrt(sigma) by itself."""
    return exact - relaxed <= LOSS * max(abs(exact), abs(relaxed)) + sigma**0.5


def _linear_solver(name: str) -> dict[str, Any]:
    """IPOPT's options that choose a linear solver; ours stands in for HSL's MA27."""
    if name not in ("auto", "fesd"):
        return {"linear_solver": name}
    library = kkt_library()
    if library:
        return ipopt_options(library)
    if name == "fesd":
        raise SolverError("linear solver 'fesd' needs a C++ compiler (the log says what failed; valid: auto, mumps)")
    return {"linear_solver": "mumps"}


def _ipopt_options(
    options: HomotopyOptions, sigmas: Sigmas, remaining: float | None, trial: str, last: bool, loose: bool
) -> dict[str, Any]:
    """IPOPT's options for one sigma; no NLP but one that may be the last is more accurate than its sigma deserves."""
    sigma, velocity_level_sigma = sigmas
    floor = min(1e-9, options.tolerance if last else 1e-9)
    tolerance = max(min(0.1 * (options.tolerance if last else sigma), 1e-3), floor)
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
    if velocity_level_sigma <= SETTLED:
        settings |= {"warm_start_init_point": "yes", "mu_init": max(sigma, 1e-9), **dict.fromkeys(_WARM_PUSHES, 1e-8)}
    if trial == "again":
        settings |= {"mu_strategy": "adaptive", "mu_oracle": "quality-function"}
    if loose:
        settings |= {
            "max_iter": options.loose_iterations,
            "tol": LOOSE_TOLERANCE,
            "constr_viol_tol": min(LOOSE_TOLERANCE, velocity_level_sigma),
        }
    if remaining is not None:
        settings["max_wall_time"] = remaining
    return {**settings, **options.ipopt}
