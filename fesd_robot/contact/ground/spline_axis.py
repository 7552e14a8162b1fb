"""Cubic B-splines along one axis of a height map, for CasADi expressions and for numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np
from scipy.interpolate import BSpline

_LEVELLING = 0.05
"""Of the map's length: least length of each of the two pieces over which it levels off beyond an end."""

_LEVEL = 2
"""Pieces beyond an end; with as many equal coefficients more, value, slope and curvature are level at its far side."""


class Active(NamedTuple):
    """The one of every fourth spline that is not zero at a place, as expressions.

    Attributes:
        chosen: number of a spline -> 1 if it is the one, else 0.
        values: its value and its first and second derivative.
    """

    chosen: dict[int, ca.SX]
    values: tuple[ca.SX, ca.SX, ca.SX]


@dataclass(frozen=True, eq=False)
class SplineAxis:
    """Cubic B-splines on pieces between breaks; beyond the ends a place counts as the nearest end.

    Args:
        breaks: ends of the pieces, m, increasing, (n + 1).
    """

    breaks: np.ndarray

    @classmethod
    def through(cls, places: np.ndarray) -> SplineAxis:
        """Return the axis for a map with rows at these places, m, increasing, (n): with two pieces more at each end."""
        least = _LEVELLING * (places[-1] - places[0])
        before = places[0] - max(places[1] - places[0], least) * np.arange(_LEVEL, 0, -1)
        after = places[-1] + max(places[-1] - places[-2], least) * np.arange(1, _LEVEL + 1)
        return cls(np.concatenate([before, places, after]))

    @property
    def pieces(self) -> int:
        """Number of pieces n."""
        return len(self.breaks) - 1

    @property
    def count(self) -> int:
        """Number of splines, n + 3; on piece k those numbered k to k + 3 are not zero."""
        return self.pieces + 3

    @cached_property
    def knots(self) -> np.ndarray:
        """The breaks with three more at each end, (n + 7)."""
        steps = np.arange(1, 4)
        first, last = self.breaks[1] - self.breaks[0], self.breaks[-1] - self.breaks[-2]
        return np.concatenate([self.breaks[0] - first * steps[::-1], self.breaks, self.breaks[-1] + last * steps])

    @cached_property
    def coefficients(self) -> np.ndarray:
        """Entry (k, m, p): of (x - breaks[k])^p in spline k + m on piece k, (n, 4, 4)."""
        splines, of = BSpline(self.knots, np.eye(self.count), 3), np.arange(self.pieces)
        powers = np.array([splines(self.breaks[:-1], p) / math.factorial(p) for p in range(4)])
        return np.stack([powers[:, of, of + m].T for m in range(4)], axis=1)

    def through_rows(self, values: np.ndarray) -> np.ndarray:
        """Return the coefficients, (n + 3, m), of the natural splines through values at the places, (n - 3, m).

        Beyond the first and the last place the splines level off: their outermost three coefficients are equal.
        """
        places = self.breaks[_LEVEL:-_LEVEL]
        splines = BSpline(self.knots, np.eye(self.count), 3)
        ends = places[[0, -1]]
        rows = np.vstack([splines(places), splines(ends, 2)])[:, _LEVEL:-_LEVEL]
        inside = np.linalg.solve(rows, np.vstack([values, np.zeros((2, values.shape[1]))]))
        return np.pad(inside, ((_LEVEL, _LEVEL), (0, 0)), mode="edge")

    def expressions(self, at: ca.SX) -> list[Active]:
        """Return the four splines that are not zero at a place, without branches.

        Of the splines numbered 4 j + i exactly one is not zero anywhere, for i = 0 to 3: it is chosen by weights 0 and
        1, whose derivatives are zero, and its polynomial is a sum over the pieces with such weights.
        """
        inside = ca.fmin(ca.fmax(at, self.breaks[0]), self.breaks[-1])
        passed = [ca.SX(1), *(inside >= edge for edge in self.breaks[1:-1]), ca.SX(0)]
        weights = [passed[k] - passed[k + 1] for k in range(self.pieces)]
        step = inside - sum(weight * edge for weight, edge in zip(weights, self.breaks[:-1], strict=True))
        return [self._active(i, passed, weights, step) for i in range(4)]

    def _active(self, i: int, passed: list[ca.SX], weights: list[ca.SX], step: ca.SX) -> Active:
        chosen = {j: passed[max(j - 3, 0)] - passed[min(j + 1, self.pieces)] for j in range(i, self.count, 4)}
        own = [self.coefficients[k, (i - k) % 4] for k in range(self.pieces)]
        value, slope, half_curvature = ca.SX(0), ca.SX(0), ca.SX(0)
        for power in range(3, -1, -1):
            coefficient = sum(weight * row[power] for weight, row in zip(weights, own, strict=True))
            half_curvature = half_curvature * step + slope
            slope = slope * step + value
            value = value * step + coefficient
        return Active(chosen, (value, slope, 2 * half_curvature))
