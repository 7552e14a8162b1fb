"""The directions in which contacts slide, in the plane and in space."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import root

from fesd_robot.exactness import NO_VELOCITY

_TURNS = 8
"""Directions from which that of a beginning slide is searched for where the first one leads to none."""

_COARSE, _FINE = 1e-3, 1e-9
"""Relative accuracy at which a search is given up or goes on, and at which it ends: most are of slides that do not
begin, and have no end."""


def slip_headings(
    velocities: np.ndarray,
    before: np.ndarray | None = None,
    *,
    through_zero: bool = False,
    slow: float = NO_VELOCITY,
) -> np.ndarray:
    """Return the directions in which contacts slide, (n_c, n_t).

    In the plane these are the tangents, in space those of the velocities.

    Args:
        velocities: tangential, m/s, (n_c, n_t).
        before: directions shortly before, (n_c, n_t), which those without a velocity keep; zeros if omitted.
        through_zero: whether a velocity that has turned round, as it does just beyond the end of a slide, keeps the
            sign of its direction, so that the motion goes on smoothly.
        slow: speed, m/s, up to which a velocity has no direction.
    """
    if velocities.shape[1] == 1:
        return np.ones_like(velocities)
    speeds = np.linalg.norm(velocities, axis=1, keepdims=True)
    known = np.zeros_like(velocities) if before is None else before
    back = through_zero & ((velocities * known).sum(axis=1, keepdims=True) < 0)
    return np.where(speeds > slow, np.where(back, -1.0, 1.0) * velocities / np.maximum(speeds, slow), known)


def beginning_headings(
    drift: Callable[[np.ndarray], np.ndarray], pulls: np.ndarray, headings: np.ndarray, starting: Sequence[int]
) -> np.ndarray:
    """Return the directions in space with those of contacts that begin to slide: the ones that they accelerate in.

        e_i x a_i(e) = 0  and  e_i . a_i(e) >= 0,   e_i = (cos phi_i, sin phi_i)

    is solved for the angles phi, at first from the directions that are given, and where there are none from those in
    which the forces that would hold the contacts fail to.

    Args:
        drift: directions of all contacts -> their tangential accelerations under friction against them, (n_c, 2).
        pulls: directions to begin with, of any length, (n_c, 2).
        headings: of the contacts that slide already, and of those that have begun to shortly before, (n_c, 2).
        starting: contacts that begin to slide.

    Returns:
        (n_c, 2); zeros for contacts in `starting` for which there is no direction.
    """
    chosen = list(starting)
    known, sizes = headings.copy(), np.linalg.norm(pulls[chosen], axis=1)
    known[chosen] = 0.0
    if not sizes.all():
        return known

    def along(angles: np.ndarray) -> np.ndarray:
        result = known.copy()
        result[chosen] = np.column_stack([np.cos(angles), np.sin(angles)])
        return result

    def accelerations(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        directions = along(angles)
        return directions[chosen], drift(directions)[chosen]

    def across(angles: np.ndarray) -> np.ndarray:
        return _cross(*accelerations(angles))

    # From one moment to the next a direction hardly turns.
    near = np.where(headings[chosen].any(axis=1, keepdims=True), headings[chosen], pulls[chosen])
    first = np.arctan2(near[:, 1], near[:, 0])
    size = float(np.abs(drift(known)[chosen]).max()) + 1e-300

    def begins(angles: np.ndarray, accuracy: float) -> bool:
        e, a = accelerations(angles)
        return bool(np.abs(_cross(e, a)).max() <= accuracy * size and (e * a).sum(axis=1).min() >= -accuracy * size)

    for turn in range(_TURNS):
        coarse = root(across, first + 2 * np.pi * turn / _TURNS, tol=_COARSE).x
        if begins(coarse, _COARSE):
            found = root(across, coarse, tol=1e-14).x
            if begins(found, _FINE):
                return along(found)
    return known


def _cross(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the products e x a of vectors in the plane, (n, 2) each."""
    return np.asarray(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
