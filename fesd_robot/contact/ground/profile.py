"""The height of a ground along x as a piecewise polynomial, for numbers and for CasADi expressions."""

from __future__ import annotations

import bisect
import itertools
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from scipy.interpolate import PPoly

from fesd_robot.errors import GroundError
from fesd_robot.ranges import STEEPEST

MAX_PIECES = 1000
"""Polynomials of a profile; every evaluation of a CasADi expression looks at all of them."""

_SAMPLES = np.linspace(0.0, 1.0, 33)
"""Where a piece is looked at for extrema of its derivatives."""


@dataclass(frozen=True, eq=False)
class Profile:
    """z = h(x), twice continuously differentiable, polynomial between breaks and level beyond them.

    Args:
        breaks: x of the ends of the pieces, m, increasing, (n + 1).
        coefficients: h = sum_k coefficients[k, i] (x - breaks[i])^k on piece i, (degree + 1, n).

    Raises:
        GroundError: too many pieces, or the ground is steeper than `STEEPEST` somewhere.
    """

    breaks: np.ndarray
    coefficients: np.ndarray

    def __post_init__(self) -> None:
        pieces = self.coefficients.shape[1]
        if pieces > MAX_PIECES:
            raise GroundError(f"found a ground of {pieces} pieces, expected at most {MAX_PIECES}")
        x, slope = self.sampled(1)
        worst = int(np.argmax(np.abs(slope)))
        if abs(slope[worst]) > STEEPEST:
            raise GroundError(
                f"found a slope of {slope[worst]:.4g} at x = {x[worst]:.4g} m, expected at most {STEEPEST:g} up or "
                "down; a vertical face is a wall"
            )

    @classmethod
    def from_piecewise(cls, polynomial: PPoly) -> Profile:
        """Return the profile of scipy's piecewise polynomial, whose two ends must be level."""
        return cls(np.array(polynomial.x), np.array(polynomial.c[::-1]))

    def numbers(self, x: float) -> tuple[float, float, float]:
        """Return h, dh/dx and d2h/dx2 at x, as `derivatives` does, in a fraction of its time."""
        edges, pieces = self._lists
        inside = min(max(x, edges[0]), edges[-1])
        piece = min(bisect.bisect_right(edges, inside), len(pieces)) - 1
        step, height, slope, half_curvature = inside - edges[piece], 0.0, 0.0, 0.0
        for coefficient in pieces[piece]:
            half_curvature = half_curvature * step + slope
            slope = slope * step + height
            height = height * step + coefficient
        return (height, slope, 2.0 * half_curvature) if inside == x else (height, 0.0, 0.0)

    def derivatives(self, x: np.ndarray) -> np.ndarray:
        """Return h, dh/dx and d2h/dx2 at many x, (3, n), by scipy."""
        inside = np.clip(x, self.breaks[0], self.breaks[-1])
        derivatives = np.array([self._piecewise(inside, order) for order in range(3)])
        derivatives[1:, inside != x] = 0.0
        return derivatives

    def expressions(self, x: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Return h and dh/dx as expressions without branches.

        The coefficients of the piece that holds x are a sum over all pieces with weights 0 and 1, whose derivatives
        are zero; so derivatives of any order are as large as those of one polynomial.
        """
        passed = [x >= edge for edge in self.breaks]
        weights = [here - beyond for here, beyond in itertools.pairwise(passed)]
        before, after = 1 - passed[0], passed[-1]
        ends = (self.numbers(self.breaks[0])[0], self.numbers(self.breaks[-1])[0])
        left = _chosen([*weights, before, after], [*self.breaks[:-1], self.breaks[0], self.breaks[-1]])
        chosen = [_chosen([*weights, before, after], [*self.coefficients[0], *ends])]
        chosen += [_chosen(weights, row) for row in self.coefficients[1:]]
        step = x - left
        height, slope = ca.SX(0), ca.SX(0)
        for power in range(len(chosen) - 1, -1, -1):
            height = height * step + chosen[power]
            if power:
                slope = slope * step + power * chosen[power]
        return height, slope

    def sampled(self, order: int) -> tuple[np.ndarray, np.ndarray]:
        """Return x and the derivative of h of that order at many points of every piece."""
        lengths = np.diff(self.breaks)
        x = (self.breaks[:-1, None] + lengths[:, None] * _SAMPLES[None, :]).ravel()
        return x, np.asarray(self._piecewise(x, order))

    @cached_property
    def curvature(self) -> float:
        """Largest |d2h/dx2|, 1/m."""
        return float(np.abs(self.sampled(2)[1]).max())

    @cached_property
    def _lists(self) -> tuple[list[float], list[list[float]]]:
        """The breaks, and the coefficients of every piece from the highest power down."""
        return self.breaks.tolist(), self.coefficients[::-1].T.tolist()

    @cached_property
    def _piecewise(self) -> PPoly:
        return PPoly(self.coefficients[::-1], self.breaks)


def _chosen(weights: list[ca.SX], values: np.ndarray | list[float]) -> ca.SX:
    """Return the value whose weight is one."""
    return sum((weight * value for weight, value in zip(weights, values, strict=True) if value != 0.0), ca.SX(0))
