"""Contacts between two bodies, completed: sizes that the bodies of the task have, and in space where they face."""

from __future__ import annotations

from typing import Any, get_args

import casadi as ca
import numpy as np
import pinocchio as pin

from fesd_robot.contact import Facing, axes_about, needs_space
from fesd_robot.ocp.scene import scene_of
from fesd_robot.ocp.standing import posture_of
from fesd_robot.ocp.vectors import initial_configuration, with_values
from fesd_robot.robot import Robot
from fesd_robot.task import BallBody, BoxBody, CircleBoxContact, CircleCircleContact, CylinderBody, Task, TwoBodyContact


def with_two_bodies(task: Task, robot: Robot) -> Task:
    """Return the task in which contacts between two bodies have their sizes, and in space the axis that they face.

    Args:
        task: with its contacts in their places.
        robot: of the task, with frames there.

    Raises:
        TaskError: a size that is missing, or one with too few or too many lengths, or an axis in the plane.
    """
    pairs = {name: one for name, one in task.contacts.items() if isinstance(one, TwoBodyContact)}
    if not pairs:
        return task
    task = _updated(task, {name: _sized(task, name, one) for name, one in pairs.items()})
    q = ca.SX.sym("q", len(robot.configuration_names))
    in_space = needs_space(robot, q, scene_of(task).geometries)
    task = _updated(task, {name: _of_dimension(task, name, in_space) for name in pairs})
    if not in_space:
        return task
    data, start = robot.model.createData(), _start(task, robot)
    pin.framesForwardKinematics(robot.model, data, start)
    return _updated(task, {name: {"facing": _facing(task, robot, data, name)} for name in pairs})


def _updated(task: Task, updates: dict[str, dict[str, Any]]) -> Task:
    contacts = {name: one.model_copy(update=updates.get(name, {})) for name, one in task.contacts.items()}
    return task.model_copy(update={"contacts": contacts})


def _sized(task: Task, name: str, contact: TwoBodyContact) -> dict[str, Any]:
    """Return the size of the other body where the contact does not say it."""
    body = task.bodies.get(contact.other_frame)
    if isinstance(contact, CircleCircleContact) and contact.other_radius is None:
        if isinstance(body, BallBody) or (isinstance(body, CylinderBody) and body.axis == "y"):
            return {"other_radius": body.radius}
        raise task.error(
            ("contacts", name, "other_radius"),
            f"found no radius of the second circle, and '{contact.other_frame}' is no body of type ball, expected one "
            "(m)",
        )
    if isinstance(contact, CircleBoxContact) and contact.other_size is None:
        if isinstance(body, BoxBody):
            return {"other_size": body.size}
        raise task.error(
            ("contacts", name, "other_size"),
            f"found no lengths of the box, and '{contact.other_frame}' is no body of type box, expected some (m)",
        )
    return {}


def _of_dimension(task: Task, name: str, in_space: bool) -> dict[str, Any]:
    """Check what a contact says against the motion in the plane or in space; a body's box in the plane has two sides.

    A cylinder is a circle in the plane only.
    """
    contact, where = task.contacts[name], "in space" if in_space else "in the plane"
    assert isinstance(contact, TwoBodyContact)
    if contact.facing is not None and not in_space:
        raise task.error(
            ("contacts", name, "facing"),
            "found an axis that a contact in the plane faces, which has one tangent only, expected no such key",
        )
    if isinstance(contact, CircleCircleContact):
        if in_space and isinstance(task.bodies.get(contact.other_frame), CylinderBody):
            raise task.error(
                ("contacts", name, "other_frame"),
                f"found the cylinder '{contact.other_frame}' in space, where circles are balls, expected a body of "
                "type ball",
            )
        return {}
    assert isinstance(contact, CircleBoxContact) and contact.other_size is not None
    lengths, body = contact.other_size, task.bodies.get(contact.other_frame)
    if not in_space and isinstance(body, BoxBody) and lengths == body.size:
        return {"other_size": (lengths[0], lengths[2])}
    wanted = 3 if in_space else 2
    if len(lengths) != wanted:
        axes = "x, y and z" if in_space else "x and z"
        raise task.error(
            ("contacts", name, "other_size"),
            f"found {len(lengths)} lengths of a box {where}, expected {wanted}, along {axes} of its frame (m)",
        )
    return {}


def _facing(task: Task, robot: Robot, data: pin.Data, name: str) -> Facing:
    """Return the axis of the world that is nearest to a contact's normal."""
    contact = task.contacts[name]
    assert isinstance(contact, TwoBodyContact)
    if contact.facing is not None:
        return contact.facing
    other = data.oMf[robot.frame_id(contact.other_frame)]
    own = other.actInv(data.oMf[robot.frame_id(contact.frame)].translation)
    half = np.array(contact.other_size) / 2 if isinstance(contact, CircleBoxContact) else np.zeros(3)
    away = own - np.clip(own, -half, half)
    normal = other.rotation @ (away if away.any() else own)
    return max(get_args(Facing), key=lambda axis: float(axes_about(axis)[:, 0] @ normal))


def _start(task: Task, robot: Robot) -> np.ndarray:
    """Return the configuration at the start, as far as postures and values say it."""
    posture = posture_of(task, robot, task.initial.posture)
    return with_values(robot, {**posture, **task.initial.configuration}, initial_configuration(task, robot))
