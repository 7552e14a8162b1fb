"""The things in a task beside the robot: ground, contacts."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from fesd_robot.task.fields import Name, NonNegative, Number, Section, expected


def _check_slope(value: float) -> float:
    if not abs(value) < math.pi / 2:
        raise expected("an angle between -pi/2 and pi/2 (rad)")
    return value


class Plane(Section):
    """A flat ground, horizontal or sloped."""

    type: Literal["plane"] = Field(default="plane", description="Shape of the ground.")
    height: Number = Field(default=0.0, description="Height of the ground at x = 0, m.")
    slope: Annotated[Number, AfterValidator(_check_slope)] = Field(
        default=0.0,
        description="Angle by which the ground rises along +x, rad, between -pi/2 and pi/2.",
        json_schema_extra={"exclusiveMinimum": -math.pi / 2, "exclusiveMaximum": math.pi / 2},
    )
    friction: NonNegative = Field(default=0.8, description="Coefficient of Coulomb friction, without unit.")


class PointContact(Section):
    """One point of the robot that may touch the ground; its impacts are inelastic."""

    type: Literal["point"] = Field(default="point", description="Shape of the contact.")
    frame: Name = Field(description="Name of the robot's frame whose origin touches.")
    friction: NonNegative | None = Field(
        default=None,
        description="Coefficient of Coulomb friction of this contact, without unit; default: the ground's.",
    )
