"""Whether the motion that is taken at a point is the only one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fesd_robot.fesd.adaptive.point_modes import Point, PointMode, PointModes

SHOWN = 4
"""Other modes that a note names."""

SAME_RATE = 1e-2
"""Relative difference of rates up to which a mode that has been taken is one that is found again."""


def different(found: Sequence[PointMode]) -> list[PointMode]:
    """Return the modes whose rates differ from those of all before them; the first is one of them."""
    kept: list[PointMode] = []
    largest = max((float(np.abs(one.rate).max()) for one in found), default=0.0)
    for one in found:
        if all(np.abs(one.rate - other.rate).max() > 1e-6 * (1.0 + largest) for other in kept):
            kept.append(one)
    return kept


def several(points: PointModes, found: Sequence[PointMode]) -> str | None:
    """Return a sentence if several motions go on from a point; the first is taken."""
    motions = different(found)
    if len(motions) < 2:
        return None
    taken, others = points.system.in_words(motions[0].mode), _some_names(points, motions[1:])
    return f"not unique: {taken} is taken, but other motions go on from here, too ({others})"


def repelling(
    points: PointModes, point: Point, mode: np.ndarray, closed: np.ndarray, rate: np.ndarray, *, begins: bool = False
) -> str | None:
    """Return a sentence if a mode that goes on can be left at a point although no sign is wrong.

    Args:
        points: the modes of points.
        point: x, u, z, p.
        mode: the one that is taken, (n_pairs).
        closed: pairs whose G is zero there, (n_pairs).
        rate: dx/dt, (n_x).
        begins: whether the mode begins there; else only surfaces that are met or intersect are looked at.
    """
    found = points.fitting(point, closed, mode, closed if begins else _undecided(points, mode, closed))
    limit = max(1e-6, SAME_RATE * float(np.abs(rate).max()))
    others = [one for one in different(found) if np.abs(one.rate - rate).max() > limit]
    if not others:
        return None
    taken = points.system.in_words(mode)
    return f"not unique: {taken} goes on, but other motions do from here, too ({_some_names(points, others)})"


def _some_names(points: PointModes, modes: Sequence[PointMode]) -> str:
    more = f"; {len(modes) - SHOWN} more" if len(modes) > SHOWN else ""
    return "; ".join(points.system.in_words(one.mode) for one in modes[:SHOWN]) + more


def _undecided(points: PointModes, mode: np.ndarray, closed: np.ndarray) -> np.ndarray:
    """Return the pairs that could change: those of surfaces that are met, and of surfaces slid on that intersect."""
    undecided = closed & ~mode
    for component in points.groups.components:
        sliding = [g for g in component if mode[points.groups.groups[g]].sum() > 1]
        if len(sliding) > 1:
            undecided[np.concatenate([points.groups.groups[g] for g in sliding])] = True
    return undecided
