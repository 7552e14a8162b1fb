"""The choices that define a discretisation by finite elements with switch detection."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from fesd_robot.fesd.tableau import Tableau, make_tableau

CrossComplementarity = Literal["stage_stage", "lambda_sum", "theta_sum", "sum_sum"]
StepEquilibration = Literal["mean", "difference", "none"]


@dataclass(frozen=True)
class FesdOptions:
    """How an interval is discretised.

    Args:
        tableau: Runge-Kutta scheme.
        elements: finite elements N_FE of each control interval: one number for all, or one per interval.
        cross_complementarity: aggregation of the pairs of an element, see `cross_pairs`.
        step_equilibration: ``mean``: rho sum (h_n - h_mean)^2; ``difference``: rho sum (h_{n+1} - h_n)^2; ``none``.
        equilibration_weight: rho.
        step_freedom: gamma_h in 0 <= h_n <= (1 + gamma_h) h_mean; 0 fixes the steps.

    Source: Nurkanovic, Sperl, Albrecht, Diehl, arXiv 2205.05337, section 4.
    """

    tableau: Tableau = field(default_factory=lambda: make_tableau("radau_iia", 2))
    elements: int | tuple[int, ...] = 3
    cross_complementarity: CrossComplementarity = "lambda_sum"
    step_equilibration: StepEquilibration = "mean"
    equilibration_weight: float = 1.0
    step_freedom: float = 1.0
