"""The motion that the costs compare with and the solver starts from."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from fesd_robot.task.fields import Count, Section, Values
from fesd_robot.task.words import listed


class Line(Section):
    """A straight line from the initial to the goal configuration."""

    type: Literal["line"] = Field(description="Straight line from the initial to the goal configuration.")

    def in_words(self) -> str:
        """Describe the reference in a sentence."""
        return "The line from start to goal."


class Jumps(Section):
    """A sequence of equal jumps: q(s) = q_line(s) + (apex - q_takeoff) 4 s (1 - s) in every flight, s from 0 to 1.

    Coordinates without an apex stay on the straight line from the initial to the goal configuration. Before every
    flight and after it the robot stands still.
    """

    type: Literal["jumps"] = Field(description="A sequence of equal jumps, each a parabola over the straight line.")
    count: Count = Field(description="Number of jumps, all of the same length.")
    apex: Values = Field(
        min_length=1,
        description="Name of a configuration coordinate -> value in the middle of every jump, m or rad; coordinates "
        "not listed stay on the straight line.",
    )
    stance: Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0, lt=1)] | None = Field(
        default=None,
        description="Fraction of the time of every jump that the robot stands still, half of it before the flight and "
        "half after it; default: the part that a free fall from the apex of root_z leaves, and 0 without such an apex.",
    )

    def in_words(self) -> str:
        """Describe the reference in a sentence."""
        jumps = f"{self.count} jump{'s' * (self.count != 1)}"
        return f"{jumps} over the line from start to goal, at their middle {listed(self.apex)}."


class ThroughWaypoints(Section):
    """Cubic splines through the configurations of the waypoints, one a coordinate.

    Every spline begins at the initial configuration and velocity and ends at the goal's.
    """

    type: Literal["waypoints"] = Field(
        description="Cubic spline from the initial through the waypoints' to the goal configuration."
    )

    def in_words(self) -> str:
        """Describe the reference in a sentence."""
        return "Cubic splines through the waypoints."


class FromFile(Section):
    """A motion read from a file, resampled by straight lines between its rows."""

    type: Literal["file"] = Field(description="Motion from a file.")
    path: Annotated[str, Field(min_length=1)] = Field(
        description="A CSV file with the columns 'time' (s) and one a configuration coordinate (m or rad; a unit in "
        "brackets after a name is left aside; roll, pitch and yaw may stand for a quaternion), a plan.json or the "
        "folder of a plan; relative to the task file."
    )
    stretch: bool = Field(
        default=False,
        description="Stretch the file's times to the duration of the motion; default: keep them, and hold the last "
        "configuration if the file ends early.",
    )

    def in_words(self) -> str:
        """Describe the reference in a sentence."""
        return f"The motion in {self.path}{', stretched to the duration' if self.stretch else ''}."


Reference = Annotated[Line | Jumps | ThroughWaypoints | FromFile, Field(discriminator="type")]
