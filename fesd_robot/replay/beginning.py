"""Which contacts in space may begin to slide at all, before the directions are solved for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fesd_robot.contact import ContactMode, Modes
from fesd_robot.exactness import SINGULAR
from fesd_robot.replay.dynamics import ContactDynamics
from fesd_robot.replay.mode_motion import scale_of

_DIRECTIONS = 16
"""Along a tangent plane, that stand for all: a vector is at most 1 / cos(pi / 16) longer than along one."""

_ROOM = 1e-6
"""By how much a condition must be missed, as a ratio of the largest acceleration or force."""


def may_begin(
    dynamics: ContactDynamics, modes: Modes, starting: Sequence[int], held: np.ndarray, spread: np.ndarray
) -> bool:
    """Return whether contacts may begin to slide in given modes: False only where no directions of slides exist.

    The friction f of those contacts, (2 s), is what all other forces and the accelerations depend on linearly. Friction
    takes power from the slides that begin,

        f . a(f) <= 0,   a(f) = a_0 + W f

    so that f is in an ellipsoid; where a bound of a force or of an acceleration is missed in all of it, or |f_i| is
    less than mu_i f_n,i, nothing slides.

    Args:
        dynamics: of the state, without dry friction of joints.
        modes: of every contact, (n_c).
        starting: numbers of those that begin to slide.
        held: rows of J that do not accelerate, (m).
        spread: how m forces that hold them are spread on the rows of J, (rows n_c, m), without the friction f.
    """
    size, count = dynamics.rows, len(modes)
    tangents = [size * i + k for i in starting for k in range(1, size)]
    matrix = (dynamics.compliance @ spread)[held]
    if np.linalg.cond(matrix) > 1 / SINGULAR:
        return True
    by_friction = dynamics.compliance[:, tangents]
    solved = -np.linalg.solve(matrix, np.column_stack([dynamics.free[held], by_friction[held]]))
    forces = spread @ solved
    forces[tangents, 1:] += np.eye(len(tangents))
    accelerations = dynamics.compliance @ forces
    accelerations[:, 0] += dynamics.free
    power = accelerations[tangents, 1:]
    inverse = _inverse((power + power.T) / 2)
    if inverse is None:
        return True
    center = -0.5 * inverse @ accelerations[tangents, 0]
    radius = float(np.sqrt(max(0.0, -0.5 * center @ accelerations[tangents, 0])))

    def most(rows: np.ndarray) -> np.ndarray:
        """Return the largest values in the ellipsoid of affine functions of f, (k, 1 + 2 s) -> (k)."""
        slopes = rows[:, 1:]
        widths = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slopes, inverse, slopes), 0.0))
        return np.asarray(rows[:, 0] + slopes @ center + radius * widths)

    pushes, parts = _ROOM * scale_of(solved[:, 0]), _ROOM * scale_of(dynamics.free)
    angles = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    around, longer = np.column_stack([np.cos(angles), np.sin(angles)]), 1 / np.cos(np.pi / _DIRECTIONS)
    for i in range(count):
        normal, along = forces[size * i], forces[size * i + 1 : size * (i + 1)]
        if modes[i] is ContactMode.FLIGHT:
            continue
        if most(normal[None])[0] < -pushes:
            return False
        friction = dynamics.friction[i] * normal
        if modes[i] is ContactMode.STICK and most(friction - around @ along).min() < -pushes:
            return False
        if i in starting and most(longer * around @ along - friction).max() < -pushes:
            return False
    return not any(
        most(accelerations[size * i][None])[0] < -parts for i in range(count) if modes[i] is ContactMode.FLIGHT
    )


def _inverse(matrix: np.ndarray) -> np.ndarray | None:
    """Return the inverse of a symmetric matrix if it is positive definite."""
    try:
        factor = np.linalg.inv(np.linalg.cholesky(matrix))
    except np.linalg.LinAlgError:
        return None
    return np.asarray(factor.T @ factor)
