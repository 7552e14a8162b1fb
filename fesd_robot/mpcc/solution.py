"""The end of a homotopy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.mpcc.problem import Mpcc, Residuals
from fesd_robot.mpcc.report import NlpReport
from fesd_robot.nlp import NlpPoint, NlpStatus


@dataclass(frozen=True)
class MpccSolution:
    """The end of a homotopy.

    Attributes:
        w: the returned point.
        residuals: recomputed at w.
        feasible: constraints and complementarity within the tolerances.
        solved: feasible, and the last NLP converged at the last sigma or in polishing.
        branch: on which polishing found a point whose products are zero to round-off; None if it did not.
        status: how the last NLP ended.
        reports: every NLP.
        build_seconds, solve_seconds: derivatives and the NLPs.
        point: w with the multipliers of its branch NLP; None if it is no end of one.
    """

    w: np.ndarray
    residuals: Residuals
    feasible: bool
    solved: bool
    branch: Branch | None
    status: NlpStatus
    reports: list[NlpReport]
    build_seconds: float
    solve_seconds: float
    point: NlpPoint | None = None

    @property
    def exact(self) -> bool:
        """Whether the products are zero to round-off."""
        return self.branch is not None

    @property
    def iterations(self) -> int:
        """IPOPT iterations in all."""
        return sum(report.iterations for report in self.reports)


def begun(problem: Mpcc, seconds: float) -> MpccSolution:
    """Return the start of a problem for whose first NLP no time was left.

    Args:
        problem: the MPCC.
        seconds: that making its derivatives took.
    """
    return MpccSolution(
        w=problem.start,
        residuals=problem.residuals(problem.start),
        feasible=False,
        solved=False,
        branch=None,
        status=NlpStatus.TIME_LIMIT,
        reports=[],
        build_seconds=seconds,
        solve_seconds=0.0,
    )
