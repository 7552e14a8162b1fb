"""Pages of a robot that stands still: a task before it is planned, and what is in a model."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from functools import singledispatch
from pathlib import Path

import coal
import numpy as np
import pinocchio as pin

from fesd_robot.contact import Plane
from fesd_robot.ocp import MotionProblem
from fesd_robot.plans import obstacle_geometry
from fesd_robot.render.animation import local_corners
from fesd_robot.render.marks import Mark, dot
from fesd_robot.render.outputs import circle_visuals, ground_visual
from fesd_robot.render.page import PageContent, render_page
from fesd_robot.render.palette import GREEN, ORANGE, PURPLE, VERMILION, series_color
from fesd_robot.render.terrain import GroundVisual
from fesd_robot.robot import Robot
from fesd_robot.task import (
    AvoidBox,
    AvoidEllipse,
    AvoidSphere,
    CircleContact,
    Constraint,
    ForbiddenZone,
    ObstacleDistance,
)

ENDLESS = 2.0
"""Length of what has no end, over the size of the robot."""

THIN = 0.01
"""Thickness of what lies on the ground, over the size of the robot."""


def write_task_page(motion: MotionProblem, path: str | os.PathLike[str]) -> Path:
    """Write a page of a task before it is planned.

    It shows the robot at the start, at the goal as a ghost, ground and walls, the places that touch with their radii,
    frames, collision shapes, obstacles of constraints and positions that the goal asks for.

    Args:
        motion: the task, formulated.
        path: the HTML file to write.

    Raises:
        RobotError: the shapes of the robot cannot be read.
    """
    task, robot, ends = motion.task, motion.robot, motion.endpoints
    q, size = ends.initial_configuration, _size(robot, ends.initial_configuration)
    goal = None if task.goal.periodic is not None or task.goal.has_points else ends.goal_configuration
    marks = [
        *_contacts(motion, q, size),
        *_shapes(robot, q),
        *_obstacles(motion, size),
        *_targets(motion, size),
        *_frames(robot, q, "frames", None),
    ]
    return render_page(
        path,
        PageContent(
            title=task.name,
            subtitle="The task before it is planned.",
            facts=[("start", "the robot"), *([("goal", "its ghost")] if goal is not None else [])],
            model=robot.model,
            visual_model=robot.visual_model,
            time=np.zeros(1),
            configuration=q[None, :],
            ghost=goal,
            ground=ground_visual(task),
            traces={},
            circles=circle_visuals(task, robot),
            marks=marks,
        ),
    )


def write_robot_page(robot: Robot, path: str | os.PathLike[str]) -> Path:
    """Write a page of what a model has: joints, bodies, other frames and collision shapes, with every joint at zero.

    Args:
        robot: with any root.
        path: the HTML file to write.

    Raises:
        RobotError: the shapes of the robot cannot be read.
    """
    q = robot.neutral
    joints, bodies = pin.FrameType.JOINT, pin.FrameType.BODY
    marks = [
        *_frames(robot, q, "joints", [joints]),
        *_frames(robot, q, "bodies", [bodies]),
        *_frames(robot, q, "other frames", [pin.FrameType.OP_FRAME, pin.FrameType.FIXED_JOINT, pin.FrameType.SENSOR]),
        *_shapes(robot, q),
    ]
    return render_page(
        path,
        PageContent(
            title=robot.name,
            subtitle="Every joint at zero.",
            facts=[("degrees of freedom", str(robot.model.nv)), ("file", robot.source.name)],
            model=robot.model,
            visual_model=robot.visual_model,
            time=np.zeros(1),
            configuration=q[None, :],
            ground=GroundVisual(Plane(_lowest(robot, q))),
            traces={},
            marks=marks,
            planar=False,
        ),
    )


def _contacts(motion: MotionProblem, q: np.ndarray, size: float) -> Iterator[Mark]:
    """Yield the places that touch; circles are drawn by the page, in the same colours."""
    data = _placed(motion.robot, q)
    for number, (name, contact) in enumerate(motion.task.single_contacts.items()):
        pose = data.oMf[motion.robot.frame_id(contact.touching_frame)]
        radius = getattr(contact, "radius", None)
        text = name if radius is None else f"{name}, {radius:g} m"
        shape = coal.Sphere(radius) if isinstance(contact, CircleContact) else dot(size)
        opacity = 0.2 if isinstance(contact, CircleContact) else 1.0
        yield Mark("contacts", text, pose, shape, series_color(number), opacity)


def _shapes(robot: Robot, q: np.ndarray) -> Iterator[Mark]:
    data = _placed(robot, q)
    for shape in robot.collision_shapes:
        pose = data.oMf[robot.frame_id(shape.body)] * shape.placement
        yield Mark("collision shapes", shape.name, pose, shape.geometry, PURPLE, 0.35)


def _frames(robot: Robot, q: np.ndarray, group: str, kinds: Collection[pin.FrameType] | None) -> list[Mark]:
    """Return the axes of frames, of several at the same place once, with all names."""
    data, names, poses = _placed(robot, q), dict[bytes, list[str]](), dict[bytes, pin.SE3]()
    for index, frame in list(enumerate(robot.model.frames))[1:]:
        if kinds is None or frame.type in kinds:
            place = np.round(data.oMf[index].homogeneous, 6).tobytes()
            names.setdefault(place, []).append(frame.name)
            poses[place] = data.oMf[index]
    return [Mark(group, ", ".join(dict.fromkeys(names[place])), pose) for place, pose in poses.items()]


def _obstacles(motion: MotionProblem, size: float) -> Iterator[Mark]:
    for name, constraint in motion.task.constraints.items():
        if isinstance(constraint, ForbiddenZone):
            yield _zone(name, constraint, ground_visual(motion.task), size)
            continue
        found = drawn(constraint, size)
        if found is not None:
            pose, shape = found
            yield Mark("obstacles", name, pose, shape, VERMILION, 0.4)


@singledispatch
def drawn(constraint: Constraint, size: float) -> tuple[pin.SE3, coal.CollisionGeometry] | None:
    """Return place and shape of the body that a constraint keeps free, None if there is none.

    Args:
        size: of the robot, m.
    """
    return None


@drawn.register
def _sphere(constraint: AvoidSphere, size: float) -> tuple[pin.SE3, coal.CollisionGeometry]:
    return _round(constraint.center, (constraint.radius,) * 3, size)


@drawn.register
def _ellipse(constraint: AvoidEllipse, size: float) -> tuple[pin.SE3, coal.CollisionGeometry]:
    return _round(constraint.center, constraint.semi_axes, size)


@drawn.register
def _box(constraint: AvoidBox, size: float) -> tuple[pin.SE3, coal.CollisionGeometry]:
    edges = [ENDLESS * size if edge is None else edge for edge in constraint.size]
    return _at(constraint.center), coal.Box(*edges)


@drawn.register
def _obstacle(constraint: ObstacleDistance, size: float) -> tuple[pin.SE3, coal.CollisionGeometry]:
    return obstacle_geometry(constraint.obstacle)


def _round(
    center: tuple[float | None, ...], half_axes: tuple[float | None, ...], size: float
) -> tuple[pin.SE3, coal.CollisionGeometry]:
    """Return an ellipsoid, or for an axis along which it has no end something long."""
    half = [ENDLESS * size if middle is None else axis for middle, axis in zip(center, half_axes, strict=True)]
    return _at(center), coal.Ellipsoid(*(float(value or 0.0) for value in half))


def _at(center: tuple[float | None, ...]) -> pin.SE3:
    return pin.SE3(np.eye(3), np.array([0.0 if value is None else value for value in center]))


def _zone(name: str, zone: ForbiddenZone, ground: GroundVisual, size: float) -> Mark:
    """Return a strip on the ground."""
    left = zone.x[0] if np.isfinite(zone.x[0]) else zone.x[1] - ENDLESS * size
    right = zone.x[1] if np.isfinite(zone.x[1]) else zone.x[0] + ENDLESS * size
    middle = (left + right) / 2
    pose = pin.SE3(np.eye(3), np.array([middle, 0.0, ground.elevation(middle)]))
    return Mark("obstacles", name, pose, coal.Box(right - left, size, THIN * size), ORANGE, 0.5)


def _targets(motion: MotionProblem, size: float) -> Iterator[Mark]:
    """Yield the positions that the goal asks for; along an axis that does not matter they are drawn at zero."""
    goal = motion.task.goal
    points = {**goal.frames, **({"center of mass": goal.center_of_mass} if goal.center_of_mass else {})}
    for name, target in points.items():
        if target.position is not None:
            yield Mark("goal positions", name, _at(target.position), dot(1.5 * size), GREEN, 0.9)


def _placed(robot: Robot, q: np.ndarray) -> pin.Data:
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return data


def _size(robot: Robot, q: np.ndarray) -> float:
    """Return the diagonal of the box around all frames, m."""
    places = np.array([pose.translation for pose in _placed(robot, q).oMf])
    return float(np.linalg.norm(np.ptp(places, axis=0))) or 1.0


def _lowest(robot: Robot, q: np.ndarray) -> float:
    """Return the height of the lowest frame or corner of a drawn shape, m."""
    data, shapes = _placed(robot, q), robot.visual_model
    heights = [float(pose.translation[2]) for pose in data.oMf]
    placed = pin.GeometryData(shapes)
    pin.updateGeometryPlacements(robot.model, data, shapes, placed)
    for index, points in local_corners(shapes).items():
        heights += [float(placed.oMg[index].act(corner)[2]) for corner in points]
    return min(heights)
