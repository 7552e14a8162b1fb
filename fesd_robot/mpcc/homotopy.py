"""Homotopy: a sequence of relaxed NLPs whose parameter sigma goes to the complementarity asked for."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.mpcc.assembly import RelaxedNlp, assemble
from fesd_robot.mpcc.options import HomotopyOptions
from fesd_robot.mpcc.polishing import BranchNlp, Polisher, PolishingReport
from fesd_robot.mpcc.problem import Mpcc, Residuals
from fesd_robot.mpcc.relaxations import Relaxation, relaxation_named
from fesd_robot.mpcc.relaxed_settings import NlpTry, relaxed_settings
from fesd_robot.mpcc.report import NlpReport
from fesd_robot.mpcc.run import Run
from fesd_robot.mpcc.schedule import Sigmas, chosen_start
from fesd_robot.mpcc.solution import MpccSolution, begun
from fesd_robot.nlp import NlpNumbers, NlpPoint, NlpResult, NlpStatus, prepared
from fesd_robot.running import OutOfTime

logger = logging.getLogger(__name__)

_FINAL_STATUSES = (NlpStatus.INTERRUPTED, NlpStatus.TIME_LIMIT, NlpStatus.ITERATION_LIMIT)
"""Ends of an NLP after which another trial is pointless."""

LOST_VIOLATION = 1e-3
"""Constraint violation above which a loose NLP that did not converge is lost."""

SHORTEST_STEP = 0.125
"""Shortest step of the loose homotopy to the next sigma, as a power of the schedule's factor."""

LOST_IN_A_ROW = 2
"""NLPs one after the other that are lost, after which the branch of the point before them is tried."""

COST_LOSS = 0.2
"""Part of the cost that an exact point may lose against the relaxed one, or a refined one against the one
before; a branch that costs more was misread."""


@checked
def solve(
    problem: Mpcc,
    run: Run | None = None,
    *,
    relaxation: Relaxation | None = None,
    nlp: RelaxedNlp | None = None,
    polisher: Polisher | None = None,
    otherwise: Callable[[np.ndarray], float | None] | None = None,
) -> MpccSolution:
    """Solve an MPCC by relaxed NLPs with sigma -> tolerance, IPOPT's tolerance tied to sigma.

    Every pair 0 <= G, 0 <= H, G H = 0 is held at G H <= sigma, or what the relaxation says. An NLP that fails twice
    ends the homotopy; the best point so far is returned with its residuals, and `solved` is False.

    With a polisher the homotopy is loose first: NLPs of a few iterations (`options.loose_iterations`), converged or
    not, down to `options.polish_at`. After one that is lost, far from its constraints, sigma falls by less from the
    point before it, and the NLP goes on from the multipliers there. The branch is read off at the end, and the smooth
    problem on it is solved; its end is exact. Where no branch fits, the homotopy goes on with NLPs that converge, and
    polishing is tried again at every sigma of the position level. Polishing is tried earlier, too, where the loose
    homotopy loses NLP after NLP.

    Args:
        problem: the MPCC.
        run: sigmas, tolerances and limits; default: the options' own, without a limit of time.
        relaxation: instead of the options' one.
        nlp: the relaxed problem, if it was assembled before (for a problem with the same blocks); its relaxation and
            steering are the ones it was assembled with.
        polisher: reads branches of this problem, see `polishing`.
        otherwise: called with the point, (n), at the end of the loose homotopy, and at the end of all, if no branch on
            which it may lie leads to an exact point; returns the cost of an exact point that was found in another way,
            None if there is none. A cost that is as near as that of a branch has to be ends the solve.

    Raises:
        ModelError: the relaxation cannot hold vanishing constraints, and the problem has some.
        SolverError: IPOPT could not be started.

    Source: Scholtes 2001; Nurkanovic, Pozharskiy, Diehl, arXiv 2312.11022 (comparison of homotopies).
    """
    run = run or Run()
    options = run.options
    if not any(block.velocity_level.any() for block in problem.blocks):
        options = replace(options, velocity_level_ratio=1.0)
        run = replace(run, options=options)
    begin = time.perf_counter()
    try:
        nlp = nlp or assemble(
            problem, relaxation or relaxation_named(options.relaxation), options.compile, options.steering
        )
        branch_nlp = BranchNlp.of(polisher, options.compile) if polisher and options.polish else None
    except OutOfTime:
        return begun(problem, time.perf_counter() - begin)
    return _Homotopy(problem, run, nlp, branch_nlp, otherwise).solution(time.perf_counter() - begin)


