"""Circles of the robot that may touch a box of another body: its flat sides and its corners."""

from __future__ import annotations

import casadi as ca
import numpy as np

from fesd_robot.contact.circles import COINCIDENCE
from fesd_robot.contact.model import Contact
from fesd_robot.contact.points import planar_frame
from fesd_robot.errors import RobotError
from fesd_robot.exactness import ROUNDED
from fesd_robot.robot import Robot, frame_placement


def circle_box_contact(
    robot: Robot,
    configuration: ca.SX,
    *,
    name: str,
    frames: tuple[str, str],
    radius: float,
    size: tuple[float, float],
    friction: float,
) -> Contact:
    """Return gap, normal and tangent directions of a circle and a box, each turning with its frame.

    f_c(q) = |max(|d| - s/2, 0)| + min(max(|d_x| - s_x/2, |d_z| - s_z/2), 0) - r with the centre d of the circle in the
    axes of the box of size s; n = grad f_c and t = (n_z, -n_x) in the world, J_n = n^T (J_1 - J_c),
    J_t = t^T (J_1 - J_c) - r J_w1 with the Jacobian J_c of the box's point c that is nearest to the circle.

    Args:
        configuration: q, SX symbols (n_q).
        frames: names of the frames of circle and box, about whose origins they lie.
        radius: of the circle, m.
        size: of the box along the x and the z axis of its frame, m.
        friction: coefficient mu.

    Raises:
        RobotError: a frame can move or turn out of the x-z plane, or the y axis of the box's frame is not the world's.
    """
    first, second = (planar_frame(robot, configuration, frame, name=name, turning=True) for frame in frames)
    rotation, _ = frame_placement(robot, configuration, frames[1])
    _check_upright(robot, configuration, rotation, name, frames[1])
    apart = first[0] - second[0]
    own = ca.mtimes(rotation.T, apart)
    beyond = [ca.fabs(own[i]) - size[side] / 2 for side, i in enumerate((0, 2))]
    outside = [ca.fmax(each, 0) for each in beyond]
    length = ca.sqrt(outside[0] ** 2 + outside[1] ** 2 + (COINCIDENCE * radius) ** 2)
    within, along_x = ca.logic_and(beyond[0] < 0, beyond[1] < 0), beyond[0] > beyond[1]
    x = ca.sign(own[0]) * ca.if_else(within, along_x, outside[0] / length)
    z = ca.sign(own[2]) * ca.if_else(within, 1 - along_x, outside[1] / length)
    normal = ca.mtimes(rotation, ca.vertcat(x, 0, z))
    n_x, n_z = normal[0], normal[2]
    distance = ca.if_else(within, ca.fmax(*beyond), length)
    reach = [apart[0] - distance * n_x, apart[2] - distance * n_z]  # from the box's origin to its nearest point
    jacobian = first[1] - second[1]
    across = n_x * reach[1] - n_z * reach[0]
    along = n_z * reach[1] + n_x * reach[0]
    return Contact(
        name=name,
        gap=distance - radius,
        normal=ca.densify(ca.mtimes(jacobian.T, ca.vertcat(n_x, ca.SX(1, 1), n_z)) - across * second[2].T),
        tangents=ca.densify(
            ca.mtimes(jacobian.T, ca.vertcat(n_z, ca.SX(1, 1), -n_x)) - radius * first[2].T - along * second[2].T
        ),
        friction=friction,
    )


def _check_upright(robot: Robot, configuration: ca.SX, rotation: ca.SX, name: str, frame: str) -> None:
    """Refuse a box whose sides are not seen from the side; whether it stays so is known already."""
    axis = np.asarray(ca.Function("axis", [configuration], [rotation[:, 1]])(robot.neutral)).ravel()
    if abs(abs(axis[1]) - 1) > ROUNDED:
        raise RobotError(
            f"contact '{name}': the y axis of frame '{frame}' points along "
            f"({', '.join(f'{value:.3g}' for value in axis)}), but its box lies in the x-z plane; use a frame whose y "
            "axis is that of the world"
        )
