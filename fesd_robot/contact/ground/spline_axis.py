"""Cubic B-splines along one axis of a height map, for CasADi expressions and for numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from scipy.interpolate import BSpline

_LEVELLING = 1 / 15
"""Of the map's length: least length of each of the two pieces over which it levels off beyond an end."""

_LEVEL = 2
"""Pieces beyond an end; with as many equal coefficients more, value, slope and curvature are level at its far side."""


class Chosen(NamedTuple):
    """The four splines that are not zero at a place, numbered 4 j + i for i = 0 to 3, as expressions.

    Attributes:
        weights: for every i: number of a spline -> 1 if it is the one, else 0.
        coefficients: entry (i, p) of step^p in the polynomial of the one, SX (4, 4).
        step: how far the place is from the left end of its piece, m.
    """

    weights: list[dict[int, ca.SX]]
    coefficients: ca.SX
    step: ca.SX


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

    def expressions(self, at: ca.SX) -> Chosen:
        """Return the four splines that are not zero at a place, without branches.

        Of the splines numbered 4 j + i exactly one is not zero: it is chosen by weights 0 and 1, and so are the
        coefficients of its polynomial. Derivatives of the weights are zero.
        """
        inside = ca.fmin(ca.fmax(at, self.breaks[0]), self.breaks[-1])
        passed = [ca.SX(1), *(inside >= edge for edge in self.breaks[1:-1]), ca.SX(0)]
        here = [passed[k] - passed[k + 1] for k in range(self.pieces)]
        weights, coefficients = [], ca.SX(4, 4)
        for i in range(4):
            splines = range(i, self.count, 4)
            weights.append({j: passed[max(j - 3, 0)] - passed[min(j + 1, self.pieces)] for j in splines})
            for power in range(4):
                values = [self.coefficients[k, (i - k) % 4, power] for k in range(self.pieces)]
                coefficients[i, power] = sum(one * value for one, value in zip(here, values, strict=True))
        step = inside - sum(one * edge for one, edge in zip(here, self.breaks[:-1], strict=True))
        return Chosen(weights, coefficients, step)


def taylor(coefficients: Sequence[Any], step: Any) -> tuple[Any, Any, Any]:
    """Return a polynomial with its first and second derivative, by Horner's rule, of numbers or expressions.

    Args:
        coefficients: of step^0, step^1, ...
    """
    value, slope, half_curvature = coefficients[-1], 0.0, 0.0
    for coefficient in reversed(coefficients[:-1]):
        half_curvature = half_curvature * step + slope
        slope = slope * step + value
        value = value * step + coefficient
    return value, slope, 2.0 * half_curvature
