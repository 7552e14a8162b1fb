"""Where on the robot a task's contacts are: offsets become frames, bodies become the places that can touch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin

from fesd_robot.contact import leaves_plane
from fesd_robot.errors import RobotError
from fesd_robot.ocp.scene import surfaces_of
from fesd_robot.ocp.standing import posture_of
from fesd_robot.ocp.vectors import initial_configuration, with_values
from fesd_robot.orientations import layered
from fesd_robot.robot import Outline, Robot, touching_outlines, with_frames
from fesd_robot.task import (
    COST_TERMS,
    GROUND,
    BodyContact,
    CircleContact,
    Configured,
    PlacedContact,
    PointContact,
    SwingClearance,
    Task,
)

_IN_PLANE = 0.5
"""Least part of a direction that is in the x-z plane."""

_PLACED = 10
"""Decimals of a place on a body, m."""


def with_contact_frames(task: Task, robot: Robot) -> Robot:
    """Return the robot with a frame for every contact that is away from the origin of its own."""
    placed = [contact for contact in task.contacts.values() if isinstance(contact, PlacedContact)]
    return with_frames(
        robot, {one.touching_frame: (one.frame, np.array(one.offset)) for one in placed if any(one.offset)}
    )


def with_contact_places(task: Task, robot: Robot) -> Task:
    """Return the task in which contacts of bodies are the points and circles of their shapes, here and in its names.

    Raises:
        TaskError: a body without collision shapes, or with one whose outline is neither points nor circles.
    """
    bodies = {name: one for name, one in task.contacts.items() if isinstance(one, BodyContact)}
    if not bodies:
        return task
    places = {name: _places(task, robot, name, one) for name, one in bodies.items()}
    names = {name: [*places.get(name, [name])] for name in task.contacts}
    contacts = {
        one: contact
        for name, own in task.contacts.items()
        for one, contact in dict(places.get(name, {name: own})).items()
    }
    for name, own in places.items():
        if clashes := sorted(set(own) & (set(task.contacts) - {name})):
            raise task.error(
                ("contacts", clashes[0]), f"found the name of one of the places of '{name}', expected another one"
            )
    return with_names_of_places(task.model_copy(update={"contacts": contacts}), names)


def names_of_places(asked: Task, placed: Task) -> dict[str, list[str]]:
    """Return name of a contact as it was asked for -> names of its places in the task that has them."""
    bodies = [name for name, one in asked.contacts.items() if isinstance(one, BodyContact)]
    found = {name: [name] for name in asked.contacts}
    for name in bodies:
        numbered = [one for one in placed.contacts if one.rpartition("_")[0] == name and one not in asked.contacts]
        found[name] = numbered or [name]
    return found


def with_names_of_places(task: Task, names: Mapping[str, Sequence[str]]) -> Task:
    """Return the task whose costs, constraints, start, goal and waypoints name the places of contacts."""
    costs = task.costs.model_copy(
        update={
            key: {one: weight for name, weight in weights.items() for one in names[name]}
            for key, term in COST_TERMS.items()
            if term.names == "contact" and (weights := getattr(task.costs, key))
        }
    )
    update = {
        "costs": costs,
        "constraints": _constraints(task, names),
        "initial": _standing(task.initial, names),
        "goal": _standing(task.goal, names),
        "waypoints": [_standing(each, names) for each in task.waypoints],
    }
    return task.model_copy(update=update)


def _places(task: Task, robot: Robot, name: str, contact: BodyContact) -> dict[str, PointContact | CircleContact]:
    try:
        shapes = [one for one in robot.collision_shapes if one.body == contact.body]
        if not shapes:
            known = sorted({one.body for one in robot.collision_shapes})
            with_shapes = f"one of {', '.join(known)}, or " if known else ""
            raise RobotError(
                f"found body '{contact.body}' without collision shapes, expected {with_shapes}'frame' with 'offset'"
            )
        q = ca.SX.sym("q", len(robot.configuration_names))
        in_space = leaves_plane(robot, q, contact.body, turning=True)
        pose = _pose(task, robot, contact.body)
        towards = _towards(task, contact.surface, pose.translation)
        outlines = touching_outlines(shapes, pose, towards, in_space=in_space)
    except RobotError as error:
        raise task.error(("contacts", name, "body"), str(error)) from error
    several = len(outlines) > 1
    return {
        f"{name}_{number}" if several else name: _placed(task, contact, outline)
        for number, outline in enumerate(outlines, start=1)
    }


def _placed(task: Task, contact: BodyContact, outline: Outline) -> PointContact | CircleContact:
    friction = contact.friction
    if (
        friction is None
        and contact.stiffness is None
        and contact.surface == GROUND
        and "friction" not in task.ground.model_fields_set
    ):
        friction = outline.friction
    common: dict[str, Any] = {
        "frame": contact.body,
        "offset": tuple(float(value) for value in np.round(outline.place, _PLACED) + 0.0),
        "surface": contact.surface,
        "friction": friction,
        "restitution": contact.restitution,
        "slipping": contact.slipping,
        "reserve": contact.reserve,
        "stiffness": contact.stiffness,
        "damping": contact.damping,
    }
    if outline.radius:
        return CircleContact(type="circle", radius=outline.radius, **common)
    return PointContact(**common)


def _pose(task: Task, robot: Robot, body: str) -> pin.SE3:
    """Return the pose of a body at the start, as far as postures and values say it."""
    posture = posture_of(task, robot, task.initial.posture)
    q = with_values(robot, layered(posture, task.initial.configuration), initial_configuration(task, robot))
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return data.oMf[robot.frame_id(body)]


def _towards(task: Task, surface: str, place: np.ndarray) -> np.ndarray:
    """Return the direction in which a body at a place, m, (3), meets a surface, (3).

    Raises:
        RobotError: it is not in the x-z plane, in which outlines are.
    """
    towards = -surfaces_of(task)[surface].axes(place).normal
    if np.hypot(towards[0], towards[2]) < _IN_PLANE:
        raise RobotError(
            f"found surface '{surface}', which faces along y, expected one that is met in the x-z plane, or the places "
            "that touch by 'frame' and 'offset'"
        )
    return np.asarray(towards)


def _standing(section: Any, names: Mapping[str, Sequence[str]]) -> Configured:
    standing = section.standing
    if standing is None:
        return section
    contacts = [one for name in standing.contacts for one in names[name]]
    return section.model_copy(update={"stand_on": standing.model_copy(update={"contacts": contacts})})


def _constraints(task: Task, names: Mapping[str, Sequence[str]]) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for key, constraint in task.constraints.items():
        if isinstance(constraint, SwingClearance):
            contacts = [one for name in constraint.contacts for one in names[name]]
            result[key] = constraint.model_copy(update={"contacts": contacts})
            continue
        places = names[constraint.contact] if hasattr(constraint, "contact") else [None]
        for number, one in enumerate(places, start=1):
            at = f"{key}_{number}" if len(places) > 1 else key
            result[at] = constraint if one is None else constraint.model_copy(update={"contact": one})
    return result
