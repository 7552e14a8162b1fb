"""The robot of a task: its model, how it moves, what drives it."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, WithJsonSchema, model_validator

from fesd_robot.errors import ExpressionError
from fesd_robot.task.expression import expression_names
from fesd_robot.task.fields import (
    Name,
    NonNegative,
    Number,
    PlainName,
    Positive,
    Reserved,
    Section,
    Values,
    conflict,
    expected,
    is_number,
)

EXAMPLE_ROBOT_PREFIX = "example-robot-data:"
"""Start of a `robot.model` that names a robot of the package example-robot-data instead of a file."""

PACKAGE_PREFIX = "package://"
"""Start of a `robot.model` that names a file in a folder of the name of a ROS package."""


def check_model(value: str) -> str:
    """Return the address of a model file as it is, if it is one at all."""
    if not value.strip() or not value.removeprefix(EXAMPLE_ROBOT_PREFIX).strip():
        raise expected(f"a path relative to the task file, {PACKAGE_PREFIX}NAME/PATH, or {EXAMPLE_ROBOT_PREFIX}NAME")
    return value


def _check_force(value: Any) -> Any:
    if is_number(value) and not math.isinf(value):
        return float(value)
    if not isinstance(value, str):
        raise expected("a finite number or an expression in text")
    try:
        expression_names(value)
    except ExpressionError as error:
        raise expected(f"an arithmetic expression in configuration names, but {error}") from error
    return value


Force = Annotated[str | float, BeforeValidator(_check_force), WithJsonSchema({"type": ["number", "string"]})]
"""A number, or an arithmetic expression in configuration names, see `fesd_robot.task.expression`."""


def _kind_of_friction(value: Any) -> str:
    return "none" if value is False else "limits"


DryFriction = Annotated[
    Annotated[Literal[False], Tag("none")] | Annotated[dict[Name, NonNegative], Tag("limits")],
    Discriminator(_kind_of_friction),
]
"""Limits of the dry friction of joints that replace those of the model, or False for no dry friction at all."""


_RESERVE = "Part of its limits that it leaves unused; default: reserve.effort."


class JointActuator(Section):
    """A torque or force on one joint."""

    type: Literal["joint"] = Field(description="One joint is driven directly.")
    joint: Name = Field(description="Name of the driven joint.")
    lower: Number | None = Field(
        default=None, description="Smallest torque, N m, or force, N; default: minus the model's effort limit."
    )
    upper: Number | None = Field(
        default=None, description="Largest torque, N m, or force, N; default: the model's effort limit."
    )
    reserve: Reserved | None = Field(default=None, description=_RESERVE)

    @model_validator(mode="after")
    def _ordered(self) -> JointActuator:
        _check_order(self.lower, self.upper)
        return self


class GeneralizedForceActuator(Section):
    """A force that acts on several velocity coordinates at once."""

    type: Literal["generalized_force"] = Field(description="Several velocity coordinates are driven by one control.")
    force: dict[Name, Force] = Field(
        min_length=1,
        description="Name of a velocity coordinate -> generalized force on it per unit of the control: a number, or an "
        "expression in configuration names (m, rad) with + - * / **, pi, sin, cos, tan, sqrt and exp.",
    )
    lower: Number = Field(description="Smallest value of the control, in its own unit (N or N m).")
    upper: Number = Field(description="Largest value of the control, in its own unit (N or N m).")
    reserve: Reserved | None = Field(default=None, description=_RESERVE)

    @model_validator(mode="after")
    def _ordered(self) -> GeneralizedForceActuator:
        _check_order(self.lower, self.upper)
        return self


Actuator = Annotated[JointActuator | GeneralizedForceActuator, Field(discriminator="type")]


def _check_sets(sets: dict[str, list[str]]) -> dict[str, list[str]]:
    if len(sets) < 2:
        raise expected("two sets of controls at least, of which one acts at a time")
    return sets


Sets = Annotated[
    dict[PlainName, Annotated[list[Name], Field(min_length=1)]],
    AfterValidator(_check_sets),
    WithJsonSchema(
        {
            "type": "object",
            "propertyNames": {"pattern": "^[A-Za-z][A-Za-z0-9_]*$"},
            "additionalProperties": {"type": "array", "items": {"type": "string", "minLength": 1}, "minItems": 1},
            "minProperties": 2,
        }
    ),
]
"""Name of a set -> its controls."""


def _check_order(lower: float | None, upper: float | None) -> None:
    if lower is not None and upper is not None and not lower < upper:
        raise conflict(("lower",), f"found lower {lower:g} and upper {upper:g}, expected lower < upper")


class Scale(Section):
    """Factors on masses and lengths of the robot's model."""

    mass: Positive = Field(default=1.0, description="Factor on all masses, with their inertias.")
    length: Positive = Field(
        default=1.0,
        description="Factor on all lengths: of links, of their shapes, of the distances of frames and centres of mass; "
        "masses stay, inertias grow with its square. Ranges of joints and what the task gives in m stay, too.",
    )
    link_mass: dict[Name, Positive] = Field(
        default_factory=dict,
        description="Name of a link -> further factor on the mass of the body that it belongs to, with its inertia.",
    )
    link_length: dict[Name, Positive] = Field(
        default_factory=dict, description="Name of a link -> further factor on the lengths of that body."
    )


