"""Points of the robot that targets, costs and constraints speak of, as expressions of the state."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from fesd_robot.errors import RobotError
from fesd_robot.robot import Robot, center_of_mass, configuration_derivative, frame_placement, frame_velocity
from fesd_robot.task import BodyPoint, Task

AXES = ("x", "y", "z")


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
