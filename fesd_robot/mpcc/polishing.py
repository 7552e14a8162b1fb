"""Polishing: from a point with small products to one whose pairs are exact, by smooth NLPs on its branch."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.complementarity import Branch
from fesd_robot.exactness import EXACT_PRODUCT
from fesd_robot.mpcc.assembly import Compile, RelaxedNlp, assemble
from fesd_robot.mpcc.problem import Mpcc, Residuals
from fesd_robot.mpcc.relaxations import relaxation_named
from fesd_robot.mpcc.report import NlpReport
from fesd_robot.mpcc.run import Run
from fesd_robot.mpcc.solution import MpccSolution
from fesd_robot.nlp import (
    AT,
    AT_REST,
    Hopeless,
    NlpNumbers,
    NlpPoint,
    NlpSettings,
    NlpStatus,
    ReducedNlp,
    Start,
    prepared,
)
from fesd_robot.running import Kept

NEARLY_FEASIBLE = 1e-4
"""Constraint violation below which a branch NLP that ran out of iterations is continued on the same branch."""

CONTINUED = Start(1e-9, 1e-9, multipliers=True)
"""Start of a branch NLP that ran out of iterations and goes on, with its multipliers, where it was."""

BRANCH = NlpSettings(AT, tolerance=1e-9, violation=1e-12)
"""How a branch NLP is solved where nothing else is said."""

REMEMBERED = 4
"""Branch NLPs that are kept for when they are needed again: search and refinement return to the same elements."""


@dataclass(frozen=True)
class BranchBounds:
    """Bounds on the variables (n) and on the rows of g of a branch NLP."""

    lower: np.ndarray
    upper: np.ndarray
    g_lower: np.ndarray
    g_upper: np.ndarray


class Polisher(Protocol):
    """A polisher: it names the branches of its problem on which a point may lie."""

    def __hash__(self) -> int:
        """Equal polishers share their branch NLP."""
        ...

    @property
    def problem(self) -> Mpcc:
        """The problem without pairs."""
        ...

    def candidate_branches(self, w: np.ndarray) -> Iterator[Branch]:
        """Branches on which a point may lie, the likelier first."""
        ...

    def updated_branch(self, branch: Branch, w: np.ndarray) -> Branch | None:
        """The branch after an NLP that has not converged at w; None if nothing is to be changed."""
        ...

    def bounds(self, branch: Branch) -> BranchBounds:
        """The bounds that keep the active factors of a branch at zero."""
        ...

    def whole(self, point: NlpPoint) -> NlpPoint:
        """A point of the problem with multipliers of all rows that a branch may hold."""
        ...


@dataclass(frozen=True)
class PolishingReport:
    """One branch NLP.

    Attributes:
        status: how the solver ended.
        iterations, seconds: of the NLP.
        residuals: of the problem with pairs, at the NLP's end.
        point: the NLP's end, with multipliers of all rows that a branch may hold.
        branch: on which it was solved.
        exact: the NLP converged, its constraints hold, and all products, or the smaller sides of all pairs, are at most
            `EXACT_PRODUCT`.
    """

    status: NlpStatus
    iterations: int
    seconds: float
    residuals: Residuals
    point: NlpPoint
    branch: Branch
    exact: bool

    @property
    def w(self) -> np.ndarray:
        """The NLP's end, (n)."""
        return self.point.x

    @property
    def as_nlp(self) -> NlpReport:
        """What is shown of it."""
        return NlpReport(0.0, 0.0, self.status, self.iterations, self.seconds, self.residuals)

    def as_solution(self, reports: list[NlpReport], seconds: float) -> MpccSolution:
        """Return the solution that an exact end is.

        Args:
            reports: of all NLPs that led there.
            seconds: that these took.
        """
        return MpccSolution(
            w=self.w,
            residuals=self.residuals,
            feasible=True,
            solved=True,
            branch=self.branch,
            status=self.status,
            reports=reports,
            build_seconds=0.0,
            solve_seconds=seconds,
            point=self.point,
        )

    @property
    def nearly_feasible(self) -> bool:
        """Whether only iterations were missing, or digits: the branch fits, for its constraints nearly hold.

        One that has converged and leaves a product that is not small does not fit, and never will.
        """
        product = min(self.residuals.complementarity, self.residuals.natural_residual)
        digits = self.status.converged and product <= NEARLY_FEASIBLE
        missing = self.status is NlpStatus.ITERATION_LIMIT or digits
        return missing and self.residuals.constraint_violation <= NEARLY_FEASIBLE


@checked
@dataclass(frozen=True)
class PolishingLimits:
    """How many iterations polishing may take.

    Attributes:
        iterations: of IPOPT, for each NLP, or as many as the run's options allow if these are less.
        updates: how often a branch is updated, or continued.
        hopeless: called with every iterate; True ends an NLP as if it had no iterations left.
    """

    iterations: int
    updates: int
    hopeless: Hopeless | None = None


