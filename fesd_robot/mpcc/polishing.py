"""Polishing: from a point with small products to one whose pairs are exact, by smooth NLPs on its branch."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Protocol

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.mpcc.assembly import Compile, RelaxedNlp, assemble
from fesd_robot.mpcc.ipopt import Hopeless, NlpPoint, solve_nlp
from fesd_robot.mpcc.ipopt_settings import (
    SHORTENED_STEPS,
    STANDS_STILL,
    continued_at,
    linear_solver_options,
    starting_at,
)
from fesd_robot.mpcc.problem import Mpcc, Residuals
from fesd_robot.mpcc.reduced_nlp import ReducedNlp
from fesd_robot.mpcc.relaxations import relaxation_named
from fesd_robot.mpcc.report import NlpReport
from fesd_robot.mpcc.run import Run
from fesd_robot.mpcc.status import NlpStatus

POLISHING_ITERATIONS = 40
"""IPOPT iterations on one branch before it is updated; the right one needs 15 to 50."""

BRANCH_UPDATES = 4
"""How often a branch is updated before the next candidate."""

EXACT_PRODUCT = 1e-12
"""Largest product of a pair at an exact point, or largest smaller side: with a force of 10 N a gap of 1e-12 m has a
product of 1e-11."""

NEARLY_FEASIBLE = 1e-4
"""Constraint violation below which a branch NLP that ran out of iterations is continued on the same branch."""

WARM_START = starting_at(1e-6, 1e-8)
"""IPOPT's options that leave the start of a branch NLP where it is; its defaults would push it off its bounds."""

CONTINUED = {**continued_at(1e-9, 1e-9), **STANDS_STILL, **SHORTENED_STEPS}
"""IPOPT's options for a branch NLP that ran out of iterations and goes on, with its multipliers, where it was; whole
steps that have not converged by then go away from there."""

POLISHING_TOLERANCE, POLISHING_VIOLATION = 1e-9, 1e-12
"""Of IPOPT, for its scaled optimality and for the constraints."""

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


@dataclass(frozen=True)
class PolishingReport:
    """One branch NLP.

    Attributes:
        status: how IPOPT ended.
        iterations, seconds: of the NLP.
        residuals: of the problem with pairs, at the NLP's end.
        w: the NLP's end.
        branch: on which it was solved.
        exact: the NLP converged, its constraints hold, and all products, or the smaller sides of all pairs, are at most
            `EXACT_PRODUCT`.
    """

    status: NlpStatus
    iterations: int
    seconds: float
    residuals: Residuals
    w: np.ndarray
    branch: Branch
    exact: bool

    @property
    def as_nlp(self) -> NlpReport:
        """What is shown of it."""
        return NlpReport(0.0, 0.0, self.status, self.iterations, self.seconds, self.residuals)

    @property
    def nearly_feasible(self) -> bool:
        """Whether only iterations were missing, or digits: the branch fits, for its constraints nearly hold.

        One that has converged and leaves a product that is not small does not fit, and never will.
        """
        product = min(self.residuals.complementarity, self.residuals.natural_residual)
        digits = self.status.converged and product <= NEARLY_FEASIBLE
        missing = self.status is NlpStatus.ITERATION_LIMIT or digits
        return missing and self.residuals.constraint_violation <= NEARLY_FEASIBLE


@dataclass(frozen=True)
class PolishingLimits:
    """How many iterations polishing may take.

    Attributes:
        iterations: of IPOPT, for each NLP, or as many as the run's options allow if these are less.
        updates: how often a branch is updated, or continued.
        hopeless: called with every iterate; True ends an NLP as if it had no iterations left.
    """

    iterations: int = POLISHING_ITERATIONS
    updates: int = BRANCH_UPDATES
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
        return _branch_nlp(polisher, compiled, few_evaluations)

    def solve(
        self,
        problem: Mpcc,
        w: np.ndarray,
        run: Run,
        *,
        options: dict[str, Any] | None = None,
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
            options: of IPOPT, before those of the run.
            limits: of iterations.
            branches: on which w may lie; default: those that the polisher reads from it.
        """
        options, limits = options or {}, limits or PolishingLimits()
        for branch in self.polisher.candidate_branches(w) if branches is None else branches:
            start, settings = self._start(w), options
            for _ in range(1 + limits.updates):
                ended = self._ended(branch, problem, start, run, options=settings, limits=limits)
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
                    branch, start, settings = updated, self._start(end.w), options
                else:
                    settings = {**options, **CONTINUED}
        return None

    def solve_once(
        self,
        branch: Branch,
        problem: Mpcc,
        w: np.ndarray,
        run: Run,
        *,
        options: dict[str, Any],
        limits: PolishingLimits,
    ) -> PolishingReport | None:
        """Return the end of one NLP on a branch, None if no time is left.

        Args:
            branch: the branch, which stays as it is.

        The other args are those of `solve`.
        """
        ended = self._ended(branch, problem, self._start(w), run, options=options, limits=limits)
        return ended[0] if ended else None

    def _start(self, w: np.ndarray) -> NlpPoint:
        return NlpPoint(w, np.zeros(len(w)), np.zeros(len(self.nlp.lower)))

    def _ended(
        self,
        branch: Branch,
        problem: Mpcc,
        start: NlpPoint,
        run: Run,
        *,
        options: dict[str, Any],
        limits: PolishingLimits,
    ) -> tuple[PolishingReport, NlpPoint] | None:
        """Return the end of one NLP on a branch and its point with multipliers, None if no time is left."""
        seconds = run.deadline.remaining()
        if seconds is not None and seconds <= 0:
            return None
        bounds = self.polisher.bounds(branch)
        settings = {
            "tol": POLISHING_TOLERANCE,
            "constr_viol_tol": POLISHING_VIOLATION,
            "acceptable_iter": 0,
            "mu_strategy": "monotone",
            **WARM_START,
            "bound_relax_factor": 0.0,
            "honor_original_bounds": "no",
            "max_iter": min(limits.iterations, run.options.max_iterations),
            **({} if seconds is None else {"max_wall_time": seconds}),
            **linear_solver_options(run.options.linear_solver),
            **options,
            **run.options.ipopt,
        }
        begin = time.perf_counter()
        start = replace(start, x=np.clip(start.x, bounds.lower, bounds.upper))
        whole = replace(self.nlp, lower=bounds.g_lower, upper=bounds.g_upper)
        reduced = ReducedNlp.of(whole, bounds.lower, bounds.upper)
        result = solve_nlp(
            reduced.nlp,
            sigma=(0.0, 0.0),
            start=reduced.part(start),
            lower=bounds.lower[reduced.free],
            upper=bounds.upper[reduced.free],
            options=settings,
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
            w=point.x,
            branch=branch,
            exact=exact,
        )
        run.told(end.as_nlp)
        return end, point


@lru_cache(maxsize=REMEMBERED)
def _branch_nlp(polisher: Polisher, compiled: Compile, few_evaluations: bool) -> BranchNlp:
    scholtes = relaxation_named("scholtes")
    return BranchNlp(polisher, assemble(polisher.problem, scholtes, compiled, few_evaluations=few_evaluations))
