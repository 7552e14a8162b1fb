"""Surfaces to stand on or to touch besides the ground: boxes and cylinders."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema, model_validator

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
)
from fesd_robot.task.ground import GROUND, RESTITUTION
from fesd_robot.task.words import along_axes

_SIZE = "three lengths [x, y, z] greater than 0, m, that along y null if the box has no end there"


def _read_size(value: Any) -> tuple[float, float | None, float]:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise expected(_SIZE)
    x, y, z = value
    if not all(is_number(edge) and 0 < edge < math.inf for edge in (x, z, *([] if y is None else [y]))):
        raise expected(_SIZE)
    return float(x), None if y is None else float(y), float(z)


_LENGTH: dict[str, Any] = {"type": "number", "exclusiveMinimum": 0}
BoxSize = Annotated[
    tuple[float, float | None, float],
    BeforeValidator(_read_size),
    WithJsonSchema(
        {
            "type": "array",
            "prefixItems": [_LENGTH, {**_LENGTH, "type": ["number", "null"]}, _LENGTH],
            "minItems": 3,
            "maxItems": 3,
        }
    ),
]
"""Lengths of the edges of a box along its x, y and z, m; None along y where it has no end."""


_UNDERSIDE = (
    "Whether it has an underside; without one it reaches down without end, as a box that stands on the floor does: "
    "nothing gets below it."
)


class SolidSurface(Section, ABC):
    """A solid that stays where it is and that contacts may touch from outside."""

    center: Offset = Field(description="Centre, m.")
    yaw: Number = Field(default=0.0, description="Angle by which it is turned about the world's +z, rad.")
    friction: NonNegative = Field(default=0.8, description="Coefficient of Coulomb friction, without unit.")
    restitution: Ratio = Field(default=0.0, description=RESTITUTION)
    edge_radius: Positive = Field(
        default=0.005,
        description="Radius of its rounded edges, m, below half of its shortest length: on them the normal turns from "
        "one face to the next.",
    )

    @property
    @abstractmethod
    def shortest(self) -> tuple[float, str]:
        """Half of its shortest length, m, and the key that gives it."""

    @abstractmethod
    def in_words(self) -> str:
        """Describe the kind and place of the surface, without friction."""

    @model_validator(mode="after")
    def _rounded(self) -> SolidSurface:
        half, key = self.shortest
        if not self.edge_radius < half:
            raise conflict(
                ("edge_radius",) if "edge_radius" in self.model_fields_set else (key,),
                f"found an edge_radius of {self.edge_radius:g} m where half of the shortest length is {half:g} m, "
                "expected it to be smaller",
            )
        return self

    def _turned(self) -> str:
        return f", turned by {self.yaw:g} rad about z" if self.yaw else ""


class BoxSurface(SolidSurface):
    """A box to stand on or to touch."""

    type: Literal["box"] = Field(description="Shape of the surface.")
    size: BoxSize = Field(
        strict=False, description="Lengths of its edges along its x, y and z, m; y null where it has no end."
    )
    pitch: Number = Field(
        default=0.0, description="Angle by which it is turned about +y, before the turn about z, rad: a ramp."
    )

    underside: bool = Field(default=False, description=_UNDERSIDE)

    @property
    def shortest(self) -> tuple[float, str]:
        """Half of its shortest length, m, and the key that gives it."""
        return min(edge for edge in self.size if edge is not None) / 2, "size"

    def in_words(self) -> str:
        """Describe the kind and place of the surface, without friction."""
        x, y, z = self.size
        sides = f"{x:g} m x {y:g} m x {z:g} m" if y is not None else f"{x:g} m x {z:g} m, without ends along y,"
        pitched = f", turned by {self.pitch:g} rad about y" if self.pitch else ""
        return f"Box {sides} around {along_axes(self.center)} m{pitched}{self._turned()}"


class CylinderSurface(SolidSurface):
    """A cylinder to stand on or to touch, standing or lying."""

    type: Literal["cylinder"] = Field(description="Shape of the surface.")
    radius: Positive = Field(description="Radius, m.")
    length: Positive | None = Field(description="Length along its axis, m; null without ends.")
    axis: Literal["x", "y", "z"] = Field(
        default="z", description="Its axis before it is turned by yaw: z standing, x or y lying."
    )
    underside: bool | None = Field(
        default=None, description=f"Of a standing one: {_UNDERSIDE[0].lower()}{_UNDERSIDE[1:]} Default: it has none."
    )

    @model_validator(mode="after")
    def _standing(self) -> CylinderSurface:
        if self.axis != "z" and self.underside is not None:
            raise conflict(
                ("underside",), f"found 'underside' beside axis: {self.axis}, expected it for a standing cylinder only"
            )
        return self

    @property
    def shortest(self) -> tuple[float, str]:
        """Half of its shortest length, m, and the key that gives it."""
        half_length = math.inf if self.length is None else self.length / 2
        return (self.radius, "radius") if self.radius <= half_length else (half_length, "length")

    def in_words(self) -> str:
        """Describe the kind and place of the surface, without friction."""
        length = "without ends" if self.length is None else f"{self.length:g} m long"
        return (
            f"Cylinder of radius {self.radius:g} m, {length}, along {self.axis} around {along_axes(self.center)} m"
            f"{self._turned()}"
        )


Surface = Annotated[BoxSurface | CylinderSurface, Field(discriminator="type")]


def _check_names(surfaces: dict[str, Surface]) -> dict[str, Surface]:
    if GROUND in surfaces:
        raise conflict((GROUND,), f"a surface cannot be called '{GROUND}', choose another name")
    return surfaces


Surfaces = Annotated[dict[Name, Surface], AfterValidator(_check_names)]
