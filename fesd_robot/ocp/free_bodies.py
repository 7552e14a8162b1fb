"""The bodies of a task beside its robot: read from their files, or built of what the task says about them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fesd_robot.errors import JointError, RobotError
from fesd_robot.robot import (
    PLANAR_VELOCITY_NAMES,
    SAGITTAL_NAMES,
    Robot,
    UniformSolid,
    ball,
    beside,
    box,
    cylinder,
    load_robot,
    name_on,
    with_gravity,
    with_joint_properties,
)
from fesd_robot.robot.scaled import ModelScale
from fesd_robot.robot.simple_body import simple_body
from fesd_robot.task import AXES, BallBody, BoxBody, CylinderBody, ModelBody, Task
from fesd_robot.task import Robot as RobotSection

LIMIT_SURFACE = "limit_surface"
"""Name of the limit surface under a body, behind the body's own."""


def with_bodies(task: Task, robot: Robot, *, locked: bool = True, floating: bool = False) -> Robot:
    """Return a task's robot with the task's bodies beside it, without the properties that it gives to their joints.

    All fall with the task's gravity, if it gives one.

    Args:
        task: names bodies with their roots.
        robot: alone.
        locked: whether joints that the task holds are none.
        floating: whether bodies that are not fixed get a free flyer for the root of the task.

    Raises:
        TaskError: a model that cannot be read, a joint that cannot be locked, or a name that the robot has, too.
    """
    bodies = {name: _body(task, name, locked, floating) for name in task.bodies}
    if task.gravity is not None:
        robot = with_gravity(robot, task.gravity)
        bodies = {name: with_gravity(body, task.gravity) for name, body in bodies.items()}
    places = {
        name: np.array([0.0 if floating and body.root != "fixed" else body.position.get(axis, 0.0) for axis in AXES])
        for name, body in task.bodies.items()
    }
    for name in bodies:
        try:
            beside(robot, {name: bodies[name]}, places)
        except RobotError as error:
            raise task.error(("bodies", name), str(error)) from error
    return beside(robot, bodies, places)


def joint_values(task: Task, key: str) -> dict[str, float]:
    """Return a task's values of joints under a key, `armature`, `damping`, `dry_friction` or `locked`, of all bodies.

    Returns:
        name of a joint beside the robot, or of the robot's own -> value.
    """
    values = dict(_said(task.robot, key))
    for name, body in task.bodies.items():
        values |= {name_on(name, joint): value for joint, value in _said(body, key).items()}
    return values


def limit_surfaces_of(task: Task) -> dict[str, dict[str, float]]:
    """Return the limit surfaces under the bodies of a task.

    Returns:
        name -> name of a velocity coordinate -> largest friction along it alone, N or N m: two forces and a torque.
    """
    surfaces = {}
    for name, body in task.bodies.items():
        if body.limit_surface is not None:
            force, torque = body.limit_surface.force, body.limit_surface.torque
            own = SAGITTAL_NAMES if body.root == "sagittal" else PLANAR_VELOCITY_NAMES
            limits = zip(own, (force, force, torque), strict=True)
            surfaces[name_on(name, LIMIT_SURFACE)] = {name_on(name, one): limit for one, limit in limits}
    return surfaces


def _said(section: object, key: str) -> Mapping[str, float]:
    return getattr(section, key, None) or {}


def scale_of(section: RobotSection) -> ModelScale:
    """Return the factors on the model of a task's robot."""
    scale = section.scale
    return ModelScale(scale.mass, scale.length, scale.link_mass, scale.link_length)


def without_dry_friction(section: object, robot: Robot) -> Robot:
    """Return a robot or a body without dry friction of joints where its section of the task says so."""
    if getattr(section, "dry_friction", None) is not False:
        return robot
    return with_joint_properties(robot, armature={}, damping={}, dry_friction=False)


def _body(task: Task, name: str, locked: bool, floating: bool) -> Robot:
    section = task.bodies[name]
    root = "free_flyer" if floating and section.root != "fixed" else section.root
    if not isinstance(section, ModelBody):
        assert isinstance(section, BoxBody | BallBody | CylinderBody)
        return simple_body(name, _solid(section), root)
    source: str | Path = task.locate_model(name)
    held = section.locked if locked else {}
    try:
        body = load_robot(source, root=root, locked=held, search_path=task.folder)
    except JointError as error:
        raise task.error(("bodies", name, error.option, error.joint), str(error)) from error
    except RobotError as error:
        raise task.error(("bodies", name, "model"), str(error)) from error
    return without_dry_friction(section, body)


def _solid(section: BoxBody | BallBody | CylinderBody) -> UniformSolid:
    mass = section.mass or 0.0
    if isinstance(section, BoxBody):
        return box(section.size, mass)
    if isinstance(section, BallBody):
        return ball(section.radius, mass)
    return cylinder(section.radius, section.length, section.axis, mass)
