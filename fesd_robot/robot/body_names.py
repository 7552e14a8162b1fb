"""Names and shapes of a body beside a robot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import pinocchio as pin

from fesd_robot.robot.model_file import Shape

if TYPE_CHECKING:
    from fesd_robot.robot.robot import Robot

SEPARATOR = "."
"""Between the name of a body and that of what belongs to it."""


def name_on(body: str, name: str) -> str:
    """Return the name of a body's joint, coordinate or frame beside a robot."""
    return f"{body}{SEPARATOR}{name}"


def frame_on(body: str, model: pin.Model, index: int) -> str:
    """Return the name of a frame of a body's model beside a robot: its first link has the body's name alone."""
    first = next((i for i, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY), None)
    return body if index == first else name_on(body, model.frames[index].name)


def shapes_on(body: str, part: Robot) -> Iterator[Shape]:
    """Yield the collision shapes of a body under their names beside a robot.

    Raises:
        RobotError: if a mesh is missing or unreadable.
    """
    for shape in part.collision_shapes:
        on = frame_on(body, part.model, part.frame_id(shape.body))
        yield replace(shape, body=on, name=name_on(body, shape.name))


def visuals_on(body: str, part: Robot, model: pin.Model) -> Iterator[pin.GeometryObject]:
    """Yield the visuals of a body, on the joints of the model that has it beside a robot.

    Raises:
        RobotError: if a mesh is missing or unreadable.
    """
    for drawn in part.visual_model.geometryObjects:
        copied, own = drawn.copy(), part.model
        copied.name = name_on(body, drawn.name)
        if drawn.parentJoint:
            copied.parentJoint = model.getJointId(name_on(body, own.names[drawn.parentJoint]))
        else:
            frame = model.frames[model.getFrameId(frame_on(body, own, drawn.parentFrame), pin.FrameType.BODY)]
            copied.placement = frame.placement * own.frames[drawn.parentFrame].placement.inverse() * drawn.placement
        copied.parentFrame = model.getFrameId(frame_on(body, own, drawn.parentFrame), pin.FrameType.BODY)
        yield copied
