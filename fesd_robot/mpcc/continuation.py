"""Solutions carried over to another branch, or to another problem on the same branch."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.mpcc.polishing import BRANCH, BranchNlp, Polisher, PolishingLimits, PolishingReport
from fesd_robot.mpcc.problem import Mpcc, Residuals
from fesd_robot.mpcc.report import NlpReport
from fesd_robot.mpcc.run import Run
from fesd_robot.mpcc.solution import MpccSolution
from fesd_robot.nlp import AT, FREE, NEAR, NlpSettings, Start

WHOLE_STEPS = replace(BRANCH, whole_steps=True, at_rest=10)
"""How an NLP is solved whose solution is near; one that stands still may still converge in a few iterations."""

FAR_OBJECTIVE = 0.05
"""Change of the objective relative to one plus its size, above which whole steps have led to another solution."""

FAR_VIOLATION = 1e-2
"""Constraint violation of a start from which IPOPT also begins as from a guess, if nothing else leads to a solution."""

FREER_STARTS = Start(1e-3, 1e-4), FREE
"""Where an NLP begins from a start that violates constraints which are new, one after the other until one leads to a
solution; a warm start meets such constraints slowly, or not."""


TRIED = replace(BRANCH, tolerance=1e-3, violation=1e-6)
"""How the NLP of a trial is solved."""


@dataclass(frozen=True)
class Trial:
    """How another branch is tried before it is solved exactly.

    Attributes:
        settings: of the NLP.
        iterations: of IPOPT, after which it ends, or goes on once.
        violation: largest constraint violation at the end of a trial that is worth an exact solution.
    """

    settings: NlpSettings
    iterations: int
    violation: float


TRIALS = (
    Trial(replace(TRIED, start=Start(1e-3, 1e-4), regularised=True), iterations=40, violation=1e-3),
    Trial(replace(TRIED, start=NEAR), iterations=40, violation=1e-3),
    Trial(replace(TRIED, start=Start(1e-2, 1e-3), regularised=True), iterations=80, violation=1e-2),
)
"""One after the other: what is not found from one start is sometimes found from another."""

TRIAL_UPDATES = 1
"""How often a trial that has not converged goes on, without the elements that have shrunk to nothing."""

NEAR_VIOLATION = 1e-5
"""Constraint violation, ten times that of a trial which has converged, up to which costs of its points are compared."""

HOPELESS_VIOLATION = 0.1
"""Constraint violation above which it does not."""


class BranchPoint(Protocol):
    """A point of a problem and its branch, whatever else has them."""

    @property
    def w(self) -> np.ndarray:
        """The point, (n)."""

    @property
    def branch(self) -> Branch:
        """The branch."""


@dataclass
class BranchSolver:
    """Solves the branch NLPs of one problem, whose functions are made once.

    Args:
        problem: with the same conditions as that of the earlier solution.
        polisher: of the problem.
        run: of all NLPs.
        few_evaluations: whether the functions are not worth compiling.

    Attributes:
        reports: of all NLPs so far.
    """

    problem: Mpcc
    polisher: Polisher
    run: Run
    few_evaluations: bool = True
    reports: list[NlpReport] = field(default_factory=list)

    @cached_property
    def _nlp(self) -> BranchNlp:
        return BranchNlp.of(self.polisher, self.run.options.compile, few_evaluations=self.few_evaluations)

    @property
    def ended_early(self) -> bool:
        """Whether the user or the time limit ended the last NLP, or no time is left."""
        return self._over or bool(self.reports and self.reports[-1].status.ended_early)

    @property
    def _over(self) -> bool:
        """Whether no time is left; then no functions are made, which may take minutes to compile."""
        return self.run.deadline.left <= 0

    def exact(
        self,
        start: BranchPoint,
        *,
        limits: PolishingLimits | None = None,
        freer: bool = False,
        near: bool = False,
    ) -> PolishingReport | None:
        """Return the exact end on a branch, None if there is none nearby.

        Args:
            start: where to begin.
            limits: of iterations; default: those of the run's effort.
            freer: whether IPOPT begins further from the start, as where that violates constraints which are new.
            near: whether the end is near the start, as on a finer grid, and whole steps are tried first; from a start
                that violates constraints much, IPOPT also begins as it does from a guess, last.
        """
        limits = limits or PolishingLimits(self.run.effort.branch_iterations, self.run.effort.branch_updates)
        end = self._near(start, freer) if near else None
        for starting in FREER_STARTS if freer else (AT,):
            end = end or self._solve(start, replace(BRANCH, start=starting), limits)
        if end is None and near and not freer and self._is_far(start):
            end = self._solve(start, replace(BRANCH, start=FREE), limits)
        return end

    def _is_far(self, start: BranchPoint) -> bool:
        return self.problem.residuals(start.w).constraint_violation > FAR_VIOLATION

    def tried(self, start: BranchPoint, trial: Trial) -> PolishingReport | None:
        """Return the end of a trial, which is not exact; None if no time is left.

        A trial that goes on and leaves its constraints ends where it held them before, and so does one that goes on to
        where it costs more: going on begins farther from bounds, and may lead back to the motion that was left.

        Args:
            start: where it begins.
            trial: how to try.
        """
        w, branch, found = start.w, start.branch, None
        held: PolishingReport | None = None
        for _ in range(1 + TRIAL_UPDATES):
            if self._over:
                return held
            found = self._nlp.solve_once(
                branch,
                self.problem,
                w,
                self._own_run,
                settings=trial.settings,
                limits=PolishingLimits(trial.iterations, updates=0),
            )
            if found is None or (held and _is_lost(found.residuals, held.residuals, trial)):
                return held
            if found.status.converged or not np.isfinite(found.w).all():
                break
            violation = found.residuals.constraint_violation
            held = found if violation <= trial.violation else None
            if violation > HOPELESS_VIOLATION:
                break
            w, branch = found.w, self.polisher.updated_branch(branch, found.w) or branch
        return found

    def solution(self, end: PolishingReport, earlier: MpccSolution, seconds: float) -> MpccSolution:
        """Return the solution that an exact end is.

        Args:
            end: of this problem.
            earlier: the solution that it continues; its NLPs are listed first in the result.
            seconds: that it took.
        """
        own = end.as_solution([*earlier.reports, *self.reports], earlier.solve_seconds + seconds)
        return replace(own, build_seconds=earlier.build_seconds)

    @property
    def _own_run(self) -> Run:
        """The run, of whose NLPs this solver takes note."""
        return replace(self.run, report=self._report)

    def _solve(self, start: BranchPoint, settings: NlpSettings, limits: PolishingLimits) -> PolishingReport | None:
        if self._over:
            return None
        return self._nlp.solve(
            self.problem,
            start.w,
            self._own_run,
            settings=settings,
            limits=limits,
            branches=[start.branch],
        )

    def _near(self, start: BranchPoint, freer: bool) -> PolishingReport | None:
        """Return the exact end that whole steps lead to, None if that is none, or far away; where a start violates
        constraints, steps that have not led there do not when they go on."""
        effort = self.run.effort
        limits = PolishingLimits(effort.whole_step_iterations, 0 if freer else effort.branch_updates)
        end = self._solve(start, WHOLE_STEPS, limits)
        if end is None:
            return None
        before, after = self.problem.residuals(start.w).objective, end.residuals.objective
        return end if abs(after - before) <= FAR_OBJECTIVE * (1 + abs(before)) else None

    def _report(self, nlp: NlpReport) -> None:
        self.reports.append(nlp)
        self.run.notify(nlp)


def continue_on_branch(
    problem: Mpcc, polisher: Polisher, start: BranchPoint, earlier: MpccSolution, run: Run, *, freer: bool = False
) -> MpccSolution | None:
    """Return the exact solution of a problem on the branch of an earlier one, or None if there is none nearby.

    Args:
        problem: with the same conditions as the earlier one, discretised more finely.
        polisher: of the problem.
        start: a point of the problem.
        earlier: the solution it continues; its NLPs are listed first in the result.
        run: of all NLPs.
        freer: as in `BranchSolver.exact`.
    """
    begin = time.perf_counter()
    solver = BranchSolver(problem, polisher, run)
    end = solver.exact(start, freer=freer, near=True)
    return None if end is None else solver.solution(end, earlier, time.perf_counter() - begin)


def _is_lost(found: Residuals, held: Residuals, trial: Trial) -> bool:
    """Return whether a trial that held its constraints has left them, or gone from near them to where it costs more."""
    near = held.constraint_violation <= NEAR_VIOLATION
    return not found.constraint_violation <= trial.violation or (near and not found.objective <= held.objective)
