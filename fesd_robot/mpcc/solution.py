"""The end of a homotopy, and what is known of every NLP on the way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.mpcc.polishing import PolishingReport
from fesd_robot.mpcc.problem import Residuals
from fesd_robot.mpcc.status import NlpStatus


@dataclass(frozen=True)
class NlpReport:
    """One NLP as it is shown in the progress table.

    Attributes:
        sigma, velocity_level_sigma: of the two levels; both are zero in a branch NLP, in which nothing is relaxed.
        status: how IPOPT ended.
        iterations, seconds: of the NLP.
        residuals: of the MPCC at its end.
    """

    sigma: float
    velocity_level_sigma: float
    status: NlpStatus
    iterations: int
    seconds: float
    residuals: Residuals

    @classmethod
    def of_polishing(cls, report: PolishingReport) -> NlpReport:
        """Return the report of a branch NLP."""
        return cls(0.0, 0.0, report.status, report.iterations, report.seconds, report.residuals)


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

    @property
    def exact(self) -> bool:
        """Whether the products are zero to round-off."""
        return self.branch is not None

    @property
    def iterations(self) -> int:
        """IPOPT iterations in all."""
        return sum(report.iterations for report in self.reports)
