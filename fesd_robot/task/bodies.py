"""Free bodies beside the robot: objects that it pushes, carries or kicks, and obstacles that it touches."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, WithJsonSchema, model_validator

from fesd_robot.task.fields import (
    AXES,
    Name,
    NonNegative,
    PlainName,
    Positive,
    Section,
    Values,
    conflict,
    expected,
    is_number,
    kind_of,
)
from fesd_robot.task.robot import DryFriction, check_model

_OWN = {"free_flyer": (), "planar": ("z",), "sagittal": ("y",), "fixed": AXES}
"""Kind of root -> axes along which it does not move, so that the task says where the body is."""

_LENGTHS = "three lengths greater than 0, along x, y and z, m"


def _read_position(value: Any) -> dict[str, float]:
    if not isinstance(value, dict) or not set(value) <= set(AXES):
        raise expected("a mapping of x, y and z to numbers, m")
    if not all(is_number(part) and math.isfinite(part) for part in value.values()):
        raise expected("a mapping of x, y and z to finite numbers, m")
    return {axis: float(part) for axis, part in value.items()}


def _read_lengths(value: Any) -> tuple[float, float, float]:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise expected(_LENGTHS)
    if not all(is_number(one) and 0 < one < math.inf for one in value):
        raise expected(_LENGTHS)
    x, y, z = map(float, value)
    return x, y, z


Position = Annotated[
    dict[str, float],
    BeforeValidator(_read_position),
    WithJsonSchema(
        {
            "type": "object",
            "properties": {axis: {"type": "number", "description": f"Along {axis}, m."} for axis in AXES},
            "additionalProperties": False,
        }
    ),
]
"""Where a body is along the axes along which its root does not move, m."""

Lengths = Annotated[
    tuple[float, float, float],
    BeforeValidator(_read_lengths),
    WithJsonSchema({"type": "array", "items": {"type": "number", "exclusiveMinimum": 0}, "minItems": 3, "maxItems": 3}),
]
"""Lengths of the edges of a box, m."""


class LimitSurface(Section):
    """The friction under a body that slides and turns on a table, bounded by an ellipsoid."""

    force: Positive = Field(description="Largest friction of a body that slides and does not turn, N: mu m g.")
    torque: Positive = Field(
        description="Largest friction of a body that turns about its middle, N m: that force times a length, as the "
        "mean distance of its base from its middle, 0.38 times the edge of a square one."
    )


class _Body(Section):
    """Keys of every body."""

    root: Literal["fixed", "sagittal", "planar", "free_flyer"] = Field(
        description="How the body moves, as for robots: in the x-z plane by NAME.root_x, NAME.root_z and "
        "NAME.root_pitch (sagittal), in the x-y plane as Pinocchio's planar joint does (planar), freely (free_flyer), "
        "or not at all beyond the joints of its file (fixed)."
    )
    position: Position = Field(
        default_factory=dict,
        description="Where the body is along the axes along which its root does not move, m: y of a sagittal one, z of "
        "a planar one, all three of a fixed one. Default: 0.",
    )
    damping: dict[Name, NonNegative] = Field(
        default_factory=dict,
        description="Name of a joint of the body -> viscous damping d of the force -d v, N s/m or N m s/rad; default: "
        "the model's.",
    )
    dry_friction: DryFriction = Field(
        default_factory=dict,
        description="Name of a joint of the body -> limit F of its dry friction, N or N m; default: the model's. "
        "'false' leaves all of it out.",
    )
    limit_surface: LimitSurface | None = Field(
        default=None,
        description="Friction of a table under a body with a sagittal or planar root, which no contact stands for: its "
        "force and its torque, divided by the largest ones, keep to the unit ball and take as much power as they can. "
        "Default: none.",
    )

    @model_validator(mode="after")
    def _on_a_table(self) -> _Body:
        if self.limit_surface is None:
            return self
        if self.root not in ("sagittal", "planar"):
            raise conflict(
                ("limit_surface",),
                f"found a limit surface under a body with a root '{self.root}', expected 'sagittal' or 'planar'",
            )
        twice = [name for name in self.dry_friction or () if name.startswith("root_")]
        if twice:
            raise conflict(
                ("dry_friction", twice[0]),
                f"found dry friction of '{twice[0]}' beside a limit surface, which has it, expected one of them",
            )
        return self

    @model_validator(mode="after")
    def _placed(self) -> _Body:
        for axis in self.position:
            if axis not in _OWN[self.root]:
                own = ", ".join(_OWN[self.root])
                raise conflict(
                    ("position", axis),
                    f"found a position along {axis}, along which a {self.root} root moves, expected "
                    + (f"one along {own} only, and the rest in initial.configuration" if own else "no such key")
                    + ("" if own else ": initial.configuration says where the body starts"),
                )
        return self


class ModelBody(_Body):
    """A body, or several with joints between them, from a model file."""

    type: Literal["model"] = Field(default="model", description="Shape of the body: that of a model file.")
    model: Annotated[str, AfterValidator(check_model)] = Field(
        description="The model file (URDF, MJCF or SDF), named as that of the robot."
    )
    locked: Values = Field(
        default_factory=dict,
        description="Name of a joint of the body -> value it is held at, rad or m. Default: none.",
    )
    armature: dict[Name, NonNegative] = Field(
        default_factory=dict,
        description="Name of a joint of the body -> inertia added to its diagonal entry of the mass matrix, kg or "
        "kg m2; default: the model's.",
    )

    def in_words(self) -> str:
        """Return where its model is."""
        return f"from {self.model}"


class SimpleBody(_Body):
    """A solid body of one shape, about whose middle its frame lies."""

    mass: Positive | None = Field(
        default=None, description="Mass of the body, kg, the same everywhere in it; a fixed one has none."
    )

    @model_validator(mode="after")
    def _weighed(self) -> SimpleBody:
        if self.mass is None and self.root != "fixed":
            raise conflict(("mass",), "found no mass of a body that moves, expected one greater than 0 (kg)")
        if self.mass is not None and self.root == "fixed":
            raise conflict(("mass",), "found the mass of a fixed body, which does not matter, expected no such key")
        return self


class BoxBody(SimpleBody):
    """A box."""

    type: Literal["box"] = Field(description="Shape of the body.")
    size: Lengths = Field(strict=False, description="Lengths of its edges along x, y and z of its frame, m.")

    def in_words(self) -> str:
        """Return its size."""
        return f"a box of {' x '.join(f'{length:g}' for length in self.size)} m"


class BallBody(SimpleBody):
    """A ball."""

    type: Literal["ball"] = Field(description="Shape of the body.")
    radius: Positive = Field(description="Radius of the ball, m.")

    def in_words(self) -> str:
        """Return its size."""
        return f"a ball of {self.radius:g} m"


class CylinderBody(SimpleBody):
    """A cylinder."""

    type: Literal["cylinder"] = Field(description="Shape of the body.")
    radius: Positive = Field(description="Radius of the cylinder, m.")
    length: Positive = Field(description="Length of the cylinder along its axis, m.")
    axis: Literal["x", "y", "z"] = Field(
        default="z", description="Axis of its frame along which it lies; a disc that rolls in the x-z plane has y."
    )

    def in_words(self) -> str:
        """Return its size."""
        return f"a cylinder of radius {self.radius:g} m and length {self.length:g} m"


Body = Annotated[
    Annotated[ModelBody, Tag("model")]
    | Annotated[BoxBody, Tag("box")]
    | Annotated[BallBody, Tag("ball")]
    | Annotated[CylinderBody, Tag("cylinder")],
    Discriminator(kind_of("model")),
]
"""A body beside the robot."""


BodyName = PlainName
"""Name of a body, which stands in front of the names of its joints, coordinates and frames."""
