"""The curve on which the centre of a circle runs that rolls on a profile."""

from __future__ import annotations

import itertools

import numpy as np
from scipy.interpolate import BPoly, PPoly

from fesd_robot.contact.ground.profile import Profile
from fesd_robot.errors import GroundError

ACCURACY = 1e-7
"""m; largest distance between the curve and the exact parallel curve."""

_FINEST = 64
"""Largest number of parts that a piece is cut into."""

CLOSENESS = 0.95
"""Radius over radius of curvature up to which a circle or a ball is said to fit; at 1 the parallel curve has a cusp."""


def offset_profile(profile: Profile, radius: float) -> Profile:
    """Return the parallel curve (s - r h' / w, h + r / w), w = sqrt(1 + h'^2), as a profile.

    Each piece is cut until quintic Hermite polynomials through exact points, slopes and second derivatives
    ``h'' / (1 - r h'' / w^3)`` are accurate to `ACCURACY`.

    Raises:
        GroundError: a hollow is narrower than the circle, which would touch on both of its sides.
    """
    x, curvature = profile.sampled(2)
    _, slope = profile.sampled(1)
    closeness = radius * curvature * (1 + slope**2) ** -1.5
    worst = int(np.argmax(closeness))
    if closeness[worst] > CLOSENESS:
        raise GroundError(
            f"found a radius of {radius:g} m, but the ground has a hollow of radius {radius / closeness[worst]:.4g} m "
            f"at x = {x[worst]:.4g} m, where a circle touches twice; expected a radius of at most "
            f"{CLOSENESS * radius / closeness[worst]:.4g} m, or a smoother ground"
        )
    nodes = [profile.breaks[:1]]
    for left, right in itertools.pairwise(profile.breaks):
        nodes.append(_cut(profile, radius, left, right)[1:])
    return Profile.from_piecewise(_hermite(profile, radius, np.concatenate(nodes)))


def _cut(profile: Profile, radius: float, left: float, right: float) -> np.ndarray:
    """Return the points s that cut one piece into as many parts as the accuracy needs."""
    parts = 1
    while parts <= _FINEST:
        nodes = np.linspace(left, right, parts + 1)
        between = np.linspace(left, right, 4 * parts + 1)
        at, height, slope, _ = _parallel(profile, radius, between)
        error = (_hermite(profile, radius, nodes)(at) - height) / np.sqrt(1 + slope**2)
        if np.abs(error).max() <= ACCURACY:
            return nodes
        parts *= 2
    raise GroundError(
        f"the path of a circle of radius {radius:g} m over the ground between x = {left:.4g} and {right:.4g} m bends "
        "too sharply, expected a smaller radius or a smoother ground"
    )


def _parallel(profile: Profile, radius: float, s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the points x and z of the parallel curve, with dz/dx and d2z/dx2."""
    height, slope, curvature = profile.derivatives(s)
    length = np.sqrt(1 + slope**2)
    return (
        s - radius * slope / length,
        height + radius / length,
        slope,
        curvature / (1 - radius * curvature / length**3),
    )


def _hermite(profile: Profile, radius: float, s: np.ndarray) -> PPoly:
    at, height, slope, curvature = _parallel(profile, radius, s)
    return PPoly.from_bernstein_basis(BPoly.from_derivatives(at, np.stack([height, slope, curvature], axis=1)))
