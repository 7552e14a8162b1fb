"""The contacts of a task: what may touch what."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag, WithJsonSchema, model_validator

from fesd_robot.errors import nearest
from fesd_robot.task.fields import (
    Name,
    NonNegative,
    Offset,
    Positive,
    Ratio,
    Reserved,
    Section,
    conflict,
    expected,
    is_number,
    kind_of,
)
from fesd_robot.task.ground import GROUND, RESTITUTION

_FRICTION = "Coefficient of Coulomb friction of this contact, without unit; default: the surface's."
_RESTITUTION = f"{RESTITUTION} Default: the surface's."
_SLIPPING = (
    "Whether this contact may slip along its surface: forbidden lets it stick or leave only, while an impact may "
    "still change its tangential velocity; the force stays inside the cone of friction. A number is the largest "
    "distance, m, that it may slip over the whole motion, to and fro added up."
)
_AUTOMATIC = (
    " auto: forbidden on the ground where the reference is a sequence of jumps and there is friction, else allowed."
)
_RESERVE = "Part of its cone of friction that it leaves unused where it sticks; default: reserve.friction."
_STIFFNESS = (
    "Stiffness of a contact that gives way, N/m: its force is max(0, -stiffness gap - damping times the rate of the "
    "gap), without friction, impact or jump of a velocity; default: the contact is rigid."
)
_DAMPING = "Damping of a contact with stiffness, N s/m."
_SURFACE = f"Surface that it touches: {GROUND}, the name of a wall in ground.walls, or a name in surfaces."


def _read_slipping(value: Any) -> Any:
    words = ("allowed", "forbidden", "auto")
    if value in words:
        return value
    if is_number(value) and value == 0:
        raise expected("'forbidden' for a contact that may not slip at all")
    if not is_number(value) or not 0 < value < math.inf:
        hint = nearest(value, words) if isinstance(value, str) else ""
        raise expected(f"'allowed', 'forbidden', 'auto' or a number greater than 0 (m){hint if 'mean' in hint else ''}")
    return float(value)


Slipping = Annotated[
    Literal["allowed", "forbidden", "auto"] | Annotated[float, Field(gt=0, allow_inf_nan=False)],
    BeforeValidator(_read_slipping),
]
"""Whether a contact may slip, or the largest distance, m, that it may."""


_OFFSET = "Where it is from the frame's origin, in the frame's axes, m; default: at the origin."


def _read_size(value: Any) -> tuple[float, ...]:
    lengths = isinstance(value, list | tuple) and all(is_number(one) and 0 < one < math.inf for one in value)
    if not lengths or len(value) not in (2, 3):
        raise expected("two lengths greater than 0, along x and z of the frame, or in space three, m")
    return tuple(float(one) for one in value)


Size = Annotated[
    tuple[float, ...],
    BeforeValidator(_read_size),
    WithJsonSchema({"type": "array", "items": {"type": "number", "exclusiveMinimum": 0}, "minItems": 2, "maxItems": 3}),
]
"""Lengths of a box in the x-z plane, or in space along all three axes, m."""


class _Compliance(Section):
    """What a contact may be that gives way."""

    @model_validator(mode="after")
    def _compliance(self) -> _Compliance:
        damping = getattr(self, "damping", None)
        if damping is not None and getattr(self, "stiffness", None) is None:
            raise conflict(
                ("damping",),
                f"found {damping:g} for a rigid contact, expected stiffness (N/m) beside it, or no such key",
            )
        return self


class PlacedContact(_Compliance):
    """A contact at a place on a frame."""

    frame: Name
    offset: Offset = Field(default=(0.0, 0.0, 0.0), strict=False, description=_OFFSET)

    @property
    def touching_frame(self) -> str:
        """Name of the frame in its place: its own, or for one with an offset that of a frame added to the robot."""
        return (
            f"{self.frame} at {' '.join(f'{value:.10g}' for value in self.offset)}" if any(self.offset) else self.frame
        )


class PointContact(PlacedContact):
    """One point of the robot that may touch a surface."""

    type: Literal["point"] = Field(default="point", description="Shape of the contact.")
    frame: Name = Field(description="Name of the robot's frame whose origin touches.")
    surface: Name = Field(default=GROUND, description=_SURFACE)
    friction: NonNegative | None = Field(default=None, description=_FRICTION)
    restitution: Ratio | None = Field(default=None, description=_RESTITUTION)
    slipping: Slipping = Field(default="auto", description=_SLIPPING + _AUTOMATIC)
    reserve: Reserved | None = Field(default=None, description=_RESERVE)
    stiffness: Positive | None = Field(default=None, description=_STIFFNESS)
    damping: NonNegative | None = Field(default=None, description=_DAMPING)


class CircleContact(PlacedContact):
    """A circle in the x-z plane, in space a ball, that may touch a surface, and roll or slide on it."""

    type: Literal["circle"] = Field(description="Shape of the contact.")
    frame: Name = Field(description="Name of the robot's frame about whose origin the circle lies; it turns with it.")
    radius: Positive = Field(description="Radius of the circle, m.")
    surface: Name = Field(default=GROUND, description=_SURFACE)
    friction: NonNegative | None = Field(default=None, description=_FRICTION)
    restitution: Ratio | None = Field(default=None, description=_RESTITUTION)
    slipping: Slipping = Field(default="allowed", description=_SLIPPING + _AUTOMATIC)
    reserve: Reserved | None = Field(default=None, description=_RESERVE)
    stiffness: Positive | None = Field(default=None, description=_STIFFNESS)
    damping: NonNegative | None = Field(default=None, description=_DAMPING)


class BodyContact(_Compliance):
    """All points and circles of a body's collision shapes that may touch; the program makes a contact of each."""

    type: Literal["body"] = Field(default="body", description="Shape of the contact: that of the body.")
    body: Name = Field(
        description="Name of the frame of the body, or link, whose collision shapes touch: spheres and ends of "
        "capsules as circles, corners of boxes and rims of cylinders as points. Several become contacts NAME_1, "
        "NAME_2 and so on, from back to front; NAME stands for all of them wherever the task names a contact."
    )
    surface: Name = Field(default=GROUND, description=_SURFACE)
    friction: NonNegative | None = Field(
        default=None,
        description="Coefficient of Coulomb friction, without unit; default: the ground's if the task gives one, or "
        "the shape's of a MuJoCo file, or the default of the ground; of any other surface always that one's.",
    )
    restitution: Ratio | None = Field(default=None, description=_RESTITUTION)
    slipping: Slipping = Field(default="auto", description=_SLIPPING + _AUTOMATIC)
    reserve: Reserved | None = Field(default=None, description=_RESERVE)
    stiffness: Positive | None = Field(default=None, description=_STIFFNESS)
    damping: NonNegative | None = Field(default=None, description=_DAMPING)


