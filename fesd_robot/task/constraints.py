"""The section `constraints` of a task: constraints on the motion besides its limits, by name."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from fesd_robot.task.distances import BodyDistance, ObstacleDistance
from fesd_robot.task.fields import (
    AXES,
    Bounds,
    Name,
    Names,
    NonNegative,
    Number,
    Offset,
    Point,
    Positive,
    Section,
    conflict,
    expected,
    is_number,
)
from fesd_robot.task.words import along_axes

_TIMES = "two times [from, to] with 0 <= from < to"


def _read_times(value: Any) -> tuple[float, float]:
    if not isinstance(value, list | tuple) or len(value) != 2 or not all(map(is_number, value)):
        raise expected(_TIMES)
    if not 0 <= value[0] < value[1]:
        raise expected(_TIMES)
    return float(value[0]), float(value[1])


Times = Annotated[
    tuple[float, float],
    BeforeValidator(_read_times),
    WithJsonSchema({"type": "array", "items": {"type": "number", "minimum": 0}, "minItems": 2, "maxItems": 2}),
]
"""``[from, to]``, s."""


class BodyPoint(Section, ABC):
    """A constraint on the position of a point that is fixed to a frame of the robot."""

    frame: Name = Field(description="Name of the frame.")
    offset: Offset = Field(
        default=(0.0, 0.0, 0.0), strict=False, description="The point in the frame's axes, m; default: its origin."
    )

    def in_words(self) -> str:
        """Return the constraint as a part of a sentence."""
        point = f"the point {along_axes(self.offset)} m of" if any(self.offset) else "the origin of"
        return f"{point} frame '{self.frame}' {self.place_in_words()}, at every stage"

    @abstractmethod
    def place_in_words(self) -> str:
        """Return where the point stays."""


class Clearance(BodyPoint):
    """A point that stays above the ground."""

    type: Literal["clearance"] = Field(description="The point stays above the ground.")
    distance: Number = Field(description="Smallest distance from the ground, m.")

    def place_in_words(self) -> str:
        """Return where the point stays."""
        return f"stays {self.distance:g} m above the ground"


class AvoidSphere(BodyPoint):
    """A point that stays outside a sphere."""

    type: Literal["avoid_sphere"] = Field(description="The point stays outside a sphere.")
    center: Point = Field(description="Centre of the sphere, m; with null for one axis it is a cylinder along it.")
    radius: Positive = Field(description="Radius, m.")

    def place_in_words(self) -> str:
        """Return where the point stays."""
        return f"stays out of the sphere of radius {self.radius:g} m around {along_axes(self.center)} m"


class AvoidEllipse(BodyPoint):
    """A point that stays outside an ellipsoid: sum_i ((x_i - c_i) / a_i)^2 >= 1."""

    type: Literal["avoid_ellipse"] = Field(description="The point stays outside an ellipsoid.")
    center: Point = Field(description="Centre, m; with null for one axis it is an elliptic cylinder along it.")
    semi_axes: Point = Field(description="Half the extent along every axis that the centre has, m, greater than 0.")

    @model_validator(mode="after")
    def _same_axes(self) -> AvoidEllipse:
        _check_extent("semi_axes", self.center, self.semi_axes)
        return self

    def place_in_words(self) -> str:
        """Return where the point stays."""
        half_axes = along_axes(self.semi_axes)
        return f"stays out of the ellipsoid around {along_axes(self.center)} m, half axes {half_axes} m"


class AvoidBox(BodyPoint):
    """A point that stays outside a box, rounded outwards: sum_i (2 (x_i - c_i) / size_i)^power >= number of axes.

    The rounded body goes through the box's corners and contains the box; its faces lie ``n^(1/power)`` times as far
    from the centre as the box's, for two axes and a power of 8 that is 9 % further.
    """

    type: Literal["avoid_box"] = Field(description="The point stays outside a box along the world's axes.")
    center: Point = Field(description="Centre of the box, m; null for an axis along which it has no end.")
    size: Point = Field(description="Length of the edges along every axis that the centre has, m, greater than 0.")
    power: Literal[4, 8, 16] = Field(
        default=8,
        description="How sharp the edges are: the body that is kept free contains the box and is wider by the factor "
        "n^(1/power) with n the number of axes.",
    )

    @model_validator(mode="after")
    def _same_axes(self) -> AvoidBox:
        _check_extent("size", self.center, self.size)
        return self

    def place_in_words(self) -> str:
        """Return where the point stays."""
        axes = sum(value is not None for value in self.center)
        wider = 100 * (axes ** (1 / self.power) - 1)
        return (
            f"stays out of the box around {along_axes(self.center)} m, size {along_axes(self.size)} m, rounded "
            f"outwards (up to {wider:.2g} % wider)"
        )


class FrameLimits(BodyPoint):
    """Bounds of the position of a point."""

    type: Literal["frame_limits"] = Field(description="The position of the point has bounds.")
    x: Bounds | None = Field(default=None, description="[lower, upper], m, null for no bound on that side.")
    y: Bounds | None = Field(default=None, description="[lower, upper], m, null for no bound on that side.")
    z: Bounds | None = Field(default=None, description="[lower, upper], m, null for no bound on that side.")

    @model_validator(mode="after")
    def _some(self) -> FrameLimits:
        if self.x is None and self.y is None and self.z is None:
            raise conflict((), "found no bound, expected at least one of x, y and z")
        return self

    def place_in_words(self) -> str:
        """Return where the point stays."""
        bounds = {axis: given for axis in AXES if (given := getattr(self, axis)) is not None}
        return f"stays in {', '.join(f'{axis} [{low:g}, {high:g}]' for axis, (low, high) in bounds.items())} m"


class ForbiddenZone(Section):
    """A stretch of ground that a contact may pass over but not touch."""

    type: Literal["forbidden_zone"] = Field(description="A contact may not touch the ground in a range of x.")
    contact: Name = Field(description="Name of the contact.")
    x: Bounds = Field(description="[from, to], m, null for no end on that side.")

    def in_words(self) -> str:
        """Return the constraint as a part of a sentence."""
        return f"{self.contact} does not push on the ground for x in [{self.x[0]:g}, {self.x[1]:g}] m"


class ContactWindow(Section):
    """A hint when a contact touches: from one end of a control interval to another."""

    type: Literal["contact_window"] = Field(description="A contact must or may not touch during some time.")
    contact: Name = Field(description="Name of the contact.")
    times: Times = Field(description="[from, to], s, both ends of control intervals.")
    touch: Literal["required", "forbidden"] = Field(
        description="required: at both times and every interval's end between them the gap is closed; forbidden: the "
        "gap is open from the first to the second time."
    )
    clearance: Positive = Field(
        default=0.01, description="Smallest gap while touching is forbidden, m; used with touch: forbidden only."
    )
    tolerance: NonNegative = Field(
        default=1e-3, description="Largest gap that counts as closed, m; used with touch: required only."
    )

    @model_validator(mode="after")
    def _used(self) -> ContactWindow:
        unused = "clearance" if self.touch == "required" else "tolerance"
        if unused in self.model_fields_set and getattr(self, unused) != type(self).model_fields[unused].default:
            raise conflict((unused,), f"found '{unused}' with touch: {self.touch}, where it has no meaning")
        return self

    def in_words(self) -> str:
        """Return the constraint as a part of a sentence."""
        gap = f"is closed within {self.tolerance:g} m at every interval's end"
        if self.touch == "forbidden":
            gap = f"is open by {self.clearance:g} m at every stage"
        return f"the gap of {self.contact} {gap} from {self.times[0]:g} to {self.times[1]:g} s"


class SwingClearance(Section):
    """Contacts that are high when they are fast, so that a foot passes at a height whenever it swings.

    With the gap g, the tangential velocity v_t, the height h and the speed c, at every stage

        g >= h (v_t^2 - c^2) / (v_t^2 + c^2)

    which is no bound for a contact slower than c, 0.6 h at 2 c, 0.8 h at 3 c, and h for one that is much faster.
    """

    type: Literal["swing_clearance"] = Field(
        description="Contacts that move along a surface do so at a height, whenever that is."
    )
    contacts: Names = Field(description="Names of the contacts.")
    height: Positive = Field(description="Gap of a contact that is much faster than 'speed', m.")
    speed: Positive | None = Field(
        default=None,
        description="Speed along the surface, m/s, at which a contact may still touch; at 2, 3 and 5 times this it is "
        "0.6, 0.8 and 0.92 of the height above it. Default: a tenth of the robot's length per its own time, "
        "sqrt(length / gravity).",
    )

    @property
    def spare(self) -> float:
        """By how much the audit lets the gap be less, m: a hundredth of the height, which is no edge of a body."""
        return 0.01 * self.height

    def in_words(self) -> str:
        """Return the constraint as a part of a sentence."""
        return (
            f"where {' or '.join(self.contacts)} moves along the surface faster than {self.speed:g} m/s, it is above "
            f"it, by {0.8 * self.height:.3g} m at {3 * (self.speed or 0.0):.3g} m/s and towards {self.height:g} m"
        )


Constraint = Annotated[
    Clearance
    | AvoidSphere
    | AvoidEllipse
    | AvoidBox
    | FrameLimits
    | BodyDistance
    | ObstacleDistance
    | ForbiddenZone
    | ContactWindow
    | SwingClearance,
    Field(discriminator="type"),
]


def _check_extent(key: str, center: Point, extent: Point) -> None:
    for axis, middle, length in zip("xyz", center, extent, strict=True):
        if (middle is None) != (length is None):
            raise conflict((key,), f"found {axis} in only one of center and {key}, expected it in both or neither")
        if length is not None and length <= 0:
            raise conflict((key,), f"found {length:g} along {axis}, expected a number greater than 0")
