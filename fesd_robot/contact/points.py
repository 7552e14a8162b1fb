"""Points of the robot that may touch the ground."""

from __future__ import annotations

import casadi as ca
import numpy as np

from fesd_robot.contact.ground import Ground
from fesd_robot.contact.model import PlanarContact
from fesd_robot.errors import RobotError
from fesd_robot.robot import Robot, frame_jacobian, frame_placement


def point_contact(
    robot: Robot, configuration: ca.SX, ground: Ground, *, name: str, frame: str, friction: float
) -> PlanarContact:
    """Return gap, normal and tangent directions of the origin of a frame over the ground.

    f_c(q) = distance(p(q)), J_n = J_p^T n, J_t = J_p^T t with the world-aligned Jacobian J_p of the frame's origin.

    Args:
        configuration: q, SX symbols (n_q).
        frame: name of the frame whose origin touches.
        friction: coefficient mu.

    Raises:
        RobotError: the frame can move out of the x-z plane, where planar friction would be wrong.
    """
    _, position = frame_placement(robot, configuration, frame)
    jacobian = frame_jacobian(robot, configuration, frame)[:3, :]
    sideways = ca.sparsify(ca.simplify(jacobian[1, :]))
    if sideways.nnz() and not sideways.is_zero():
        raise RobotError(
            f"contact '{name}': frame '{frame}' can leave the x-z plane, but contact is planar; "
            "use a robot whose root and joints keep this frame in that plane"
        )
    normal, tangent = ground.normal(position), ground.tangent(position)
    return PlanarContact(
        name=name,
        gap=ground.distance(position),
        normal=ca.densify(ca.mtimes(jacobian.T, _constant(normal))),
        tangent=ca.densify(ca.mtimes(jacobian.T, _constant(tangent))),
        friction=friction,
    )


def _constant(vector: np.ndarray) -> ca.SX:
    """A constant direction with structural zeros, so that they leave no trace in the expressions."""
    return ca.sparsify(ca.SX(ca.DM(vector.tolist())))