class Robot(Section):
    """The robot: where its model is, how its root moves, which joints move and which are driven."""

    model: Annotated[str, AfterValidator(check_model)] = Field(
        description="The model file (URDF, MJCF or SDF): its path relative to the task file, "
        f"{PACKAGE_PREFIX}NAME/PATH for a file in a folder NAME that lies in the task's folder, above it, or where ROS "
        f"looks for packages, or {EXAMPLE_ROBOT_PREFIX}NAME for a robot of that package (fesd-robot robots lists them)."
    )
    root: Literal["fixed", "sagittal", "planar", "free_flyer"] = Field(
        default="fixed",
        description="How the model's root link moves: not at all beyond the joints in the file (fixed); in the "
        "vertical x-z plane, as a robot on a boom that can neither roll nor turn nor step sideways, by root_x, m, "
        "root_z, m, and root_pitch, rad about +y, nose down (sagittal); in the x-y plane, turning about z, as "
        "Pinocchio's planar joint does (planar); or freely (free_flyer).",
    )
    scale: Scale = Field(default_factory=Scale, description="Factors on masses and lengths of the model; default: 1.")
    locked: Values = Field(
        default_factory=dict,
        description="Name of a joint -> value it is held at, rad or m; it is no coordinate then. Default: none.",
    )
    coupled: dict[Name, Name] = Field(
        default_factory=dict,
        description="Name of a joint -> name of the joint it moves with, for legs that move in unison: both must be "
        "on one body and turn about the same line or slide in the same direction. The first is no coordinate then; the "
        "second stands for both, with the sum of their efforts, and one contact under it for both feet, with the sum "
        "of their forces. Default: none.",
    )
    armature: dict[Name, NonNegative] = Field(
        default_factory=dict,
        description="Name of a joint -> inertia added to its diagonal entry of the mass matrix, kg or kg m2; "
        "default: the model's.",
    )
    damping: dict[Name, NonNegative] = Field(
        default_factory=dict,
        description="Name of a joint -> viscous damping d of the force -d v, N s/m or N m s/rad; default: the model's.",
    )
    dry_friction: DryFriction = Field(
        default_factory=dict,
        description="Name of a joint -> limit F of its dry friction -F sgn(v), in [-F, F] where the joint does not "
        "move, N or N m; default: the model's. 'false' leaves all dry friction of joints out.",
    )
    actuators: dict[Name, Actuator] | None = Field(
        default=None,
        description="Name of a control -> the joint or coordinates that it drives; default: every joint with an effort "
        "limit, in the model or in limits.effort, is driven by a control named like the joint, unless it is listed in "
        "robot.passive.",
    )
    passive: list[Name] = Field(
        default_factory=list,
        description="Names of joints that nothing drives although they have an effort limit; only without "
        "'actuators', which name all that is driven. Default: none.",
    )

    one_at_a_time: dict[PlainName, Sets] = Field(
        default_factory=dict,
        description="Name of a group -> name of a set -> its controls, whose lower limits are 0: at any time those of "
        "at most one set of the group are not 0, as of a tool that can only be in one place. Default: none.",
    )

    @model_validator(mode="after")
    def _in_one_set(self) -> Robot:
        seen: dict[str, str] = {}
        for group, sets in self.one_at_a_time.items():
            for name, controls in sets.items():
                for i, control in enumerate(controls):
                    first = seen.setdefault(control, f"{group}.{name}")
                    if first != f"{group}.{name}" or control in controls[:i]:
                        raise conflict(
                            ("one_at_a_time", group, name, str(i)),
                            f"found control '{control}', which is in '{first}' already, expected another one",
                        )
        return self

    @model_validator(mode="after")
    def _distinct(self) -> Robot:
        driven: dict[str, str] = {}
        for name, actuator in (self.actuators or {}).items():
            if name == "time":
                raise conflict(("actuators", name), "an actuator cannot be called 'time', choose another name")
            if isinstance(actuator, JointActuator):
                first = driven.setdefault(actuator.joint, name)
                if first != name:
                    raise conflict(
                        ("actuators", name, "joint"),
                        f"found joint '{actuator.joint}', which actuator '{first}' drives already, expected another "
                        "joint",
                    )
        return self

    @model_validator(mode="after")
    def _consistent(self) -> Robot:
        if self.passive and self.actuators is not None:
            raise conflict(
                ("passive",),
                "found 'passive' beside 'actuators', expected one of them: what no actuator drives is passive",
            )
        for name, leader in self.coupled.items():
            if leader == name:
                raise conflict(("coupled", name), f"found joint '{name}' coupled to itself, expected another joint")
            for held in (name, leader):
                if held in self.locked:
                    raise conflict(("coupled", name), f"found joint '{held}', which is locked, expected one that moves")
        return self
