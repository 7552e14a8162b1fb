"""Distances between bodies, and from a body to an obstacle, as rows of the problem."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError
from fesd_robot.ocp.points import Points
from fesd_robot.robot import (
    BoxShape,
    Placed,
    RoundShape,
    SimpleShape,
    distance_rows,
    enclosing,
    frame_placement,
    kind_of,
    placed,
    shapes_of_body,
    simple_shape,
)
from fesd_robot.task import (
    BodyDistance,
    BoxObstacle,
    CapsuleObstacle,
    DistanceConstraint,
    KeyPath,
    Obstacle,
    ObstacleDistance,
)


class _Part(NamedTuple):
    """A shape of a body or an obstacle: what it is called, what kind it is, its name for rows, and where it is."""

    words: str
    kind: str
    name: str
    shape: SimpleShape
    rotation: ca.SX
    position: ca.SX


def distances_of(name: str, constraint: DistanceConstraint, points: Points) -> list[tuple[str, ca.SX]]:
    """Return a constraint's distances by the names of the shapes, m; where one has several, the least of them counts.

    Raises:
        TaskError: a body has no collision shapes, or some whose distance has no closed form.
    """
    at = ("constraints", name)
    if isinstance(constraint, BodyDistance):
        _check_moving(at, constraint, points)
    sides = [_of_body(at, key, body, constraint, points) for key, body in constraint.body_names.items()]
    if isinstance(constraint, ObstacleDistance):
        sides.append([_of_obstacle(constraint.obstacle)])
    first, second = sides
    return [row for one in first for other in second for row in _between(at, constraint, one, other, points)]


def _check_moving(at: KeyPath, constraint: BodyDistance, points: Points) -> None:
    first, second = constraint.bodies
    frames = points.robot.model.frames
    joints = {frames[points.robot.frame_id(body)].parentJoint for body in constraint.bodies}
    if len(joints) == 1:
        raise points.task.error(
            (*at, "bodies"),
            f"found '{first}' and '{second}', which never move against each other, expected two bodies with a moving "
            "joint between them",
        )


def simple_shapes(points: Points, constraint: DistanceConstraint, body: str) -> list[tuple[str, str, str, SimpleShape]]:
    """Return words, kind, name and shape of everything that stands for a body in a constraint.

    Raises:
        RobotError: the body has no collision shapes, or some whose distance has no closed form.
    """
    result = []
    for shape in shapes_of_body(points.robot.collision_shapes, body):
        words = f"shape '{shape.name}' of body '{body}', a {kind_of(shape)}"
        simple = enclosing(shape) if constraint.shapes == "enclosing" else simple_shape(shape)
        if simple is None:
            raise RobotError(
                f"found {words}, whose distance has no closed form, expected a sphere or a capsule, or a box beside "
                "spheres, or shapes: enclosing, which takes the smallest capsule found around it"
            )
        result.append((words, kind_of(shape), shape.name, simple))
    return result


def _of_body(at: KeyPath, key: KeyPath, body: str, constraint: DistanceConstraint, points: Points) -> list[_Part]:
    try:
        found = simple_shapes(points, constraint, body)
    except RobotError as error:
        raise points.task.error((*at, *key), str(error)) from error
    rotation, position = frame_placement(points.robot, points.q, body)
    return [_Part(*one, rotation, position) for one in found]


def _of_obstacle(obstacle: Obstacle) -> _Part:
    words = f"the obstacle, a {obstacle.type}"
    return _Part(words, obstacle.type, "the obstacle", _obstacle_shape(obstacle), ca.SX(ca.DM.eye(3)), ca.SX(3, 1))


def _obstacle_shape(obstacle: Obstacle) -> SimpleShape:
    """Return an obstacle as a shape in the world."""
    if isinstance(obstacle, BoxObstacle):
        cosine, sine = np.cos(obstacle.pitch), np.sin(obstacle.pitch)
        turn = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
        return BoxShape(pin.SE3(turn, np.array(obstacle.center)), np.array(obstacle.size) / 2)
    ends = obstacle.ends if isinstance(obstacle, CapsuleObstacle) else [obstacle.center, obstacle.center]
    return RoundShape(np.array(ends, dtype=float), obstacle.radius)


def _between(
    at: KeyPath, constraint: DistanceConstraint, first: _Part, second: _Part, points: Points
) -> Iterator[tuple[str, ca.SX]]:
    pairs: Sequence[tuple[SimpleShape, SimpleShape]] = [(first.shape, second.shape)]
    if any(isinstance(one, BoxShape) for one in (first.shape, second.shape)):
        try:
            pairs = _beside_a_box(constraint, first, second)
        except RobotError as error:
            raise points.task.error(at, str(error)) from error
    several = len(pairs) > 1
    for number, (one, other) in enumerate(pairs, start=1):
        rows = list(distance_rows(_placed(one, first), _placed(other, second)))
        for row in rows:
            yield f"{first.name} and {second.name}{f' ({number})' if several else ''}", row


def _beside_a_box(constraint: DistanceConstraint, first: _Part, second: _Part) -> list[tuple[SimpleShape, SimpleShape]]:
    """Return the pairs of spheres and a box that stand for two shapes, one of them a box."""
    (box, other) = (first, second) if isinstance(first.shape, BoxShape) else (second, first)
    if isinstance(other.shape, RoundShape) and (other.shape.length == 0 or constraint.shapes == "enclosing"):
        spheres = other.shape.spheres()
        return [(box.shape, one) if box is first else (one, box.shape) for one in spheres]
    raise RobotError(
        f"found {first.words}, and {second.words}, whose distance has no closed form, expected a sphere beside a box, "
        "spheres and capsules only, or shapes: enclosing, which takes the smallest capsule found around a shape, and a "
        "row of spheres around a capsule beside an obstacle that is a box"
    )


def _placed(shape: SimpleShape, part: _Part) -> Placed:
    return placed(shape, part.rotation, part.position)
