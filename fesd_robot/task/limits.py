"""Limits of the motion by name, and what a plan leaves unused of them."""

from __future__ import annotations

from pydantic import Field, model_validator

from fesd_robot.task.fields import Bounds, Name, Positive, Reserved, Section, SymmetricBounds, conflict


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
        "names not listed: the model's limits. Roll, pitch and yaw of an orientation, and the angle of a continuous "
        "joint, have none but these.",
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


class Reserve(Section):
    """What a plan leaves unused of friction and effort, for whatever the model does not know."""

    friction: Reserved = Field(
        default=0.0,
        description="Part of the cone of friction that a contact leaves unused where it sticks, also in an impact: its "
        "tangential force is at most (1 - friction) mu times the normal force. A contact that slides has all of its "
        "friction, by Coulomb's law. For contacts that do not say their own reserve; default: 0.",
    )
    effort: Reserved = Field(
        default=0.0,
        description="Part of its limit that every control leaves unused. For actuators that do not say their own "
        "reserve; default: 0.",
    )
