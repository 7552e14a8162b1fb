"""What the motion should be: horizon, initial state, goal, reference, costs, limits."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from fesd_robot.task.fields import (
    Bounds,
    Count,
    Name,
    NonNegative,
    Positive,
    Section,
    SymmetricBounds,
    Values,
    Weights,
    conflict,
)


class Horizon(Section):
    """How long the motion lasts and how finely its controls may change."""

    duration: Positive = Field(description="Length of the motion in physical time, s.")
    intervals: Annotated[int, Field(strict=True, ge=1, le=10_000)] = Field(
        description="Number of equal control intervals, at most 10000; the control is constant on each."
    )


class Initial(Section):
    """The state at time 0."""

    configuration: Values = Field(
        default_factory=dict,
        description="Name of a configuration coordinate -> initial value, m or rad; names not listed start at the "
        "robot's neutral configuration, moved into its limits.",
    )
    velocity: Values = Field(
        default_factory=dict,
        description="Name of a velocity coordinate -> initial value, m/s or rad/s; names not listed start at 0.",
    )


class Tolerance(Section):
    """How closely the goal must be met."""

    configuration: dict[Name, NonNegative] = Field(
        default_factory=dict,
        description="Name of a configuration coordinate -> largest distance from its goal at the end, m or rad, "
        "a hard constraint; names not listed are only weighed by the cost.",
    )
    velocity: dict[Name, NonNegative] = Field(
        default_factory=dict,
        description="Name of a velocity coordinate -> largest distance from its goal at the end, m/s or rad/s, "
        "a hard constraint; names not listed are only weighed by the cost.",
    )


class Goal(Section):
    """The state wanted at the end."""

    configuration: Values = Field(
        default_factory=dict,
        description="Name of a configuration coordinate -> wanted final value, m or rad; names not listed: their "
        "initial value.",
    )
    velocity: Values = Field(
        default_factory=dict,
        description="Name of a velocity coordinate -> wanted final value, m/s or rad/s; names not listed: 0.",
    )
    tolerance: Tolerance = Field(
        default_factory=Tolerance, description="Which goals are hard constraints, and how closely; default: none is."
    )


class Line(Section):
    """A straight line from the initial to the goal configuration."""

    type: Literal["line"] = Field(description="Straight line from the initial to the goal configuration.")


class Jumps(Section):
    """A row of equal jumps: q(s) = q_line(s) + (apex - q_takeoff) 4 s (1 - s) on every jump, s from 0 to 1.

    Coordinates without an apex stay on the straight line from the initial to the goal configuration.
    """

    type: Literal["jumps"] = Field(description="A row of equal jumps, each a parabola over the straight line.")
    count: Count = Field(description="Number of jumps, all of the same length.")
    apex: Values = Field(
        min_length=1,
        description="Name of a configuration coordinate -> value in the middle of every jump, m or rad; coordinates "
        "not listed stay on the straight line.",
    )


Reference = Annotated[Line | Jumps, Field(discriminator="type")]


class Costs(Section):
    """Weights of squared deviations; in a map that is given, names not listed weigh 0."""

    configuration: Weights | None = Field(
        default=None,
        description="Name of a configuration coordinate -> weight of its squared deviation from the reference, per s "
        "and m2 or rad2; default: 1 for every coordinate.",
    )
    velocity: Weights | None = Field(
        default=None,
        description="Name of a velocity coordinate -> weight of its square, per s and (m/s)2 or (rad/s)2; default: "
        "0.1 for every coordinate.",
    )
    control: Weights | None = Field(
        default=None,
        description="Name of a control -> weight of its square, per s and N2 or (N m)2; default: 1e-3 for every "
        "control.",
    )
    terminal_configuration: Weights | None = Field(
        default=None,
        description="Name of a configuration coordinate -> weight of its squared distance from the goal at the end, "
        "per m2 or rad2; default: 100 for every coordinate.",
    )
    terminal_velocity: Weights | None = Field(
        default=None,
        description="Name of a velocity coordinate -> weight of its squared distance from the goal at the end, per "
        "(m/s)2 or (rad/s)2; default: 10 for every coordinate.",
    )


class SpeedOfTime(Section):
    """How fast physical time may pass per unit of numerical time; 1 is the pace of a motion without impacts."""

    lower: Positive = Field(default=0.1, description="Smallest speed, s per s, at most 1.")
    upper: Positive = Field(default=20.0, description="Largest speed, s per s, at least 1.")

    @model_validator(mode="after")
    def _around_one(self) -> SpeedOfTime:
        if not (self.lower < self.upper and self.lower <= 1 <= self.upper):
            at = "upper" if self.upper < 1 else "lower"
            raise conflict(
                (at,), f"found lower {self.lower:g} and upper {self.upper:g}, expected lower < upper with 1 in between"
            )
        return self


class Limits(Section):
    """Limits of positions, velocities, efforts and the speed of time."""

    position: dict[Name, Bounds] = Field(
        default_factory=dict,
        description="Name of a configuration coordinate -> [lower, upper], m or rad, null for no limit on that side; "
        "names not listed: the model's limits.",
    )
    velocity: dict[Name, SymmetricBounds] = Field(
        default_factory=dict,
        description="Name of a velocity coordinate -> [lower, upper] or one number for plus or minus it, m/s or rad/s; "
        "names not listed: the model's limits.",
    )
    effort: dict[Name, SymmetricBounds] = Field(
        default_factory=dict,
        description="Name of a driven joint -> [lower, upper] torque, N m, or force, N, or one number for plus or "
        "minus it; names not listed: the model's limits.",
    )
    speed_of_time: SpeedOfTime = Field(default_factory=SpeedOfTime, description="Limits of the speed of time.")