class TwoBodyContact(_Compliance):
    """A circle in the x-z plane, in space a ball, and something on another body that may touch, and roll or slide."""

    frame: Name = Field(description="Name of the frame about whose origin the first circle lies; it turns with it.")
    radius: Positive = Field(description="Radius of the first circle, m.")
    other_frame: Name
    friction: NonNegative | None = Field(
        default=None,
        description="Coefficient of Coulomb friction of this contact, without unit; default: the ground's.",
    )
    restitution: Ratio | None = Field(default=None, description=f"{RESTITUTION} Default: the ground's.")
    slipping: Slipping = Field(default="allowed", description=_SLIPPING + _AUTOMATIC)
    reserve: Reserved | None = Field(default=None, description=_RESERVE)
    stiffness: Positive | None = Field(default=None, description=_STIFFNESS)
    damping: NonNegative | None = Field(default=None, description=_DAMPING)
    facing: Literal["x", "-x", "y", "-y", "z", "-z"] | None = Field(
        default=None,
        description="In space: the axis of the world whose tangents those of the contact are, turned with the normal "
        "from there; tangential and lateral forces are along them. Default: the axis nearest to the direction from the "
        "other body to this one at the start.",
    )

    @property
    def touching_frame(self) -> str:
        """Name of the frame in its place."""
        return self.frame

    @model_validator(mode="after")
    def _distinct(self) -> TwoBodyContact:
        if self.frame == self.other_frame:
            raise conflict(("other_frame",), f"found '{self.frame}' twice, expected two frames that move apart")
        return self


class CircleCircleContact(TwoBodyContact):
    """Two circles in the x-z plane, in space balls, on two bodies that may touch each other, and roll or slide."""

    type: Literal["circle_circle"] = Field(description="Shape of the contact.")
    other_frame: Name = Field(description="Name of the frame about whose origin the second circle lies.")
    other_radius: Positive | None = Field(
        default=None,
        description="Radius of the second circle, m; default: that of the body of type ball that other_frame names.",
    )


class CircleBoxContact(TwoBodyContact):
    """A circle, in space a ball, and a box on two bodies that may touch each other, on the box's sides and corners."""

    type: Literal["circle_box"] = Field(description="Shape of the contact.")
    radius: Positive = Field(description="Radius of the circle, m.")
    other_frame: Name = Field(description="Name of the frame about whose origin the box lies; it turns with it.")
    other_size: Size | None = Field(
        default=None,
        strict=False,
        description="Lengths of the box along the x and the z axis of its frame, in space along all three, m; default: "
        "those of the body of type box that other_frame names.",
    )


SingleContact = PointContact | CircleContact | CircleCircleContact | CircleBoxContact
"""A contact that is one point or circle."""


def _kind(value: Any) -> str:
    if isinstance(value, dict) and "body" in value:
        value = {"type": "body", **value}
    return kind_of("point")(value)


Contact = Annotated[
    Annotated[PointContact, Tag("point")]
    | Annotated[CircleContact, Tag("circle")]
    | Annotated[BodyContact, Tag("body")]
    | Annotated[CircleCircleContact, Tag("circle_circle")]
    | Annotated[CircleBoxContact, Tag("circle_box")],
    Discriminator(_kind),
]
