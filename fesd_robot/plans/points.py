"""Where a point of the robot is and how fast it moves, by Pinocchio's numeric algorithms."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from fesd_robot.robot import Robot


def point_motion(robot: Robot, q: np.ndarray, v: np.ndarray, frame: str | None) -> tuple[np.ndarray, np.ndarray]:
    """Return position, m, and velocity, m/s, in world axes, (3,) each, of a frame's origin.

    Args:
        q, v: configuration, (n_q), and velocity, (n_v).
        frame: name of the frame; None for the centre of mass.
    """
    model, data = robot.model, robot.model.createData()
    if frame is None:
        pin.centerOfMass(model, data, q, v)
        return np.array(data.com[0]), np.array(data.vcom[0])
    index = robot.frame_id(frame)
    pin.forwardKinematics(model, data, q, v)
    pin.updateFramePlacements(model, data)
    velocity = pin.getFrameVelocity(model, data, index, pin.LOCAL_WORLD_ALIGNED).linear
    return np.array(data.oMf[index].translation), np.array(velocity)