@dataclass(frozen=True)
class BranchNlp:
    """A polisher with the functions of its branch NLP.

    Attributes:
        polisher: what knows the branches of a problem.
        nlp: functions and derivatives of `polisher.problem`, made once for all branches.
    """

    polisher: Polisher
    nlp: RelaxedNlp

    @classmethod
    def of(cls, polisher: Polisher, compiled: Compile, *, few_evaluations: bool = False) -> BranchNlp:
        """Return the branch NLP with derivatives, see `assemble`; they are made once for all branches, and shared by
        equal polishers."""

        def made() -> BranchNlp:
            scholtes = relaxation_named("scholtes")
            return cls(polisher, assemble(polisher.problem, scholtes, compiled, few_evaluations=few_evaluations))

        return _KEPT.of((polisher, compiled, few_evaluations), made)

    def solve(
        self,
        problem: Mpcc,
        w: np.ndarray,
        run: Run,
        *,
        settings: NlpSettings = BRANCH,
        limits: PolishingLimits | None = None,
        branches: Iterable[Branch] | None = None,
    ) -> PolishingReport | None:
        """Return the first exact end of a branch NLP, None if no branch on which w may lie leads to one.

        A branch whose NLP does not converge within the iterations is updated and continued from where it ended, at
        most `limits.updates` times; then comes the next candidate of w.

        Args:
            problem: the problem with pairs, which every end is checked against.
            w: a point with small products, (n).
            run: its options' feasibility is the largest constraint violation of an exact end.
            settings: of the NLP; its solver, its linear solver, its further options and its iterations are those of run
                and limits.
            limits: of iterations; default: those of the run's effort.
            branches: on which w may lie; default: those that the polisher reads from it.
        """
        limits = limits or PolishingLimits(run.effort.polishing_iterations, run.effort.polishing_updates)
        for branch in self.polisher.candidate_branches(w) if branches is None else branches:
            start, own = self._start(w), settings
            for _ in range(1 + limits.updates):
                ended = self._ended(branch, problem, start, run, own, limits)
                if ended is None:
                    return None
                end, start = ended
                if end.exact or end.status is NlpStatus.INTERRUPTED:
                    return end if end.exact else None
                if not np.isfinite(end.w).all():
                    break
                updated = self.polisher.updated_branch(branch, end.w)
                if updated is None and not end.nearly_feasible:
                    break
                if updated:
                    branch, start, own = updated, self._start(end.w), settings
                else:
                    own = replace(settings, start=CONTINUED, at_rest=AT_REST, whole_steps=False)
        return None

    def solve_once(
        self,
        branch: Branch,
        problem: Mpcc,
        start: np.ndarray | NlpPoint,
        run: Run,
        *,
        settings: NlpSettings,
        limits: PolishingLimits,
    ) -> PolishingReport | None:
        """Return the end of one NLP on a branch, None if no time is left.

        Args:
            branch: the branch, which stays as it is.
            start: a point, (n), or one with multipliers.

        The other args are those of `solve`.
        """
        point = start if isinstance(start, NlpPoint) else self._start(start)
        ended = self._ended(branch, problem, point, run, settings, limits)
        return ended[0] if ended else None

    def _start(self, w: np.ndarray) -> NlpPoint:
        return NlpPoint.without_multipliers(w, self.nlp.program.rows)

    def _ended(
        self,
        branch: Branch,
        problem: Mpcc,
        start: NlpPoint,
        run: Run,
        settings: NlpSettings,
        limits: PolishingLimits,
    ) -> tuple[PolishingReport, NlpPoint] | None:
        """Return the end of one NLP on a branch and its point with multipliers, None if no time is left."""
        if run.deadline.left <= 0:
            return None
        bounds = self.polisher.bounds(branch)
        settings = replace(
            settings,
            iterations=min(limits.iterations, run.options.max_iterations),
            solver=run.options.branch_solver,
            linear_solver=run.options.linear_solver,
            further=tuple(run.options.ipopt.items()) if run.options.branch_solver == "ipopt" else (),
        )
        begin = time.perf_counter()
        start = replace(start, x=np.clip(start.x, bounds.lower, bounds.upper))
        parameters = self.nlp.parameters((0.0, 0.0))
        numbers = NlpNumbers(bounds.lower, bounds.upper, bounds.g_lower, bounds.g_upper, parameters)
        reduced = ReducedNlp.of(self.nlp.program, numbers)
        solver = prepared(reduced.nlp, settings)
        result = solver.solve(
            reduced.numbers(numbers),
            reduced.part(start),
            seconds=run.deadline.remaining(),
            stop=run.stop,
            hopeless=limits.hopeless,
        )
        point = reduced.whole(result.point, start)
        residuals = problem.residuals(point.x)
        exact = (
            result.converged
            and min(residuals.complementarity, residuals.natural_residual) <= EXACT_PRODUCT
            and residuals.constraint_violation <= run.options.feasibility
        )
        end = PolishingReport(
            status=result.status,
            iterations=result.iterations,
            seconds=time.perf_counter() - begin,
            residuals=residuals,
            point=self.polisher.whole(point),
            branch=branch,
            exact=exact,
        )
        run.notify(end.as_nlp)
        return end, point


_KEPT: Kept[BranchNlp] = Kept(REMEMBERED, outdated=lambda known: known.nlp.outdated)
