"""Profiles that a task can ask for: steps and curves through given points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import BPoly, CubicSpline, PPoly

from fesd_robot.contact.ground.profile import Profile


def steps(start: float, edges: Sequence[float], heights: Sequence[float], smoothing: float) -> Profile:
    """Return level treads joined by smooth rises: h + (h_next - h) (10 s^3 - 15 s^4 + 6 s^5), s from 0 to 1.

    Every rise is centred on its edge and as long as `smoothing`; its steepest slope is 15/8 of height over length.

    Args:
        start: height before the first edge, m.
        edges: x of the edges, m, at least `smoothing` apart.
        heights: height after each edge, m.
        smoothing: length of every rise along x, m.
    """
    levels = np.array([start, *heights], dtype=float)
    breaks = (np.asarray(edges, dtype=float)[:, None] + smoothing * np.array([-0.5, 0.5])).ravel()
    values = np.zeros((len(breaks), 3))
    values[:, 0] = np.repeat(levels, 2)[1:-1]
    # Rises that touch share a break.
    keep = np.append(np.diff(breaks) > 1e-12, True)
    return Profile.from_piecewise(PPoly.from_bernstein_basis(BPoly.from_derivatives(breaks[keep], values[keep])))


def height_map(x: np.ndarray, z: np.ndarray) -> Profile:
    """Return the natural cubic spline through the points, levelled off beyond both ends.

    Beyond an end the ground turns level over a tenth of the map's length, rising on by the slope of the end times half
    that length; from there on it is flat. Levelled faster, it would have hollows that are not in the map.

    Args:
        x: m, increasing, (n), n >= 2. z: m, (n).
    """
    x, z = np.asarray(x, dtype=float), np.asarray(z, dtype=float)
    spline = CubicSpline(x, z, bc_type="natural")
    length = 0.1 * (x[-1] - x[0])
    slopes = spline(x[[0, -1]], 1)
    left = _levelling(x[0] - length, x[0], [z[0] - slopes[0] * length / 2, 0, 0], [z[0], slopes[0], 0])
    right = _levelling(x[-1], x[-1] + length, [z[-1], slopes[1], 0], [z[-1] + slopes[1] * length / 2, 0, 0])
    inside = np.vstack([np.zeros((2, len(x) - 1)), spline.c])
    return Profile.from_piecewise(
        PPoly(np.hstack([left.c, inside, right.c]), np.concatenate([left.x[:1], x, right.x[1:]]))
    )


def _levelling(left: float, right: float, at_left: list[float], at_right: list[float]) -> PPoly:
    """Return the quintic with given height, slope and second derivative at both ends."""
    return PPoly.from_bernstein_basis(BPoly.from_derivatives([left, right], [at_left, at_right]))
