"""Points of the robot that may touch the ground."""

from __future__ import annotations

import casadi as ca
import numpy as np

from fesd_robot.contact.ground import Surface
from fesd_robot.contact.model import Contact
from fesd_robot.errors import GroundError, RobotError
from fesd_robot.robot import Robot, frame_jacobian, frame_placement


def point_contact(
    robot: Robot,
    configuration: ca.SX,
    ground: Surface,
    *,
    name: str,
    frame: str,
    friction: float,
    in_space: bool = False,
) -> Contact:
    """Return gap, normal and tangent directions of the origin of a frame over the ground.

    f_c(q) = f(p(q)), J_n = J_p^T grad f, J_t = J_p^T t with the world-aligned Jacobian J_p of the frame's origin.

    Args:
        configuration: q, SX symbols (n_q).
        frame: name of the frame whose origin touches.
        friction: coefficient mu.
        in_space: whether the contact has two tangents.

    Raises:
        RobotError: the frame of a contact in the plane can move out of it.
        GroundError: the surface of a contact in the plane varies along y.
    """
    if in_space:
        _, position = frame_placement(robot, configuration, frame)
        jacobian = frame_jacobian(robot, configuration, frame)[:3, :]
    else:
        check_planar(ground, name)
        position, jacobian, _ = planar_frame(robot, configuration, frame, name=name)
    gap, normal, tangents = surface_at(ground, position)
    return Contact(
        name=name,
        gap=gap,
        normal=ca.densify(ca.mtimes(jacobian.T, normal)),
        tangents=ca.densify(ca.mtimes(jacobian.T, ca.horzcat(*tangents[: 2 if in_space else 1]))),
        friction=friction,
    )


def planar_frame(
    robot: Robot, configuration: ca.SX, frame: str, *, name: str, turning: bool = False
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return position (3), Jacobian of the position (3, n_v) and of the angle about +y (1, n_v) of a frame.

    Args:
        name: of the contact, for messages.
        turning: whether the frame may also turn about y only.

    Raises:
        RobotError: the frame can move out of the x-z plane, or turn out of it where that matters.
    """
    _, position = frame_placement(robot, configuration, frame)
    jacobian = frame_jacobian(robot, configuration, frame)
    if not _vanishes(jacobian[1, :]):
        raise RobotError(
            f"contact '{name}': frame '{frame}' can leave the x-z plane, but this contact is planar; "
            "use a robot whose root and joints keep this frame in that plane (fesd-robot robots MODEL "
            "--sagittal proposes what to lock)"
        )
    if turning and not (_vanishes(jacobian[3, :]) and _vanishes(jacobian[5, :])):
        raise RobotError(
            f"contact '{name}': frame '{frame}' can turn out of the x-z plane, but its circle is planar; "
            "use a robot whose root and joints turn this frame about y only"
        )
    return position, jacobian[:3, :], jacobian[4, :]


def check_planar(ground: Surface, name: str) -> None:
    """Raise if a surface varies along y, on which the friction of a contact in the x-z plane would be wrong.

    Args:
        name: of the contact, for messages.

    Raises:
        GroundError: it does.
    """
    if ground.varies_across:
        raise GroundError(
            f"contact '{name}' stays in the x-z plane, but what it touches varies along y; expected a surface that "
            "does not, as a box or lying cylinder without ends along y, or a robot that can leave the plane"
        )


def surface_at(ground: Surface, position: ca.SX) -> tuple[ca.SX, ca.SX, list[ca.SX]]:
    """Return gap, gradient (3) and both tangents (3) of a surface at a position, shared expressions computed once."""
    _, *tangents = ground.axes(position)
    found = [ground.distance(position), ground.normal(position), *tangents]
    varying = [k for k, each in enumerate(found) if not isinstance(each, np.ndarray)]
    if len(varying) > 1:
        for k, shared in zip(varying, ca.cse([found[k] for k in varying]), strict=True):
            found[k] = shared
    gap, *directions = (_constant(each) if isinstance(each, np.ndarray) else each for each in found)
    return gap, directions[0], directions[1:]


def leaves_plane(robot: Robot, configuration: ca.SX, frame: str, *, turning: bool) -> bool:
    """Return whether a frame can leave the x-z plane, or turn out of it where that matters.

    Args:
        configuration: q, SX symbols (n_q).
        turning: whether turning matters.
    """
    return bool(leading_out_of_plane(robot, configuration, frame, turning=turning))


def leading_out_of_plane(robot: Robot, configuration: ca.SX, frame: str, *, turning: bool) -> list[str]:
    """Return the velocity coordinates that move a frame out of the x-z plane, or turn it out of it where that matters.

    Args:
        configuration: q, SX symbols (n_q).
        turning: whether turning matters.
    """
    rows = frame_jacobian(robot, configuration, frame)[[1, 3, 5] if turning else [1], :]
    return [name for column, name in enumerate(robot.velocity_names) if not _vanishes(rows[:, column].T)]


def _constant(vector: np.ndarray) -> ca.SX:
    """Return a constant direction with structural zeros, so that they leave no trace in the expressions."""
    return ca.sparsify(ca.SX(ca.DM(vector.tolist())))


def _vanishes(row: ca.SX) -> bool:
    row = ca.sparsify(ca.simplify(row))
    return not row.nnz() or row.is_zero()
