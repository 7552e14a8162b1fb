"""The ground of a task: its shape, its friction, its walls."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, WithJsonSchema, model_validator

from fesd_robot.exactness import ROUNDED
from fesd_robot.ranges import STEEPEST
from fesd_robot.task.fields import (
    Name,
    NonNegative,
    Number,
    Offset,
    Positive,
    Ratio,
    Section,
    conflict,
    expected,
    is_number,
    kind_of,
)

GROUND = "ground"
"""Name of the ground among the surfaces that a contact may choose."""

RESTITUTION = (
    "Coefficient of restitution e of impacts, without unit, from 0 to 1: a contact that hits with a normal velocity v "
    "parts with -e v; 0: it does not bounce."
)

_SMOOTHEST = 15 / 8
"""Steepest slope of a smoothed rise over its height per length."""


def _numbers_pair(value: Any, least: float) -> tuple[float, float] | None:
    if not isinstance(value, list | tuple) or len(value) != 2:
        return None
    if not all(is_number(part) and math.isfinite(part) and part > least for part in value):
        return None
    return float(value[0]), float(value[1])


def _read_place(value: Any) -> tuple[float, float]:
    if (place := _numbers_pair(value, -math.inf)) is None:
        raise expected("two numbers [x, y]")
    return place


def _read_edges(value: Any) -> tuple[float, float]:
    if (edges := _numbers_pair(value, 0.0)) is None:
        raise expected("two lengths [x, y] greater than 0, m")
    return edges


def _pair_schema(**of_each: float) -> WithJsonSchema:
    items = {"type": "number", **of_each}
    return WithJsonSchema({"type": "array", "items": items, "minItems": 2, "maxItems": 2})


Place = Annotated[tuple[float, float], BeforeValidator(_read_place), _pair_schema()]
"""x and y of a place, m."""

Edges2 = Annotated[tuple[float, float], BeforeValidator(_read_edges), _pair_schema(exclusiveMinimum=0)]
"""Lengths along x and y, m."""

_WALL_FORMS = "either x and side, or place and facing"


class Wall(Section):
    """A vertical wall without ends: across x, or facing any direction."""

    x: Number | None = Field(default=None, description="Where a wall across x stands, m.")
    side: Literal["left", "right"] | None = Field(
        default=None,
        description="The side of a wall across x where the robot is: left (smaller x) or right (larger x).",
    )
    place: Place | None = Field(
        default=None, strict=False, description="x and y of a point of a wall that faces any direction, m."
    )
    facing: Number | None = Field(
        default=None,
        description="Direction in which such a wall's free side looks, an angle from +x towards +y, rad.",
    )
    friction: NonNegative = Field(default=0.8, description="Coefficient of Coulomb friction, without unit.")
    restitution: Ratio = Field(default=0.0, description=RESTITUTION)

    @model_validator(mode="after")
    def _one_form(self) -> Wall:
        across, any_way = {"x": self.x, "side": self.side}, {"place": self.place, "facing": self.facing}
        given = [[key for key, value in form.items() if value is not None] for form in (across, any_way)]
        if all(given):
            raise conflict((given[1][0],), f"found '{given[1][0]}' beside '{given[0][0]}', expected {_WALL_FORMS}")
        if not any(given):
            raise conflict((), f"found no place for the wall, expected {_WALL_FORMS}")
        form = across if given[0] else any_way
        for key, value in form.items():
            if value is None:
                raise conflict((), f"'{key}' is missing, expected {_WALL_FORMS}")
        return self

    def in_words(self) -> str:
        """Return where it stands, as the rest of a sentence, without friction."""
        if self.place is None:
            return f"at x = {self.x:g} m, the robot on its {self.side}"
        return f"through x = {self.place[0]:g}, y = {self.place[1]:g} m, facing {self.facing:g} rad from +x towards +y"


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


Slope = Annotated[
    Number,
    AfterValidator(_check_slope),
    Field(json_schema_extra={"exclusiveMinimum": -math.pi / 2, "exclusiveMaximum": math.pi / 2}),
]
"""An angle between -pi/2 and pi/2, rad."""


class GroundShape(Section, ABC):
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


class Plane(GroundShape):
    """A flat ground, horizontal or sloped."""

    BUILT_FROM = "slope"

    type: Literal["plane"] = Field(default="plane", description="Shape of the ground.")
    height: Number = Field(default=0.0, description="Height of the ground at x = 0, m.")
    slope: Slope = Field(
        default=0.0, description="Angle by which the ground rises along +x, rad, between -pi/2 and pi/2."
    )
    lateral_slope: Slope = Field(
        default=0.0,
        description="Angle by which the ground rises along +y, rad, between -pi/2 and pi/2, for robots in space: its "
        "height is height + x tan(slope) + y tan(lateral_slope).",
    )

    def in_words(self) -> str:
        """Return the shape, without friction and walls."""
        slopes = [(self.slope, "x"), (self.lateral_slope, "y")]
        rises = [f"{angle:g} rad along +{axis}" for angle, axis in slopes if angle]
        at = "x = 0" if not self.lateral_slope else "x = y = 0"
        return (
            f"Plane, {'rising by ' + ' and '.join(rises) if rises else 'level'}, at height {self.height:g} m for {at}"
        )


class Step(Section):
    """An edge of the ground."""

    x: Number = Field(description="Where the edge is, m.")
    height: Number = Field(description="Height of the ground from this edge to the next, m.")


class Steps(GroundShape):
    """Level treads at different heights: stairs, gaps, holes."""

    BUILT_FROM = "steps"

    type: Literal["steps"] = Field(description="Shape of the ground.")
    height: Number = Field(default=0.0, description="Height of the ground before the first edge, m.")
    steps: list[Step] = Field(min_length=1, description="The edges along +x, each with the height behind it.")
    smoothing: Positive = Field(
        default=0.1,
        description="Length along x over which the ground rises or falls at an edge, centred there, m; edges are at "
        "least as far apart. It should be longer than the way of a contact within a finite element.",
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
            if i and step.x - self.steps[i - 1].x < self.smoothing * (1 - ROUNDED):
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


_IMAGE_KEYS = ("size", "height", "origin")


class HeightMap(GroundShape):
    """A ground through measured heights, along x only or over a grid of x and y."""

    BUILT_FROM = "file"

    type: Literal["height_map"] = Field(description="Shape of the ground.")
    file: Annotated[str, Field(min_length=1)] = Field(
        description="Path, relative to the task file, of a CSV file with columns x,z or x,y,z, points of the ground, "
        "m, or of a grey PNG image. Points x,z have increasing x, and the ground does not vary along y; points x,y,z "
        "are a full grid in any order. Natural cubic splines join them; beyond its ends the ground levels off.",
    )
    size: Edges2 | None = Field(
        default=None, strict=False, description="Of an image: lengths along x and y between its outermost pixels, m."
    )
    height: Number | None = Field(
        default=None, description="Of an image: height of white above black, m; negative if black is high."
    )
    origin: Offset | None = Field(
        default=None,
        strict=False,
        description="Of an image: x and y of its lower left pixel, and the height of black, m; default: its middle is "
        "at x = y = 0, and black at 0.",
    )

    @property
    def is_image(self) -> bool:
        """Whether the file is an image."""
        return self.file.lower().endswith(".png")

    @model_validator(mode="after")
    def _fits_file(self) -> HeightMap:
        given = [key for key in _IMAGE_KEYS if getattr(self, key) is not None]
        if self.is_image and (missing := [key for key in ("size", "height") if key not in given]):
            raise conflict(
                ("file",), f"found the image '{self.file}' without '{missing[0]}', expected size [x, y] and height, m"
            )
        if given and not self.is_image:
            raise conflict(
                (given[0],), f"found '{given[0]}' beside the file '{self.file}', expected it for an image (.png) only"
            )
        return self

    def in_words(self) -> str:
        """Return the shape, without friction and walls."""
        return f"Height map {self.file}"


Ground = Annotated[
    Annotated[Plane, Tag("plane")] | Annotated[Steps, Tag("steps")] | Annotated[HeightMap, Tag("height_map")],
    Discriminator(kind_of("plane")),
]
