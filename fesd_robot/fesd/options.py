"""The choices that define a discretisation by finite elements with switch detection."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.errors import DimensionError, ModelError, OptionError, nearest
from fesd_robot.fesd.tableau import Tableau, make_tableau

CrossComplementarity = Literal["stage_stage", "lambda_sum", "theta_sum", "sum_sum"]
StepEquilibration = Literal[
    "mean", "difference", "difference_tanh", "difference_product", "direct", "linear_complementarity", "none"
]
Form = Literal["integral", "differential", "lifted"]


@checked
@dataclass(frozen=True)
class FesdOptions:
    """How an interval is discretised.

    Args:
        tableau: Runge-Kutta scheme.
        elements: finite elements N_FE of each control interval: one number for all, or one per interval.
        form: variables of the scheme. ``integral``: stage states X_j on a collocation polynomial; ``differential``:
            stage derivatives K_j, X_j = X_0 + h sum_r a_jr K_r; ``lifted``: both. Left out: the integral form for
            optimal control problems where the scheme has one, else the differential form.
        switch_detection: False gives the plain scheme with fixed steps and complementarity at its stages only.
        cross_complementarity: aggregation of the pairs of an element, see `cross_pairs`.
        step_equilibration: what makes the steps of an interval equal where no switch is, see `equilibrate`.
        equilibration_weight: rho.
        equilibration_width: sigma_se of ``difference_tanh``.
        step_freedom: gamma_h in 0 <= h_n <= (1 + gamma_h) h_mean; 0 fixes the steps. Left out: 1 for optimal control
            problems; in a simulation as much as an element can need to fill its step.

    Raises:
        DimensionError: a number of elements below one.
        ModelError: a form that the scheme does not have, or a number outside its range.
        OptionError: a name that does not exist, or a tableau that is none.

    Source: Nurkanovic, Sperl, Albrecht, Diehl, arXiv 2205.05337, section 4.
    """

    tableau: Tableau = field(default_factory=lambda: make_tableau("radau_iia", 2))
    elements: int | tuple[int, ...] = 3
    form: Form | None = None
    switch_detection: bool = True
    cross_complementarity: CrossComplementarity = "lambda_sum"
    step_equilibration: StepEquilibration = "mean"
    equilibration_weight: float = 1.0
    equilibration_width: float = 1.0
    step_freedom: float | None = None

    def __post_init__(self) -> None:
        for key, valid in (
            ("form", (None, *get_args(Form))),
            ("cross_complementarity", get_args(CrossComplementarity)),
            ("step_equilibration", get_args(StepEquilibration)),
        ):
            value = getattr(self, key)
            if value not in valid:
                raise OptionError(f"{key} is {_shown(value)}{nearest(str(value), [name for name in valid if name])}")
        counts = self.elements if isinstance(self.elements, tuple) else (self.elements,)
        if not counts or not all(_is_count(count) for count in counts):
            raise DimensionError(
                f"elements must be one positive number per interval, or one for all, found {_shown(self.elements)}"
            )
        if self.form == "integral" and not self.tableau.collocation:
            raise ModelError(
                f"form 'integral' needs a collocation scheme with distinct nodes above zero, which "
                f"{self.tableau.scheme} is not (valid: differential, lifted)"
            )
        freedom = 1.0 if self.step_freedom is None else self.step_freedom
        if freedom < 0 or self.equilibration_weight < 0 or self.equilibration_width <= 0:
            raise ModelError(
                f"step_freedom and equilibration_weight must not be negative and equilibration_width positive, found "
                f"{freedom:g}, {self.equilibration_weight:g} and {self.equilibration_width:g}"
            )

    @property
    def gamma(self) -> float:
        """gamma_h."""
        return 1.0 if self.step_freedom is None else self.step_freedom

    def with_form(self, preferred: Form) -> FesdOptions:
        """Return the options with the form chosen, `preferred` where it was left out and the scheme has it."""
        if self.form is not None:
            return self
        return replace(self, form=preferred if self.tableau.collocation else "differential")


def _is_count(value: object) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool) and int(value) >= 1


def _shown(value: Any) -> str:
    """Return a value in a message, or its type where that would be long."""
    return repr(value) if isinstance(value, str | int | float | tuple | np.number) else f"a {type(value).__name__}"
