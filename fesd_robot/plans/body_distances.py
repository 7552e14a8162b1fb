"""Distances of collision shapes by coal's algorithms, independent of the planner's expressions."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin

from fesd_robot.robot import Robot, shapes_of_body
from fesd_robot.task import BoxObstacle, CapsuleObstacle, DistanceConstraint, Obstacle, ObstacleDistance


class BodyDistances:
    """The distance that a constraint speaks of: between the collision shapes of its model file, whatever they are.

    Args:
        robot: of the task.
        constraint: of the task.

    Raises:
        RobotError: a body without collision shapes, or the file of a mesh cannot be read.
    """

    def __init__(self, robot: Robot, constraint: DistanceConstraint) -> None:
        self._robot, self._data = robot, robot.model.createData()
        self._sides = [
            [(robot.frame_id(body), one.placement, one.geometry) for one in shapes_of_body(shapes, body)]
            for shapes in [robot.collision_shapes]
            for body in constraint.body_names.values()
        ]
        if isinstance(constraint, ObstacleDistance):
            self._sides.append([(0, *obstacle_geometry(constraint.obstacle))])

    def least(self, q: np.ndarray) -> float:
        """Return the smallest distance of any two shapes, m, negative where they overlap; NaN where q is none.

        Args:
            q: configuration, (n_q).
        """
        if not np.isfinite(q).all():
            return float("nan")
        pin.framesForwardKinematics(self._robot.model, self._data, q)
        first, second = (
            [(shape, _transform(self._data.oMf[frame] * place)) for frame, place, shape in side] for side in self._sides
        )
        request, result, least = coal.DistanceRequest(), coal.DistanceResult(), np.inf
        for one, at in first:
            for other, there in second:
                result.clear()
                least = min(least, coal.distance(one, at, other, there, request, result))
        return float(least)


def obstacle_geometry(obstacle: Obstacle) -> tuple[pin.SE3, coal.CollisionGeometry]:
    """Return an obstacle as a shape of coal, and where it is in the world."""
    if isinstance(obstacle, BoxObstacle):
        turn = pin.utils.rpyToMatrix(0.0, obstacle.pitch, 0.0)
        return pin.SE3(turn, np.array(obstacle.center)), coal.Box(*obstacle.size)
    if isinstance(obstacle, CapsuleObstacle):
        first, second = map(np.array, obstacle.ends)
        turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), second - first).matrix()
        length = float(np.linalg.norm(second - first))
        return pin.SE3(turn, (first + second) / 2), coal.Capsule(obstacle.radius, length)
    return pin.SE3(np.eye(3), np.array(obstacle.center)), coal.Sphere(obstacle.radius)


def _transform(pose: pin.SE3) -> coal.Transform3s:
    return coal.Transform3s(pose.rotation, pose.translation)
