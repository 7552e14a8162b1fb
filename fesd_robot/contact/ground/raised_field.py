"""The surface on which the centre of a ball runs that rolls on a height field."""

from __future__ import annotations

import numpy as np

from fesd_robot.contact.ground.height_field import MAX_POINTS, HeightField, Heights
from fesd_robot.contact.ground.offset import CLOSENESS
from fesd_robot.errors import GroundError

ACCURACY = 2e-5
"""m; largest distance between the surface and the exact parallel surface."""

_NEWTON_STEPS = 50
_CONVERGED = 1e-12
"""m; the search for the point below a centre ends this near."""


def raised_field(field: HeightField, radius: float) -> HeightField:
    """Return the parallel surface p + r n as a height field.

    Lines of its grid are added until the spline through exact points is accurate to `ACCURACY` between them.

    Raises:
        GroundError: a hollow is narrower than the ball, which would touch twice, or the surface bends too sharply.
    """
    _check_hollows(field, radius, *field.sampled_places)
    x, y = field.along.breaks, field.across.breaks
    while len(x) * len(y) <= MAX_POINTS:
        raised = HeightField.through(x, y, _parallel(field, radius, x, y)[0])
        between = [_cut(places, np.full(len(places) - 1, True)) for places in (x, y)]
        exact, slope = _parallel(field, radius, *between)
        found = raised.derivatives(*np.meshgrid(*between, indexing="ij")).h
        wrong = np.abs(found - exact) / np.sqrt(1 + slope) > ACCURACY
        if not wrong.any():
            return raised
        # Between two points along x the error is that of the splines along x; in the middle of four, of both.
        by_x, by_y = wrong[1::2, ::2].any(axis=1), wrong[::2, 1::2].any(axis=0)
        if not by_x.any() and not by_y.any():
            by_x, by_y = wrong[1::2, 1::2].any(axis=1), wrong[1::2, 1::2].any(axis=0)
        x, y = _cut(x, by_x), _cut(y, by_y)
    raise GroundError(
        f"the path of a ball of radius {radius:g} m over the ground bends too sharply, expected a smaller radius or a "
        "smoother ground"
    )


def _check_hollows(field: HeightField, radius: float, x: np.ndarray, y: np.ndarray) -> None:
    """Refuse a ball that is larger than a hollow: the largest principal curvature, by the shape operator."""
    at = field.derivatives(*np.meshgrid(x, y, indexing="ij"))
    square = 1 + at.x**2 + at.y**2
    mean = ((1 + at.y**2) * at.xx - 2 * at.x * at.y * at.xy + (1 + at.x**2) * at.yy) / (2 * square**1.5)
    gauss = (at.xx * at.yy - at.xy**2) / square**2
    closeness = radius * (mean + np.sqrt(np.maximum(mean**2 - gauss, 0)))
    i, j = np.unravel_index(int(np.argmax(closeness)), closeness.shape)
    if closeness[i, j] > CLOSENESS:
        raise GroundError(
            f"found a radius of {radius:g} m, but the ground has a hollow of radius {radius / closeness[i, j]:.4g} m "
            f"at x = {x[i]:.4g}, y = {y[j]:.4g} m, where a ball touches twice; expected a radius of at most "
            f"{CLOSENESS * radius / closeness[i, j]:.4g} m, or a smoother ground"
        )


def _cut(places: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return the places with some of the steps between them, (n - 1) of bool, cut in halves."""
    return np.sort(np.append(places, (places[:-1] + np.diff(places) / 2)[steps]))


def _parallel(field: HeightField, radius: float, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the heights of the parallel surface over a grid, m, and squares of its slope there.

    The point (s, t) of the ground below a centre solves (s, t) - r grad h / sqrt(1 + |grad h|^2) = (x, y), by Newton's
    method with its steps halved where they do not help.
    """
    wanted = np.stack(np.meshgrid(x, y, indexing="ij"))
    at = wanted.copy()
    found, missed = _missed(field, radius, at, wanted)
    for _ in range(_NEWTON_STEPS):
        if np.hypot(*missed).max() <= _CONVERGED:
            break
        step = _newton_step(found, radius, missed)
        share = np.ones(step.shape[1:])
        for _ in range(20):
            trial, left = _missed(field, radius, at - share * step, wanted)
            worse = np.hypot(*left) > np.hypot(*missed) + _CONVERGED
            if not worse.any():
                break
            share[worse] /= 2
        at, found, missed = at - share * step, trial, left
    slope = found.x**2 + found.y**2
    return found.h + radius / np.sqrt(1 + slope), slope


def _missed(field: HeightField, radius: float, at: np.ndarray, wanted: np.ndarray) -> tuple[Heights, np.ndarray]:
    """Return the heights of the ground at places, and by how much the centres above them miss the wanted ones, m."""
    found = field.derivatives(*at)
    length = np.sqrt(1 + found.x**2 + found.y**2)
    return found, at - radius * np.stack([found.x, found.y]) / length - wanted


def _newton_step(at: Heights, radius: float, missed: np.ndarray) -> np.ndarray:
    """Return the solution of (1 - r d(grad h / length)) step = missed, d(g / w) = (1 - g g^T / w^2) h'' / w."""
    slopes = np.stack([at.x, at.y])
    square = 1 + (slopes**2).sum(axis=0)
    hessian = np.array([[at.xx, at.xy], [at.xy, at.yy]])
    turned = np.einsum("i...,k...,kj...->ij...", slopes, slopes, hessian) / square
    matrix = np.eye(2)[:, :, None, None] - radius * (hessian - turned) / np.sqrt(square)
    (a, b), (c, d) = matrix
    determinant = a * d - b * c
    return np.stack([d * missed[0] - b * missed[1], a * missed[1] - c * missed[0]]) / determinant
