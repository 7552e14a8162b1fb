"""In which order feet step, from where they stand: groups that swing in turn while the others carry the robot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, permutations

import numpy as np

MOST_FEET = 6
"""That step; of seven or more there are too many orders to look at."""

_DECIMALS = 6
"""Of distances that are compared, m: what is symmetric is the same then, and the first order is taken."""

Groups = tuple[tuple[int, ...], ...]
"""Feet that swing together, one group after the other."""


@dataclass(frozen=True)
class Feet:
    """Where feet stand before and after a motion, seen from above.

    Attributes:
        start, goal: places, m, (n_feet, 2).
        stepping: those that stand elsewhere at the end; the others stay where they are.
        center_start, center_goal: of mass, m, (2).
    """

    start: np.ndarray
    goal: np.ndarray
    stepping: Sequence[int]
    center_start: np.ndarray
    center_goal: np.ndarray


def beyond_support(point: np.ndarray, feet: np.ndarray) -> float:
    """Return how far a point is outside the convex hull of feet, m; negative inside, by the distance from its edge.

        max over unit vectors d of  d^T x - max_i d^T x_i

    which is attained where d points from a foot to x, or is normal to a line through two feet.

    Args:
        point: x, m, (2).
        feet: x_i, m, (k, 2); one foot is a point, two are a line.
    """
    lines = np.array([b - a for a, b in permutations(feet, 2)]).reshape(-1, 2)
    directions = np.vstack([point - feet, lines @ [[0.0, 1.0], [-1.0, 0.0]]])
    lengths = np.linalg.norm(directions, axis=1)
    if not (lengths > 0).any():
        return 0.0
    directions = directions[lengths > 0] / lengths[lengths > 0, None]
    return float((directions @ point - (directions @ feet.T).max(axis=1)).max())


def footfall_sequences(feet: Feet, number: int = 0) -> list[Groups]:
    """Return in which orders feet may step, one for every size of groups, the largest groups first.

    The feet that step are split into groups of one size, fewer than stand. Splits and orders are ranked by how far the
    centre of mass is outside the support of the feet that stand, half way through every swing: first where that is
    most, then in the mean. With four feet at the corners of a rectangle the first are diagonal pairs, whose line of
    support passes below the centre of mass, and single feet in the order of a walk.

    Args:
        feet: where they stand.
        number: place in the ranking of the orders that are returned; after the last one it begins again.

    Returns:
        Nothing where no foot steps, or more than `MOST_FEET` do.
    """
    stepping, count = tuple(feet.stepping), len(feet.stepping)
    if not 0 < count <= MOST_FEET:
        return []
    sizes = [size for size in range(count, 0, -1) if count % size == 0 and size < len(feet.start)]
    ranked = [sorted(_orders(stepping, size), key=lambda groups: _instability(feet, groups)) for size in sizes]
    return [orders[number % len(orders)] for orders in ranked]


def _orders(feet: Sequence[int], size: int) -> Iterator[Groups]:
    """Yield all ways to split feet into groups of a size, in all orders."""
    if not feet:
        yield ()
    for group in combinations(feet, size):
        for rest in _orders([foot for foot in feet if foot not in group], size):
            yield (group, *rest)


def _instability(feet: Feet, groups: Groups) -> tuple[float, float]:
    """Return how far the centre of mass is outside the support half way through swings, at most and in the mean, m."""
    places, found = feet.start.copy(), []
    for number, group in enumerate(groups):
        way = (number + 0.5) / len(groups)
        center = (1 - way) * feet.center_start + way * feet.center_goal
        standing = [foot for foot in range(len(places)) if foot not in group]
        found.append(beyond_support(center, places[standing]))
        places[list(group)] = feet.goal[list(group)]
    return round(max(found), _DECIMALS), round(float(np.mean(found)), _DECIMALS)
