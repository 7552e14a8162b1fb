"""How the task is solved and what is written: discretisation, solver, output."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from fesd_robot.task.fields import Count, NonNegative, Positive, Section, conflict, expected, is_number


def _read_gap(value: Any) -> Any:
    return "true" if value is True else value  # unquoted, YAML reads `gap: true` as a boolean


def _read_acceleration(value: Any) -> Any:
    if value == "auto" or (is_number(value) and 0 < value < math.inf):
        return value
    raise expected("'auto' or a number greater than 0 (m/s2)")


class Formulation(Section):
    """How contact becomes switching functions (time-freezing)."""

    gap: Annotated[
        Literal["integrated", "true"],
        BeforeValidator(_read_gap),
        WithJsonSchema({"enum": ["integrated", "true", True]}),
    ] = Field(
        default="integrated",
        description="Which gap switches the contact: a state that integrates the normal velocity (integrated), or the "
        "signed distance itself (true).",
    )
    gap_feedback: NonNegative = Field(
        default=30.0,
        description="Gain kappa that pulls the integrated gap towards the true one, 1/(m s); only with an integrated "
        "gap.",
    )
    gate: bool = Field(
        default=True,
        description="Whether the signs of the contact velocities matter only at the ground (true) or also in the air "
        "(false).",
    )
    step_selection_weight: NonNegative = Field(
        default=1e-3,
        description="Weight epsilon of the squared step functions in the cost, per s; picks one representative where "
        "they are not unique.",
    )

    @model_validator(mode="after")
    def _used(self) -> Formulation:
        if self.gap == "true" and self.gap_feedback != 30.0:
            raise conflict(
                ("gap_feedback",),
                f"found {self.gap_feedback:g}, which has no effect with gap: true, expected no such key or "
                "gap: integrated",
            )
        return self


class StepEquilibration(Section):
    """What keeps the finite elements between two switches equally long."""

    type: Literal["mean", "difference", "none"] = Field(
        default="mean",
        description="What is penalised: squared distances of the element lengths from their mean, squared differences "
        "of neighbours, or nothing.",
    )
    weight: NonNegative = Field(default=1.0, description="Weight of the penalty, per s2.")

    @model_validator(mode="after")
    def _used(self) -> StepEquilibration:
        if self.type == "none" and self.weight != 1.0:
            raise conflict(
                ("weight",),
                f"found {self.weight:g}, which has no effect with type: none, expected no such key or another type",
            )
        return self


class Method(Section):
    """The discretisation: finite elements with switch detection."""

    scheme: Literal["radau_iia", "gauss_legendre"] = Field(default="radau_iia", description="Runge-Kutta scheme.")
    stages: Annotated[int, Field(strict=True, ge=1, le=9)] = Field(
        default=2, description="Number of stages of the scheme, 1 to 9."
    )
    elements: Count = Field(default=3, description="Number of finite elements per control interval; an impact needs 3.")
    formulation: Formulation = Field(
        default_factory=Formulation, description="How contact becomes switching functions."
    )
    cross_complementarity: Literal["stage_stage", "lambda_sum", "theta_sum", "sum_sum"] = Field(
        default="lambda_sum",
        description="How complementarity pairs of one element are added up: not at all, over the multipliers, over the "
        "step functions, or over both.",
    )
    step_equilibration: StepEquilibration = Field(
        default_factory=StepEquilibration, description="What keeps elements between two switches equally long."
    )
    step_freedom: Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0, le=1)] = Field(
        default=1.0,
        description="How much longer than its equal share an element may become, as a fraction gamma_h of it, more "
        "than 0 and at most 1.",
    )
    auxiliary_acceleration: Annotated[
        float | Literal["auto"],
        BeforeValidator(_read_acceleration),
        WithJsonSchema({"anyOf": [{"type": "number", "exclusiveMinimum": 0}, {"const": "auto"}]}),
    ] = Field(
        default="auto",
        description="Acceleration a_n that resolves impacts while physical time stands still, m/s2, or auto to choose "
        "it from the robot's masses.",
    )


class Solver(Section):
    """The homotopy: a row of smooth problems whose relaxation sigma shrinks."""

    tolerance: Positive = Field(
        default=1e-8, description="Largest complementarity min(a, b) of a solved task, in the units of the pairs."
    )
    sigma_start: Positive = Field(default=1.0, description="Relaxation of the first problem, greater than tolerance.")
    sigma_factor: Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0, lt=1)] = Field(
        default=0.1, description="Factor from one relaxation to the next, between 0 and 1."
    )
    max_iterations: Count = Field(default=1000, description="Largest number of iterations of each smooth problem.")
    time_limit: Positive | None = Field(default=None, description="Longest solution time in total, s; default: none.")
    linear_solver: Literal["mumps"] = Field(default="mumps", description="Linear solver inside IPOPT.")

    @model_validator(mode="after")
    def _shrinks(self) -> Solver:
        if not self.sigma_start > self.tolerance:
            raise conflict(
                ("sigma_start",),
                f"found sigma_start {self.sigma_start:g} and tolerance {self.tolerance:g}, expected sigma_start > "
                "tolerance",
            )
        return self


class Output(Section):
    """Which optional files a plan leaves."""

    page: bool = Field(default=True, description="Whether to write the web page plan.html.")
    figures: bool = Field(default=True, description="Whether to draw figures.")
