"""The sections `horizon` and `initial` of a task: duration, control intervals, state at time 0."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Discriminator, Field, Tag, model_validator

from fesd_robot.task.fields import Positive, Section, Values, conflict
from fesd_robot.task.standing import Configured


class FreeDuration(Section):
    """A duration that the planner chooses."""

    lower: Positive = Field(description="Shortest duration, s.")
    upper: Positive = Field(description="Longest duration, s.")

    @model_validator(mode="after")
    def _ordered(self) -> FreeDuration:
        if not self.lower < self.upper:
            raise conflict(("lower",), f"found lower {self.lower:g} and upper {self.upper:g}, expected lower < upper")
        return self


def _kind(value: Any) -> str:
    return "range" if isinstance(value, dict | FreeDuration) else "number"


Duration = Annotated[Annotated[Positive, Tag("number")] | Annotated[FreeDuration, Tag("range")], Discriminator(_kind)]
"""A number, or bounds between which the planner chooses."""


class Horizon(Section):
    """How long the motion lasts and how finely its controls may change."""

    duration: Duration = Field(
        description="Length of the motion in physical time, s; or lower and upper, between which it is chosen."
    )
    intervals: Annotated[int, Field(strict=True, ge=1, le=10_000)] = Field(
        description="Number of equal control intervals, at most 10000; the control is constant on each."
    )


class Initial(Configured):
    """The state at time 0."""

    configuration: Values = Field(
        default_factory=dict,
        description="Name of a configuration coordinate -> initial value, m or rad; names not listed start at the "
        "robot's neutral configuration, moved into its limits. An orientation by roll, pitch and yaw, rad, or by its "
        "whole quaternion.",
    )
    velocity: Values = Field(
        default_factory=dict,
        description="Name of a velocity coordinate -> initial value, m/s or rad/s; names not listed start at 0.",
    )