def _where_exploited(problem: Mpcc, nlp: RelaxedNlp, options: HomotopyOptions) -> RelaxedNlp | None:
    """Return the relaxed problem with what its blocks add to the cost where that is exploited; None if none does."""
    if all(block.equations.if_exploited.is_zero() for block in problem.blocks):
        return None
    equations = [replace(block.equations, while_relaxed=block.equations.if_exploited) for block in problem.blocks]
    blocks = [replace(block, equations=other) for block, other in zip(problem.blocks, equations, strict=True)]
    return assemble(replace(problem, blocks=blocks), nlp.relaxation, options.compile, nlp.steering)


@dataclass(frozen=True)
class _Polished:
    """The ends of polishing: an exact point, or one whose cost speaks against its branch."""

    exact: PolishingReport | None = None
    costlier: PolishingReport | None = None


class _Homotopy:
    """One homotopy: where it is, and what it has seen."""

    def __init__(
        self,
        problem: Mpcc,
        run: Run,
        nlp: RelaxedNlp,
        branch_nlp: BranchNlp | None,
        otherwise: Callable[[np.ndarray], float | None] | None,
    ) -> None:
        self._problem, self._run, self._nlp, self._branch_nlp = problem, run, nlp, branch_nlp
        self._otherwise, self._options, options = otherwise, run.options, run.options
        self._elastic = nlp.slacks.count > 0
        sigma_start = options.sigma_start or max(chosen_start(problem, options.velocity_level_ratio), options.tolerance)
        last = options.tolerance if self._elastic else nlp.relaxation.last_sigma(options.tolerance)
        self._steps = options.steps(sigma_start, last)
        slack_upper = nlp.slacks.upper(sigma_start, options.velocity_level_ratio)
        self._lower = np.append(problem.lower, np.zeros(nlp.slacks.count))
        self._upper = np.append(problem.upper, slack_upper)
        start = np.append(problem.start, 0.5 * slack_upper)
        self._point = self._best = NlpPoint.without_multipliers(start, nlp.program.rows)
        self._violation = problem.residuals(problem.start).constraint_violation
        self._polished = _Polished()
        self._reports: list[NlpReport] = []
        self._status = NlpStatus.NOT_STARTED
        self._given_way = False
        self._begin = time.perf_counter()

    def solution(self, build_seconds: float) -> MpccSolution:
        """Run to the end, and return where that is."""
        completed, size = False, self._problem.size
        try:
            completed = self._follow()
        except OutOfTime:
            self._status = NlpStatus.TIME_LIMIT
        exact = self._polished.exact
        if exact is None and not (completed and self._is_feasible(self._problem.residuals(self._best.x[:size]))):
            exact = self._polished.costlier
        w = exact.w if exact else self._best.x[:size]
        residuals = self._problem.residuals(w)
        feasible = self._is_feasible(residuals)
        return MpccSolution(
            w=w,
            residuals=residuals,
            feasible=feasible,
            solved=(completed or exact is not None) and feasible,
            branch=exact.branch if exact else None,
            status=exact.status if exact else self._status,
            reports=self._reports,
            build_seconds=build_seconds,
            solve_seconds=time.perf_counter() - self._begin,
            point=exact.point if exact else None,
        )

    def _follow(self) -> bool:
        """Follow the homotopy; return whether it came to its last sigma, or no slack was left."""
        sigmas = self._steps.start()
        if self._branch_nlp is None or self._elastic or self._steps.is_last(sigmas):
            return self._converge(sigmas)
        end: Sigmas | None = None
        for end in self._search(sigmas):
            self._polish(self._branch_nlp, end[0])
            if self._polished.exact or self._status.ended_early or self._found_otherwise(self._point, end[0]):
                return False
        if end is None or self._status.ended_early:
            return False
        completed = self._converge(end)
        if not (self._polished.exact or self._status.ended_early):
            self._found_otherwise(self._best, 0.0)
        return completed

    def _found_otherwise(self, point: NlpPoint, sigma: float) -> bool:
        """Whether the caller finds an exact point where polishing did not, and it costs little more than this one."""
        if self._polished.costlier or self._otherwise is None:
            return False
        w = point.x[: self._problem.size]
        cost = self._otherwise(w)
        return cost is not None and _keeps_cost(cost, self._problem.residuals(w).objective, sigma)

    def _search(self, sigmas: Sigmas) -> Iterator[Sigmas]:
        """Follow the loose homotopy; yield the sigmas of the points at which to polish, the last at its end.

        An NLP that is lost is left out: the step from the one before is halved. Where several in a row are lost, the
        point before them may show well enough what touches when; where neither that nor shorter steps help, sigma falls
        by full steps, whatever is lost. If the first NLP, or one that is lost, has a negative cost, its relaxation is
        exploited, and the blocks' costs for that stand in its place from there on.
        """
        reached: tuple[Sigmas, int] | None = None
        step, lost, in_a_row = 1.0, 0, 0
        result = self._nlp_at(sigmas, loose=True)
        while result is not None and not result.status.ended_early:
            is_lost = self._is_lost(result)
            if (reached is None or is_lost) and self._gave_way():
                step, result = 1.0, self._nlp_at(sigmas, loose=True)
                continue
            lost_from = reached if is_lost else None
            readable = lost_from is not None and lost_from[0][0] <= self._options.readable_at
            if lost_from and step > SHORTEST_STEP and lost < self._run.effort.lost_nlps:
                step, lost, in_a_row = 0.5 * step, lost + 1, in_a_row + 1
                if readable and in_a_row == LOST_IN_A_ROW:
                    yield lost_from[0]
            else:
                self._point, reached, in_a_row = result.point, (sigmas, result.iterations), 0
                if readable:
                    step, lost = 1.0, self._run.effort.lost_nlps
                if 2 * result.iterations <= self._options.loose_iterations:
                    step = min(1.0, 2.0 * step)
                if sigmas[0] <= self._options.polish_at:
                    yield sigmas
                    return
            following = self._steps.after(*reached, step) if reached else sigmas
            if self._steps.is_last(following):
                yield sigmas
                return
            sigmas = following
            result = self._nlp_at(sigmas, loose=True, near=step < 1.0)

    def _gave_way(self) -> bool:
        """Whether costs that the last NLP has exploited have given way to those for that, which they do once."""
        if self._given_way or self._reports[-1].residuals.objective >= 0:
            return False
        self._given_way = True
        other = _where_exploited(self._problem, self._nlp, self._options)
        self._nlp = other or self._nlp
        return other is not None

    def _converge(self, sigmas: Sigmas) -> bool:
        """Follow the homotopy with NLPs that converge; a polisher is asked again at every sigma of the position level.

        Returns whether it came to its last sigma, or no slack was left.
        """
        polished_at = None
        while True:
            result = self._nlp_at(sigmas, loose=False)
            if result is None or not result.converged:
                return False
            self._point = result.point
            without_slack = self._elastic and self._slacks_are_zero()
            completed = self._steps.is_last(sigmas) or without_slack
            if self._branch_nlp and sigmas[0] != polished_at and (completed or self._is_readable()):
                polished_at = sigmas[0]
                self._polish(self._branch_nlp, sigmas[0])
                if self._polished.exact or self._status.ended_early:
                    return completed
            if completed and self._elastic and not without_slack:
                self._status = NlpStatus.SLACK_LEFT
                return False
            if completed:
                return True
            sigmas = self._steps.after(sigmas, result.iterations)

    def _is_lost(self, result: NlpResult) -> bool:
        """Whether an NLP has ended far from its constraints, so that nothing after it can start there."""
        return not result.converged and self._reports[-1].residuals.constraint_violation > LOST_VIOLATION

    def _slacks_are_zero(self) -> bool:
        """Whether the slacks of the last NLP are zero and its products small."""
        slack = self._point.x[self._problem.size :].max(initial=0.0)
        return bool(slack <= self._options.tolerance) and self._is_feasible(self._reports[-1].residuals)

    def _is_readable(self) -> bool:
        """Whether the last NLP, which has converged, may show its branch: with slacks, if its products are small."""
        return not self._elastic or self._reports[-1].residuals.complementarity <= self._options.polish_at

    def _nlp_at(self, sigmas: Sigmas, loose: bool, near: bool = False) -> NlpResult | None:
        """Solve the NLP at these sigmas, near to those before or not, twice if it fails; None when the time is over."""
        for trial in NlpTry:
            if self._run.deadline.left <= 0:
                self._status = NlpStatus.TIME_LIMIT
                return None
            last = self._elastic or self._steps.is_last(sigmas)
            settings = relaxed_settings(self._options, sigmas, trial, last=last, loose=loose, near=near)
            parameters = self._nlp.parameters(sigmas)
            solver = prepared(self._nlp.program, settings)
            result = solver.solve(
                NlpNumbers(self._lower, self._upper, self._nlp.lower, self._nlp.upper, parameters),
                self._point,
                seconds=self._run.deadline.remaining(),
                stop=self._run.stop,
            )
            residuals = self._problem.residuals(result.point.x[: self._problem.size])
            self._report(NlpReport(*sigmas, result.status, result.iterations, result.seconds, residuals))
            better = residuals.constraint_violation < max(self._violation, self._options.feasibility)
            if loose or result.converged or better:
                self._best = result.point
                self._violation = 0.0 if result.converged else residuals.constraint_violation
            if result.converged or result.status in _FINAL_STATUSES:
                break
        return result

    def _polish(self, branch_nlp: BranchNlp, sigma: float) -> None:
        """Solve the branch NLPs of the point that the homotopy has reached."""
        before, w = self._status, self._point.x[: self._problem.size]
        end = branch_nlp.solve(
            self._problem,
            w,
            replace(self._run, report=self._report),
        )
        if end is None:
            logger.info("polishing at sigma = %.1e found no exact point", sigma)
            self._status = self._status if self._status.ended_early else before
            return
        costs = end.residuals.objective, self._problem.residuals(w).objective
        if _keeps_cost(*costs, sigma):
            self._polished = replace(self._polished, exact=end)
        else:
            logger.info("an exact point costs %.6g, the relaxed one %.6g: its branch is kept as a last resort", *costs)
            self._polished = replace(self._polished, costlier=end)

    def _report(self, report: NlpReport) -> None:
        self._reports.append(report)
        self._status = report.status
        self._run.notify(report)

    def _is_feasible(self, residuals: Residuals) -> bool:
        product, violation = residuals.complementarity, residuals.constraint_violation
        return violation <= self._options.feasibility and product <= 1.01 * self._options.tolerance


def _keeps_cost(exact: float, relaxed: float, sigma: float) -> bool:
    """Whether an exact point costs little more than the relaxed one, which gains up to about sqrt(sigma) by itself."""
    return exact - relaxed <= COST_LOSS * max(abs(exact), abs(relaxed)) + sigma**0.5
