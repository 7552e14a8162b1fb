"""Circles of the robot that may touch the ground or each other, rolling or sliding."""

from __future__ import annotations

import casadi as ca

from fesd_robot.contact.ground import Surface
from fesd_robot.contact.model import Contact
from fesd_robot.contact.points import check_planar, planar_frame, surface_at
from fesd_robot.robot import Robot, frame_jacobian, frame_placement

COINCIDENCE = 1e-8
"""Share of r_1 + r_2 that is added to the distance of two centres, in squares: below round-off where circles touch,
and a derivative where centres coincide."""


def circle_contact(
    robot: Robot,
    configuration: ca.SX,
    path: Surface,
    *,
    name: str,
    frame: str,
    radius: float,
    friction: float,
    in_space: bool = False,
) -> Contact:
    """Return gap, normal and tangents of a circle, in space of a ball, that turns with a frame, over a surface.

    f_c(q) = f_r(p(q)), J_n = J_p^T grad f_r, J_t = J_p^T t - r J_w with the surface f_r on which the centre p runs and
    the Jacobian J_w of the angle about +y: the point that touches, at -r n, has the velocity p' + w x (-r n).

    Args:
        configuration: q, SX symbols (n_q).
        path: the ground raised by the radius, `Surface.raised`.
        frame: name of the frame about whose origin the circle lies.
        radius: m.
        friction: coefficient mu.
        in_space: whether it is a ball, which has two tangents.

    Raises:
        RobotError: the frame of a circle can move or turn out of the x-z plane.
        GroundError: the surface of a circle varies along y.
    """
    if in_space:
        return _ball_contact(robot, configuration, path, name=name, frame=frame, radius=radius, friction=friction)
    check_planar(path, name)
    center, jacobian, turning = planar_frame(robot, configuration, frame, name=name, turning=True)
    gap, normal, (tangent, _) = surface_at(path, center)
    return Contact(
        name=name,
        gap=gap,
        normal=ca.densify(ca.mtimes(jacobian.T, normal)),
        tangents=ca.densify(ca.mtimes(jacobian.T, tangent) - radius * turning.T),
        friction=friction,
    )


def _ball_contact(
    robot: Robot, configuration: ca.SX, path: Surface, *, name: str, frame: str, radius: float, friction: float
) -> Contact:
    """Return the same in space: J_tk = J_p^T t_k - r J_w^T (n x t_k), where n x t_1 = t_2 and n x t_2 = -t_1."""
    _, center = frame_placement(robot, configuration, frame)
    jacobian = frame_jacobian(robot, configuration, frame)
    gap, normal, (tangent, lateral) = surface_at(path, center)
    tangents, turned = ca.horzcat(tangent, lateral), ca.horzcat(lateral, -tangent)
    moving = ca.mtimes(jacobian[:3, :].T, tangents) - radius * ca.mtimes(jacobian[3:, :].T, turned)
    return Contact(
        name=name,
        gap=gap,
        normal=ca.densify(ca.mtimes(jacobian[:3, :].T, normal)),
        tangents=ca.densify(moving),
        friction=friction,
    )


def two_circles_contact(
    robot: Robot,
    configuration: ca.SX,
    *,
    name: str,
    frames: tuple[str, str],
    radii: tuple[float, float],
    friction: float,
) -> Contact:
    """Return gap, normal and tangent directions of two circles that turn with their frames.

    f_c(q) = |d| - r_1 - r_2 with d = p_1 - p_2 in the x-z plane, n = d / |d|, t = (n_z, -n_x), J_n = (J_1 - J_2)^T n,
    J_t = (J_1 - J_2)^T t - r_1 J_w1 - r_2 J_w2: the velocity of circle 1 over circle 2 where they touch.

    Args:
        configuration: q, SX symbols (n_q).
        frames: names of the frames about whose origins the circles lie.
        radii: m.
        friction: coefficient mu.

    Raises:
        RobotError: a frame can move or turn out of the x-z plane.
    """
    first, second = (planar_frame(robot, configuration, frame, name=name, turning=True) for frame in frames)
    apart, jacobian = first[0] - second[0], first[1] - second[1]
    reach = radii[0] + radii[1]
    length = ca.sqrt(apart[0] ** 2 + apart[2] ** 2 + (COINCIDENCE * reach) ** 2)
    x, z = apart[0] / length, apart[2] / length
    turning = radii[0] * first[2] + radii[1] * second[2]
    return Contact(
        name=name,
        gap=length - reach,
        normal=ca.densify(ca.mtimes(jacobian.T, ca.vertcat(x, ca.SX(1, 1), z))),
        tangents=ca.densify(ca.mtimes(jacobian.T, ca.vertcat(z, ca.SX(1, 1), -x)) - turning.T),
        friction=friction,
    )
