"""What is known of one NLP."""

from __future__ import annotations

from dataclasses import dataclass

from fesd_robot.mpcc.problem import Residuals
from fesd_robot.nlp import NlpStatus


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
