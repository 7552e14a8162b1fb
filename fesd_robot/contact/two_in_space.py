"""Balls of the robot that may touch balls and boxes of other bodies in space."""

from __future__ import annotations

from typing import Literal

import casadi as ca
import numpy as np

from fesd_robot.contact.circles import COINCIDENCE
from fesd_robot.contact.model import Contact
from fesd_robot.robot import Robot, frame_jacobian, frame_placement

Facing = Literal["x", "-x", "y", "-y", "z", "-z"]
"""An axis of the world, or the direction against it."""


def axes_about(facing: Facing) -> np.ndarray:
    """Return an axis and two across it as columns, right-handed, (3, 3): z, x and y for the first axis z."""
    x, y, z = np.eye(3)
    first = {"x": x, "y": y, "z": z}[facing[-1]] * (-1 if facing.startswith("-") else 1)
    third = np.cross(first, x) if facing[-1] == "y" else y
    return np.column_stack([first, np.cross(third, first), third])


def two_balls_contact(
    robot: Robot,
    configuration: ca.SX,
    *,
    name: str,
    frames: tuple[str, str],
    radii: tuple[float, float],
    friction: float,
    facing: Facing,
) -> Contact:
    """Return gap, normal and tangents of two balls that turn with their frames.

    f_c(q) = |d| - r_1 - r_2 with d = p_1 - p_2, n = d / |d|, J_n = (J_1 - J_2)^T n and
    J_tk = (J_1 - J_2)^T t_k - (r_1 J_w1 + r_2 J_w2)^T (n x t_k): the velocity of ball 1 over ball 2 where they touch.

    Args:
        configuration: q, SX symbols (n_q).
        frames: names of the frames about whose origins the balls lie.
        radii: m.
        friction: coefficient mu.
        facing: see `tangents_at`.
    """
    first, second = (_moving(robot, configuration, frame) for frame in frames)
    apart, jacobian = first[0] - second[0], first[1] - second[1]
    reach = radii[0] + radii[1]
    length = ca.sqrt(ca.sumsqr(apart) + (COINCIDENCE * reach) ** 2)
    normal = apart / length
    turning = radii[0] * first[2] + radii[1] * second[2]
    along, across = tangents_at(normal, facing)
    moving = [
        ca.mtimes(jacobian.T, tangent) - ca.mtimes(turning.T, turned)
        for tangent, turned in ((along, across), (across, -along))
    ]
    return Contact(
        name=name,
        gap=length - reach,
        normal=ca.densify(ca.mtimes(jacobian.T, normal)),
        tangents=ca.densify(ca.horzcat(*moving)),
        friction=friction,
    )


def ball_box_contact(
    robot: Robot,
    configuration: ca.SX,
    *,
    name: str,
    frames: tuple[str, str],
    radius: float,
    size: tuple[float, ...],
    friction: float,
    facing: Facing,
) -> Contact:
    """Return gap, normal and tangents of a ball and a box, each turning with its frame.

    f_c(q) = |max(|d| - s/2, 0)| + min(max_i(|d_i| - s_i/2), 0) - r with the centre d of the ball in the axes of the box
    of size s; n = grad f_c in the world, and with the box's point c that is nearest to the ball, at e from its origin,
    J_n = (J_1 - J_2)^T n - J_w2^T (e x n), J_tk = (J_1 - J_2)^T t_k - r J_w1^T (n x t_k) - J_w2^T (e x t_k).

    Args:
        configuration: q, SX symbols (n_q).
        frames: names of the frames of ball and box, about whose origins they lie.
        radius: of the ball, m.
        size: of the box along the axes of its frame, m, (3).
        friction: coefficient mu.
        facing: see `tangents_at`.
    """
    first, second = (_moving(robot, configuration, frame) for frame in frames)
    rotation, _ = frame_placement(robot, configuration, frames[1])
    apart, jacobian = first[0] - second[0], first[1] - second[1]
    own = ca.mtimes(rotation.T, apart)
    beyond = ca.fabs(own) - ca.DM(size) / 2
    outside = ca.fmax(beyond, 0)
    length = ca.sqrt(ca.sumsqr(outside) + (COINCIDENCE * radius) ** 2)
    deepest = ca.fmax(ca.fmax(beyond[0], beyond[1]), beyond[2])
    within = deepest < 0
    x = ca.logic_and(beyond[0] >= beyond[1], beyond[0] >= beyond[2])
    y = ca.logic_and(ca.logic_not(x), beyond[1] >= beyond[2])
    side = ca.vertcat(x, y, 1 - x - y)
    normal = ca.mtimes(rotation, ca.sign(own) * ca.if_else(within, side, outside / length))
    distance = ca.if_else(within, deepest, length)
    reach = apart - distance * normal
    along, across = tangents_at(normal, facing)
    moving = [
        ca.mtimes(jacobian.T, tangent)
        - radius * ca.mtimes(first[2].T, turned)
        - ca.mtimes(second[2].T, ca.cross(reach, tangent))
        for tangent, turned in ((along, across), (across, -along))
    ]
    return Contact(
        name=name,
        gap=distance - radius,
        normal=ca.densify(ca.mtimes(jacobian.T, normal) - ca.mtimes(second[2].T, ca.cross(reach, normal))),
        tangents=ca.densify(ca.horzcat(*moving)),
        friction=friction,
    )


def tangents_at(normal: ca.SX, facing: Facing) -> tuple[ca.SX, ca.SX]:
    """Return the two tangents at a normal, right-handed with it, SX (3) each.

    They are those of the axis that the normal faces, turned with it along the shortest way, so they are smooth but
    where the normal is opposite to that axis: nowhere near where the motion starts, if the axis is nearest to it there.

        t_1 = b - a u - (u b + w c) u / (1 + s),   t_2 = c - a w - (u b + w c) w / (1 + s)

    with the axis a, the tangents b and c there, and the normal n = s a + u b + w c.

    Args:
        normal: unit vector, SX (3).
        facing: the axis a.

    Source: Duff et al., Building an orthonormal basis, revisited, JCGT 6 (2017), for one axis.
    """
    a, b, c = (ca.sparsify(ca.DM(column.tolist())) for column in axes_about(facing).T)
    s, u, w = (ca.dot(axis, normal) for axis in (a, b, c))
    bent = (u * b + w * c) / (1 + s)
    return b - u * a - u * bent, c - w * a - w * bent


def _moving(robot: Robot, configuration: ca.SX, frame: str) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return position (3), and the Jacobians of position and angular velocity, (3, n_v) each, of a frame."""
    _, position = frame_placement(robot, configuration, frame)
    jacobian = frame_jacobian(robot, configuration, frame)
    return position, jacobian[:3, :], jacobian[3:, :]
