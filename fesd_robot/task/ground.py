"""The ground of a task: its shape, its friction, its walls."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from fesd_robot.task.fields import Name, NonNegative, Number, Positive, Ratio, Section, conflict, expected, kind_of

GROUND = "ground"
"""Name of the ground among the surfaces that a contact may choose."""

STEEPEST = 20.0
"""Largest slope of a rise, the one that `fesd_robot.contact.ground` can compute with."""

RESTITUTION = (
    "Coefficient of restitution e of impacts, without unit, from 0 to 1: what hits with a normal velocity v parts with "
    "-e v; 0: it does not bounce."
)

_SMOOTHEST = 15 / 8
"""Steepest slope of a smoothed rise over its height per length."""


class Wall(Section):
    """A vertical wall without ends."""

    x: Number = Field(description="Where the wall stands, m.")
    side: Literal["left", "right"] = Field(
        description="The side of the wall where the robot is: left (smaller x) or right (larger x)."
    )
    friction: NonNegative = Field(default=0.8, description="Coefficient of Coulomb friction, without unit.")
    restitution: Ratio = Field(default=0.0, description=RESTITUTION)


def _check_walls(walls: dict[str, Wall]) -> dict[str, Wall]:
    if GROUND in walls:
        raise conflict((GROUND,), f"a wall cannot be called '{GROUND}', choose another name")
    return walls


Walls = Annotated[dict[Name, Wall], AfterValidator(_check_walls)]


def _check_slope(value: float) -> float:
    if not abs(value) < math.pi / 2:
        degrees = f"; {value:g} degrees are {math.radians(value):.4g} rad" if 1 < abs(value) < 90 else ""
        raise expected(f"an angle between -pi/2 and pi/2 (rad){degrees}")
    return value


class Shape(Section, ABC):
    """A ground of any shape."""

    BUILT_FROM: ClassVar[str]
    """The key to blame where a surface of this shape cannot be built."""

    friction: NonNegative = Field(
        default=0.8, description="Coefficient of Coulomb friction of the ground, without unit."
    )
    restitution: Ratio = Field(default=0.0, description=RESTITUTION)
    walls: Walls = Field(
        default_factory=dict,
        description="Name of a wall -> where it stands; contacts choose it by that name as their surface; default: "
        "none.",
    )

    @abstractmethod
    def in_words(self) -> str:
        """Return the shape, without friction and walls."""


class Plane(Shape):
    """A flat ground, horizontal or sloped."""

    BUILT_FROM = "slope"

    type: Literal["plane"] = Field(default="plane", description="Shape of the ground.")
    height: Number = Field(default=0.0, description="Height of the ground at x = 0, m.")
    slope: Annotated[Number, AfterValidator(_check_slope)] = Field(
        default=0.0,
        description="Angle by which the ground rises along +x, rad, between -pi/2 and pi/2.",
        json_schema_extra={"exclusiveMinimum": -math.pi / 2, "exclusiveMaximum": math.pi / 2},
    )

    def in_words(self) -> str:
        """Return the shape, without friction and walls."""
        slope = f"rising by {self.slope:g} rad along +x" if self.slope else "level"
        return f"Plane, {slope}, at height {self.height:g} m for x = 0"


class Step(Section):
    """An edge of the ground."""

    x: Number = Field(description="Where the edge is, m.")
    height: Number = Field(description="Height of the ground from this edge to the next, m.")


class Steps(Shape):
    """Level treads at different heights: stairs, gaps, holes."""

    BUILT_FROM = "steps"

    type: Literal["steps"] = Field(description="Shape of the ground.")
    height: Number = Field(default=0.0, description="Height of the ground before the first edge, m.")
    steps: list[Step] = Field(min_length=1, description="The edges along +x, each with the height behind it.")
    smoothing: Positive = Field(
        default=0.1,
        description="Length along x over which the ground rises or falls at an edge, centred there, m; edges are at "
        "least as far apart. It should be longer than what a contact travels within a finite element.",
    )

    @model_validator(mode="after")
    def _fit(self) -> Steps:
        height = self.height
        for i, step in enumerate(self.steps):
            at = ("steps", str(i))
            if i and not step.x > self.steps[i - 1].x:
                raise conflict(
                    (*at, "x"), f"found x {step.x:g} after {self.steps[i - 1].x:g}, expected edges with increasing x"
                )
            # The length of a rise is a sum of decimals: rounding must not forbid rises that meet.
            if i and step.x - self.steps[i - 1].x < self.smoothing * (1 - 1e-9):
                raise conflict(
                    (*at, "x"),
                    f"found an edge {step.x - self.steps[i - 1].x:g} m after the one before, expected at least the "
                    f"smoothing, {self.smoothing:g} m",
                )
            slope = _SMOOTHEST * abs(step.height - height) / self.smoothing
            if slope > STEEPEST:
                raise conflict(
                    (*at, "height"),
                    f"found a step of {abs(step.height - height):g} m smoothed over {self.smoothing:g} m, a slope of "
                    f"{slope:.3g}, expected at most {STEEPEST:g}: a smoothing of at least "
                    f"{_SMOOTHEST * abs(step.height - height) / STEEPEST:.3g} m, or a wall",
                )
            height = step.height
        return self

    def in_words(self) -> str:
        """Return the shape, without friction and walls."""
        edges = ", ".join(f"{step.height:g} m from x = {step.x:g} m" for step in self.steps)
        return f"Steps: {self.height:g} m high, then {edges}; every edge smoothed over {self.smoothing:g} m"


class HeightMap(Shape):
    """A ground through measured heights."""

    BUILT_FROM = "file"

    type: Literal["height_map"] = Field(description="Shape of the ground.")
    file: Annotated[str, Field(min_length=1)] = Field(
        description="Path, relative to the task file, of a CSV file with columns x,z: points of the ground, m, x "
        "increasing. A natural cubic spline joins them; beyond both ends the ground levels off over a tenth of the "
        "map's length and is flat."
    )

    def in_words(self) -> str:
        """Return the shape, without friction and walls."""
        return f"Height map {self.file}"


Ground = Annotated[
    Annotated[Plane, Tag("plane")] | Annotated[Steps, Tag("steps")] | Annotated[HeightMap, Tag("height_map")],
    Discriminator(kind_of("plane")),
]
