"""Orientations in configurations: deviations, angles, the way between two of them."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
import pinocchio as pin

from fesd_robot.orientations import (
    angles_of,
    deviation_names,
    quaternion_entries,
    roll_pitch_yaw,
    turn_entries,
)
from fesd_robot.robot import rotations
from fesd_robot.robot.robot import Robot


def deviation(names: Sequence[str], q: ca.SX, reference: ca.SX | np.ndarray) -> ca.SX:
    """Return the deviation of a configuration from another, entry by entry.

        q_i - q_ref,i,   for an orientation log(R_ref^T R),   for a turn the angle of (cos, sin) from (cos, sin)_ref

    The rotation vector, rad, has its components along the axes of the body, |.| <= pi, and is the same for a quaternion
    and its negative. Values and derivatives are finite and accurate at and around zero.

    Args:
        names: of the coordinates of q, (n_q).
        q, reference: configurations, SX (n_q), the reference also as numbers.

    Returns:
        (n_d), m and rad, by the names `deviation_names`; one less than entries of q for each orientation or turn.

    Source: Solà, Deray, Atchuthan, A micro Lie theory for state estimation in robotics (2018), appendix B.
    """
    plain, turns = q - reference, turn_entries(names)
    own = sorted([*quaternion_entries(names).values(), *turns.values()], key=lambda at: at.start)
    if not own:
        return plain
    parts, done = [], 0
    for at in own:
        wanted = ca.SX(reference[at])
        if at in turns.values():
            turn = angle_between(wanted, q[at])
        else:
            back = rotations.quaternion_conjugate(wanted)
            turn = rotations.quaternion_logarithm(rotations.quaternion_product(back, q[at]))
        parts += [plain[done : at.start], turn]
        done = at.stop
    return ca.vertcat(*parts, plain[done:])


def angle_between(first: ca.SX, second: ca.SX) -> ca.SX:
    """Return the angle, rad, from one (cos, sin) to another, the short way round."""
    return ca.atan2(first[0] * second[1] - first[1] * second[0], first[0] * second[0] + first[1] * second[1])


def angle_expressions(names: Sequence[str], q: ca.SX) -> dict[str, ca.SX]:
    """Return the angles of orientations and turns by name, rad.

    Args:
        names: of the coordinates of q, (n_q).
        q: configuration, SX (n_q).
    """
    found: dict[str, ca.SX] = {}
    for joint, at in quaternion_entries(names).items():
        turn = rotations.quaternion_matrix(q[at])
        level = ca.sqrt(turn[0, 0] ** 2 + turn[1, 0] ** 2)
        sines = (turn[2, 1], turn[2, 2]), (-turn[2, 0], level), (turn[1, 0], turn[0, 0])
        found |= {angle: ca.atan2(*pair) for angle, pair in zip(angles_of(joint), sines, strict=True)}
    for joint, at in turn_entries(names).items():
        found[joint] = ca.atan2(q[at][1], q[at][0])
    return found


def measured_deviation(names: Sequence[str], q: np.ndarray, reference: np.ndarray) -> dict[str, float]:
    """Return the same as numbers by name, with Pinocchio's logarithm; NaN where an entry of either is NaN.

    Args:
        names: of the coordinates of q, (n_q).
        q, reference: configurations, (n_q).
    """
    own, found = quaternion_entries(names), dict(zip(names, q - reference, strict=True))
    for joint, at in own.items():
        turn = np.full(3, np.nan)
        if np.isfinite(q[at]).all() and np.isfinite(reference[at]).all():
            turn = pin.log3(_matrix(reference[at]).T @ _matrix(q[at]))
        found |= dict(zip(angles_of(joint), turn, strict=True))
    for joint, at in turn_entries(names).items():
        (cosine, sine), (wanted_cosine, wanted_sine) = q[at], reference[at]
        found[joint] = np.arctan2(
            sine * wanted_cosine - cosine * wanted_sine, cosine * wanted_cosine + sine * wanted_sine
        )
    return {name: float(found[name]) for name in deviation_names(names)}


def turned(quaternion: np.ndarray, angles: Sequence[float | None]) -> np.ndarray:
    """Return the quaternion (4) with other roll, pitch and yaw, rad, None for one that stays; of its hemisphere."""
    kept = roll_pitch_yaw(quaternion)
    wanted = [own if angle is None else angle for own, angle in zip(kept, angles, strict=True)]
    found = pin.Quaternion(pin.rpy.rpyToMatrix(*map(float, wanted))).coeffs()
    return np.asarray(found if found @ quaternion >= 0 else -found)


def slerp(first: np.ndarray, second: np.ndarray, fraction: float) -> np.ndarray:
    """Return the quaternion (4) on the way from one to another that turns evenly, the short way round.

        q = q_0 exp(fraction log(q_0^-1 q_1))

    Source: Shoemake, Animating rotation with quaternion curves (1985).
    """
    start, end = pin.Quaternion(np.asarray(first)), pin.Quaternion(np.asarray(second))
    return np.array(start.slerp(float(fraction), end).coeffs())


def with_turn(quaternion: np.ndarray, first: np.ndarray, second: np.ndarray, fraction: float) -> np.ndarray:
    """Return a quaternion (4) followed by a part of the turn from one to another: q exp(f log(q_0^-1 q_1))."""
    part = pin.Quaternion(np.asarray(first)).conjugate() * pin.Quaternion(slerp(first, second, fraction))
    return np.array((pin.Quaternion(np.asarray(quaternion)) * part).coeffs())


def turned_by(pair: np.ndarray, angle: float) -> np.ndarray:
    """Return (cos, sin) after another turn by an angle, rad."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([cosine * pair[0] - sine * pair[1], sine * pair[0] + cosine * pair[1]])


def interpolated(robot: Robot, first: np.ndarray, second: np.ndarray, fraction: float) -> np.ndarray:
    """Return the configuration (n_q) between two: joint by joint on the geodesic.

    A free flyer moves along a straight line while it turns evenly, not along the screw that leads from one pose to the
    other.
    """
    names = robot.configuration_names
    q = np.array(pin.interpolate(robot.model, first, second, fraction))
    for joint, at in quaternion_entries(names).items():
        q[at] = slerp(first[at], second[at], fraction)
        place = slice(max(at.start - 3, 0), at.start)
        if list(names[place]) == [f"{joint}.{axis}" for axis in "xyz"]:
            q[place] = first[place] + fraction * (second[place] - first[place])
    return q


def _matrix(quaternion: np.ndarray) -> np.ndarray:
    return np.asarray(pin.Quaternion(np.asarray(quaternion, dtype=float)).normalized().toRotationMatrix())
