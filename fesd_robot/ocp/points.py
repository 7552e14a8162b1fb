"""Points of the robot that targets, costs and constraints speak of, as expressions of the state."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca

from fesd_robot.errors import RobotError
from fesd_robot.robot import Robot, center_of_mass, configuration_derivative, frame_placement, frame_velocity
from fesd_robot.task import AXES, COST_TERMS, BodyPoint, DistanceConstraint, Task

__all__ = ["AXES", "Points", "points_of"]


@dataclass(frozen=True)
class Points:
    """Positions, m, and velocities, m/s, in world axes, SX (3) in q (n_q) and v (n_v)."""

    task: Task
    robot: Robot
    q: ca.SX
    v: ca.SX

    def frame(self, name: str) -> tuple[ca.SX, ca.SX]:
        """Return position and velocity of a frame's origin."""
        _, position = frame_placement(self.robot, self.q, name)
        linear, _ = frame_velocity(self.robot, self.q, self.v, name)
        return ca.densify(position), ca.densify(linear)

    def fixed_to(self, point: BodyPoint) -> ca.SX:
        """Return the position of a point fixed to a frame, p + R offset."""
        rotation, position = frame_placement(self.robot, self.q, point.frame)
        return ca.densify(position + rotation @ ca.sparsify(ca.SX(ca.DM(list(point.offset)))))

    def center_of_mass(self, key: tuple[str, ...]) -> tuple[ca.SX, ca.SX]:
        """Return position and velocity of the centre of mass, c and dc/dq dq/dt.

        Raises:
            TaskError: at `key`, if nothing that moves has mass.
        """
        try:
            position = ca.densify(center_of_mass(self.robot, self.q))
        except RobotError as error:
            raise self.task.error(key, str(error)) from error
        rate = configuration_derivative(self.robot, self.q, self.v)
        return position, ca.densify(ca.jacobian(position, self.q) @ rate)


def points_of(task: Task, robot: Robot, q: ca.SX, v: ca.SX) -> Points:
    """Return the points of a robot at the symbols q and v.

    Raises:
        TaskError: a frame that the task names stands for several at different places.
    """
    for key, frame in _frames(task):
        try:
            robot.frame_id(frame)
        except RobotError as error:
            raise task.error(key, str(error)) from error
    return Points(task, robot, q, v)


def _frames(task: Task) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield (key path, frame) of every frame in targets, costs and constraints."""
    yield from ((("goal", "frames", frame), frame) for frame in task.goal.frames)
    for i, waypoint in enumerate(task.waypoints):
        yield from ((("waypoints", str(i), "frames", frame), frame) for frame in waypoint.frames)
    for key, term in COST_TERMS.items():
        if term.names == "frame":
            yield from ((("costs", key, frame), frame) for frame in getattr(task.costs, key))
    for name, constraint in task.constraints.items():
        if isinstance(constraint, BodyPoint):
            yield ("constraints", name, "frame"), constraint.frame
        elif isinstance(constraint, DistanceConstraint):
            yield from ((("constraints", name, *key), body) for key, body in constraint.body_names.items())
