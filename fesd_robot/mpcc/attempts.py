"""An MPCC of which nothing is known: homotopies in turn, the nearest branch that holds its constraints, and descent."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass, field, fields, replace
from itertools import islice
from typing import Any

import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.complementarity import Branch
from fesd_robot.errors import OptionError, SolverError, nearest
from fesd_robot.exactness import ZERO_PRODUCT
from fesd_robot.mpcc.certificate import Certificate, certify
from fesd_robot.mpcc.elastic import NOTHING_VIOLATED, ElasticProblem, LeastViolation
from fesd_robot.mpcc.homotopy import solve
from fesd_robot.mpcc.options import HomotopyOptions
from fesd_robot.mpcc.pair_polisher import PairPolisher
from fesd_robot.mpcc.polishing import BRANCH, BranchNlp, PolishingLimits, PolishingReport
from fesd_robot.mpcc.problem import Mpcc
from fesd_robot.mpcc.report import NlpReport
from fesd_robot.mpcc.run import Run
from fesd_robot.mpcc.solution import MpccSolution, begun
from fesd_robot.nlp import NEAR, NlpSettings

logger = logging.getLogger(__name__)

DESCENTS = 12
"""Branches, one after the other, that a descent follows."""

DESCENT_ACTIVITY = 1e-6
"""Size up to which a side counts as zero where a branch is looked for that descends."""

LEAST_DESCENT = 1e-9
"""Of the cost, relative to the larger of it and one; less is none."""

BRANCH_LIMITS = PolishingLimits(iterations=300, updates=2)
"""Of the NLP of a branch: nothing says that its solution is near."""

POLISHING_ITERATIONS = 150
"""The same of homotopies after the first, whose ends were not near enough for few."""

NEAR_BRANCH = replace(BRANCH, start=NEAR)
"""How such an NLP is solved."""

SHARP_BRANCH = replace(BRANCH, tolerance=1e-13)
"""The same where that leaves too much: at a degenerate point a cost is off by the root of the tolerance."""

FURTHER_TIME = 3.0
"""Times as long as the first solution took, which a homotopy for a cheaper one may take."""


@checked
@dataclass(frozen=True)
class Attempt:
    """One homotopy.

    Attributes:
        name: of it, for the report.
        changes: of `HomotopyOptions`.
        moved: standard deviation by which the start is moved, relative to one plus the size of each variable.
        share: of the time that is left.

    Raises:
        OptionError: a name that `HomotopyOptions` does not have, a negative distance, or a share outside 0 to 1.
    """

    name: str
    changes: dict[str, Any] = field(default_factory=dict)
    moved: float = 0.0
    share: float = 0.4

    def __post_init__(self) -> None:
        names = [one.name for one in fields(HomotopyOptions)]
        for key in self.changes:
            if key not in names:
                raise OptionError(f"changes: unknown option '{key}'{nearest(key, names)}, expected {', '.join(names)}")
        if not self.moved >= 0:
            raise OptionError(f"moved: found {self.moved:g}, expected 0 or more")
        if not 0 < self.share <= 1:
            raise OptionError(f"share: found {self.share:g}, expected more than 0 and at most 1")


ATTEMPTS = (
    Attempt("as given"),
    Attempt("slow", {"sigma_start": None, "sigma_factor": 0.6}),
    Attempt("l-infinity", {"steering": "linf", "sigma_start": 1.0, "sigma_factor": 0.1}),
    Attempt("from a small sigma", {"sigma_start": 1e-3, "sigma_factor": 0.1}),
    Attempt("start moved by 3 %", moved=0.03),
    Attempt("slow, start moved by 10 %", {"sigma_start": None, "sigma_factor": 0.6}, moved=0.1),
    Attempt("start moved by 30 %", moved=0.3),
    Attempt("l-infinity, start moved by 10 %", {"steering": "linf", "sigma_start": None}, moved=0.1, share=1.0),
)
"""One after the other until one ends at a solution; the shares are of the time that is left."""


@dataclass(frozen=True)
class Attempted:
    """What came of all attempts.

    Attributes:
        solution: the solution, else the best point: that of the least violation and product.
        certificate: of the solution; None if there is none.
        conflict: the least violation that was found, if no attempt found a solution; None also where time was over.
        attempt: name of the one that the solution is of.
        descents: branches that were left for cheaper ones.
    """

    solution: MpccSolution
    certificate: Certificate | None
    conflict: LeastViolation | None
    attempt: str
    descents: int


@checked
def solve_by_attempts(
    problem: Mpcc,
    run: Run | None = None,
    *,
    attempts: tuple[Attempt, ...] = ATTEMPTS,
    further: int = 0,
) -> Attempted:
    """Solve an MPCC of which nothing is known but its functions and a start.

    Homotopies follow each other until one ends at a solution. After one that does not, constraints are given slacks at
    its end, and their sum is minimised on branch after branch, as long as the LPCC knows one that descends
    (`ElasticProblem`): where nothing is left of them, that branch holds the constraints; where something is left, and
    that for every attempt, the rows that it is left in are the conflict. From a solution the same descent follows the
    cost, until the certificate finds no branch that descends.

    Args:
        problem: the MPCC.
        run: options of the first homotopy, limits, who hears of NLPs.
        attempts: homotopies, the first one first.
        further: how many homotopies follow the one that ends at a solution, each for at most `FURTHER_TIME` times as
            long as that took; the cheapest solution is returned.

    Raises:
        OptionError: no attempts, or a negative number of further ones.
        SolverError: IPOPT could not be started.

    Source: homotopies: Nurkanovic, Pozharskiy, Diehl, arXiv 2312.11022; descent: Leyffer, Munson, A globally convergent
    filter method for MPECs (2007).
    """
    if not attempts:
        raise OptionError("attempts: found none, expected at least one Attempt")
    if further < 0:
        raise OptionError(f"further: found {further}, expected 0 or more")
    return _Attempts(problem, run or Run()).end(attempts, further)


class _Attempts:
    """The attempts, with what they share."""

    def __init__(self, problem: Mpcc, run: Run) -> None:
        self._problem = problem
        ipopt = {"dependency_detector": "mumps", **run.options.ipopt}
        self._run = replace(run, options=replace(run.options, ipopt=ipopt))
        self._polisher = PairPolisher(problem)
        self._conflict: LeastViolation | None = None
        self._elastic: ElasticProblem | None = None
        self._reports: list[NlpReport] = []

    def end(self, attempts: tuple[Attempt, ...], further: int) -> Attempted:
        """Make the attempts, and return what came of them."""
        begin, best, left = time.perf_counter(), begun(self._problem, 0.0), iter(attempts)
        name, certificate, descents, solved_after = "", None, 0, 0.0
        for attempt in left:
            if self._run.over:
                break
            found = self._attempted(attempt, self._run.share(attempt.share))
            if _better(found, best):
                best, name = found, attempt.name
            if not best.solved and not self._run.over:
                repaired = self._repaired(best.w, attempt)
                best, name = (repaired, f"{attempt.name}, repaired") if repaired else (best, name)
            if best.solved:
                break
        if best.solved:
            solved_after = time.perf_counter() - begin
            best, certificate, descents = self._descended(best)
        for attempt in islice(left, further if best.solved else 0):
            if self._run.over:
                break
            found = self._attempted(attempt, self._run.within(FURTHER_TIME * solved_after))
            if found.solved and _descends(found.residuals.objective, best.residuals.objective):
                best, certificate, descents = self._descended(found)
                name = attempt.name
        best = replace(best, reports=self._reports, solve_seconds=time.perf_counter() - begin - best.build_seconds)
        return Attempted(best, certificate, None if best.solved else self._conflict, name, descents)

    def _attempted(self, attempt: Attempt, run: Run) -> MpccSolution:
        """Return the end of one homotopy."""
        if attempt.changes or attempt.moved:
            iterations = max(run.effort.polishing_iterations, POLISHING_ITERATIONS)
            changes, first = attempt.changes, attempt.changes.get("sigma_start")
            if first is not None:
                changes = {**changes, "sigma_start": max(first, run.options.tolerance)}
            run = replace(
                run,
                options=replace(run.options, **changes),
                effort=replace(run.effort, polishing_iterations=iterations),
            )
        problem = replace(self._problem, start=_moved(self._problem, attempt.moved))
        found = solve(problem, run, polisher=self._polisher)
        self._reports += found.reports
        return found

    def _repaired(self, w: np.ndarray, attempt: Attempt) -> MpccSolution | None:
        """Return a solution on a branch that holds the constraints, None if none is found from a point."""
        self._elastic = self._elastic or ElasticProblem.of(self._problem)
        problem, run = self._elastic.problem, self._run.share(attempt.share)
        start = self._elastic.at(np.clip(w, self._problem.lower, self._problem.upper))
        end, certified = _least(problem, start, replace(run, report=self._heard), NOTHING_VIOLATED)
        if end is None:
            return None
        if end.residuals.objective > NOTHING_VIOLATED:
            conflict = self._elastic.least_violation(end.w, certified=certified)
            if self._conflict is None or conflict.total < self._conflict.total:
                self._conflict = conflict
            return None
        found = self._on_branch(end.branch, end.w[: self._problem.size], NEAR_BRANCH)
        return found.as_solution([], 0.0) if found else None

    def _descended(self, solution: MpccSolution) -> tuple[MpccSolution, Certificate | None, int]:
        """Return a solution that no branch improves, its certificate, and how many branches were left."""
        certificate, descents = self._certified(solution), 0
        while certificate is not None and certificate.branch is not None and descents < DESCENTS:
            before = solution
            for settings in (NEAR_BRANCH, SHARP_BRANCH):
                end = self._on_branch(certificate.branch, before.w, settings)
                if end is not None and not _descends(before.residuals.objective, end.residuals.objective):
                    solution = replace(end.as_solution([], 0.0), build_seconds=before.build_seconds)
                    break
            if solution is before:
                break
            certificate = self._certified(solution)
            if not _descends(solution.residuals.objective, before.residuals.objective):
                break
            descents += 1
        return solution, certificate, descents

    def _on_branch(self, branch: Branch, w: np.ndarray, settings: NlpSettings) -> PolishingReport | None:
        """Return the exact end of the NLP of a branch, None if there is none."""
        return BranchNlp.of(self._polisher, self._run.options.compile).solve(
            self._problem,
            w,
            replace(self._run, report=self._heard),
            settings=settings,
            limits=BRANCH_LIMITS,
            branches=[branch],
        )

    def _certified(self, solution: MpccSolution) -> Certificate | None:
        seconds = min(self._run.effort.certificate_seconds, self._run.deadline.left)
        if seconds <= 0:
            return None
        tolerance = ZERO_PRODUCT if solution.exact else max(solution.residuals.complementarity, ZERO_PRODUCT)
        try:
            return certify(self._problem, solution.w, tolerance=tolerance, time_limit=seconds)
        except SolverError as error:
            logger.info("no certificate: %s", error)
            return None

    def _heard(self, report: NlpReport) -> None:
        self._reports.append(report)
        self._run.notify(report)


def _least(problem: Mpcc, start: np.ndarray, run: Run, enough: float) -> tuple[PolishingReport | None, bool]:
    """Return the cheapest exact end on branches that cost less and less, and whether the LPCC knows none that descends.

    Args:
        problem: with pairs.
        start: where the first branch is read, (n).
        run: of all NLPs.
        enough: cost at which it ends.
    """
    from fesd_robot.mpcc.b_stationarity import b_stationary  # the linear programs take long to import

    nlp = BranchNlp.of(PairPolisher(problem), run.options.compile)
    end = nlp.solve(problem, start, run, settings=NEAR_BRANCH, limits=BRANCH_LIMITS)
    for _ in range(DESCENTS):
        if end is None or run.over or end.residuals.objective <= enough:
            break
        try:
            b = b_stationary(problem, end.w, activity=DESCENT_ACTIVITY, time_limit=min(10.0, run.deadline.left))
        except SolverError as error:
            logger.info("no branch that descends: %s", error)
            break
        if b.verdict != "refuted":
            return end, b.verdict == "certified"
        following = nlp.solve(problem, end.w, run, settings=NEAR_BRANCH, limits=BRANCH_LIMITS, branches=[b.branch])
        if following is None or not _descends(following.residuals.objective, end.residuals.objective):
            break
        end = following
    return end, False


def _descends(cost: float, before: float) -> bool:
    return cost < before - LEAST_DESCENT * max(1.0, abs(before))


def _moved(problem: Mpcc, by: float) -> np.ndarray:
    """Return the start of a problem, moved at random within its bounds, always in the same way."""
    if not by:
        return problem.start
    noise = np.random.default_rng(0).standard_normal(problem.size)
    return np.clip(problem.start + by * (1.0 + np.abs(problem.start)) * noise, problem.lower, problem.upper)


def _better(one: MpccSolution, other: MpccSolution) -> bool:
    """Whether a solution is one where the other is none, or is nearer to it."""
    if one.solved != other.solved:
        return one.solved
    wrong = [max(each.residuals.constraint_violation, each.residuals.complementarity) for each in (one, other)]
    return bool(wrong[0] < wrong[1])
