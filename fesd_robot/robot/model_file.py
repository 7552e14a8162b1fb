"""Content of a model file beyond Pinocchio's model: springs, motors of several joints, postures and shapes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
import pinocchio as pin

from fesd_robot.robot.followers import Follower, LimitNotes

Format = Literal["urdf", "mjcf", "sdf", "task"]
"""How a file is written; a task may also say what a simple body is."""


@dataclass(frozen=True)
class Spring:
    """A spring on a joint with one degree of freedom, with the force -k (q - rest).

    Attributes:
        stiffness: k, N/m or N m/rad.
        rest: position without force, m or rad.
    """

    stiffness: float
    rest: float

    def and_follower(self, other: Spring, ratio: float, offset: float = 0.0) -> Spring:
        """Return both as one, where the other is on a joint at ``ratio`` times this one's position plus ``offset``."""
        added = ratio**2 * other.stiffness
        moment = self.stiffness * self.rest + ratio * other.stiffness * (other.rest - offset)
        return Spring(self.stiffness + added, moment / (self.stiffness + added))


@dataclass(frozen=True)
class MultiJointMotor:
    """A motor that pushes several joints at once, with a force between bounds.

    Attributes:
        force: name of a joint -> generalized force on it per unit of the control.
        lower, upper: bounds of the control.
    """

    force: Mapping[str, float]
    lower: float
    upper: float


@dataclass(frozen=True)
class Shape:
    """A shape that is fixed to a body.

    Attributes:
        name: of the shape, or its number if it has none.
        body: name of the body's frame.
        placement: on that frame.
        geometry: sphere, capsule, box, cylinder, ellipsoid or mesh of coal.
        color: red, green, blue and opacity, 0 ... 1, (4).
        touches: whether the file lets it collide.
        visible: whether it is drawn.
        friction: coefficient of Coulomb friction in the file, None without one.
    """

    name: str
    body: str
    placement: pin.SE3 = field(repr=False)
    geometry: Any = field(repr=False)
    color: np.ndarray = field(repr=False)
    touches: bool
    visible: bool
    friction: float | None = None


@dataclass(frozen=True)
class ModelFile:
    """A model file as it was read, before joints are locked or coupled.

    Attributes:
        model: Pinocchio's model, with gravity, damping, armature, dry friction and limits.
        format: how the file is written.
        notes: what the equations of motion leave out, one sentence each.
        warnings: likely mistakes in the file, one sentence each.
        composites: name of a composite joint -> names of the joints it is made of.
        springs: name of a joint -> its spring.
        drives: name of a motor that pushes several joints -> how.
        postures: name -> configuration coordinate -> value, m or rad.
        shapes: of all bodies, None where Pinocchio reads them from the file.
        limit_notes: limits that are not those of their joint in the file.
        lengths: name of a link whose lengths are not those of the file -> factor on them.
    """

    model: pin.Model
    format: Format
    notes: Sequence[str] = ()
    warnings: Sequence[str] = ()
    composites: Mapping[str, Sequence[str]] = field(default_factory=dict)
    springs: Mapping[str, Spring] = field(default_factory=dict)
    drives: Mapping[str, MultiJointMotor] = field(default_factory=dict)
    postures: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    shapes: Sequence[Shape] | None = None
    limit_notes: LimitNotes = field(default_factory=dict)
    lengths: Mapping[str, float] = field(default_factory=dict)

    def reduced(
        self, model: pin.Model, locked: Mapping[str, float], coupled: Mapping[str, str], signs: Mapping[str, float]
    ) -> ModelFile:
        """Return the same for the model in which joints are locked and coupled.

        Args:
            model: the reduced model.
            locked: name of a joint -> value it is held at.
            coupled: name of a joint that follows -> name of the joint it moves in unison with.
            signs: name of a joint that follows -> 1.0, or -1.0 where the axes are opposite.
        """
        gone = {*locked, *coupled}
        springs = {name: spring for name, spring in self.springs.items() if name not in gone}
        for follower, leader in coupled.items():
            if follower in self.springs:
                own = springs.get(leader, Spring(0.0, 0.0))
                springs[leader] = own.and_follower(self.springs[follower], signs[follower])
        held = {
            name: replace(drive, force={joint: value for joint, value in drive.force.items() if joint not in locked})
            for name, drive in self.drives.items()
        }
        drives = on_leaders(held, [Follower(name, leader, signs[name], 0.0) for name, leader in coupled.items()])
        postures = {
            name: {joint: value for joint, value in values.items() if joint not in gone}
            for name, values in self.postures.items()
        }
        limit_notes = {(kind, joint): text for (kind, joint), text in self.limit_notes.items() if joint not in gone}
        return replace(self, model=model, springs=springs, drives=drives, postures=postures, limit_notes=limit_notes)


def on_leaders(drives: Mapping[str, MultiJointMotor], followers: Sequence[Follower]) -> dict[str, MultiJointMotor]:
    """Return motors as they push the leaders of joints, by virtual work; those that push nothing are left out.

    force on the leader = own + ratio * force on the follower
    """
    leaders, found = {one.name: one for one in followers}, {}
    for name, drive in drives.items():
        force: dict[str, float] = {}
        for joint, value in drive.force.items():
            leader, ratio = (leaders[joint].leader, leaders[joint].ratio) if joint in leaders else (joint, 1.0)
            force[leader] = force.get(leader, 0.0) + ratio * value
        if any(force.values()):
            found[name] = replace(drive, force=force)
    return found


def note(sentence: str, names: Sequence[str]) -> list[str]:
    """Return the sentence with the first names in it, nothing if there are none."""
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return [sentence.format(", ".join(names[:3]) + more)] if names else []


def geometry_model(model: pin.Model, shapes: Sequence[Shape]) -> pin.GeometryModel:
    """Return those shapes of a model file that are drawn as Pinocchio's geometry objects on the bodies of a model."""
    result = pin.GeometryModel()
    for number, shape in enumerate(shapes):
        if not shape.visible:
            continue
        frame_id = model.getFrameId(shape.body, pin.FrameType.BODY)
        frame = model.frames[frame_id]
        placed = pin.GeometryObject(
            f"{shape.body} {number} {shape.name}",
            frame.parentJoint,
            frame_id,
            frame.placement * shape.placement,
            shape.geometry,
        )
        placed.meshColor = shape.color
        placed.overrideMaterial = True
        result.addGeometryObject(placed)
    return result


def shapes_of(model: pin.Model, geometry: pin.GeometryModel) -> list[Shape]:
    """Return Pinocchio's collision geometry of a file as shapes on the bodies of a model."""
    return [
        Shape(
            name=one.name,
            body=model.frames[one.parentFrame].name,
            placement=model.frames[one.parentFrame].placement.actInv(one.placement),
            geometry=one.geometry,
            color=np.array(one.meshColor),
            touches=True,
            visible=False,
        )
        for one in geometry.geometryObjects
    ]
