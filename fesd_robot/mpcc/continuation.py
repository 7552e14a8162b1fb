"""A solution carried over to another problem on the same branch."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.mpcc.ipopt_settings import linear_solver_options, starting_at
from fesd_robot.mpcc.options import HomotopyOptions
from fesd_robot.mpcc.polishing import BranchNlp, Polisher, PolishingLimits, PolishingReport
from fesd_robot.mpcc.problem import Mpcc
from fesd_robot.mpcc.solution import MpccSolution, NlpReport

CONTINUATION_ITERATIONS = 120
"""IPOPT iterations on a branch before it is updated; what needs more has an element that shrinks to nothing."""

CONTINUATION_UPDATES = 1
"""How often that happens."""


FREER_STARTS = starting_at(1e-3, 1e-4), starting_at(1e-1, 1e-2)
"""IPOPT's options for a start that violates constraints which are new, one after the other until one leads to a
solution; a warm start meets such constraints slowly, or not."""


class BranchPoint(NamedTuple):
    """A point of a problem and its branch.

    Attributes:
        w: the point, (n).
        branch: the branch.
        freer: whether IPOPT starts further from it, as where it violates constraints that the earlier problem did not
            have.
    """

    w: np.ndarray
    branch: Branch
    freer: bool = False


def continue_on_branch(
    problem: Mpcc,
    polisher: Polisher,
    start: BranchPoint,
    earlier: MpccSolution,
    options: HomotopyOptions,
    *,
    seconds_left: Callable[[], float | None],
    progress: Callable[[NlpReport], None] | None = None,
    stop: Callable[[int, float], bool] | None = None,
) -> MpccSolution | None:
    """Return the exact solution of a problem on the branch of an earlier one, or None if there is none nearby.

    Args:
        problem: with the same conditions as the earlier one, discretised more finely.
        polisher: of the problem.
        start: a point of the problem.
        earlier: the solution it continues; its NLPs are listed first in the result.
        options: of the homotopy.
        seconds_left: of the time limit, None for none.
        progress: called after every NLP.
        stop: called once an IPOPT iteration with (iteration, objective); True ends the polishing.
    """
    begin, reports = time.perf_counter(), list(earlier.reports)

    def report(one: PolishingReport) -> None:
        reports.append(NlpReport.of_polishing(one))
        if progress:
            progress(reports[-1])

    nlp, end = BranchNlp.of(polisher, options.compile, few_evaluations=True), None
    for starting in FREER_STARTS if start.freer else ({},):
        end = end or nlp.solve(
            problem,
            start.w,
            options={**linear_solver_options(options.linear_solver), **starting, **options.ipopt},
            limits=PolishingLimits(
                options.feasibility,
                seconds_left,
                report,
                iterations=min(CONTINUATION_ITERATIONS, options.max_iterations),
                updates=CONTINUATION_UPDATES,
                stop=stop,
            ),
            branches=[start.branch],
        )
    if end is None:
        return None
    return replace(
        earlier,
        w=end.w,
        residuals=end.residuals,
        branch=end.branch,
        status=end.status,
        reports=reports,
        solve_seconds=earlier.solve_seconds + time.perf_counter() - begin,
    )
