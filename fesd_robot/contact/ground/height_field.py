"""An uneven ground whose height depends on x and y."""

from __future__ import annotations

import bisect
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from scipy.interpolate import NdBSpline

from fesd_robot.contact.ground.spline_axis import SplineAxis, taylor
from fesd_robot.contact.ground.surface import Axes, turned_axes
from fesd_robot.errors import GroundError
from fesd_robot.ranges import STEEPEST

MAX_POINTS = 10_000
"""Points of a height map: every evaluation of a CasADi expression looks at all of them."""

_SAMPLES = 5
"""Along each axis of a piece: where it is looked at for extrema of its derivatives."""

_ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))


class Heights(NamedTuple):
    """h and its derivatives at a place: numbers, arrays or expressions."""

    h: Any
    x: Any
    y: Any
    xx: Any
    xy: Any
    yy: Any


@dataclass(frozen=True, eq=False)
class HeightField:
    """The ground below z = h(x, y): f = g / sqrt(1 + |grad h|^2 / (1 + (g / l)^2)) with g = z - h, l = 1 / max |h''|.

    h is a sum of products of cubic B-splines along x and y, twice continuously differentiable; max |h''| is its largest
    curvature in any direction. Near the ground f is the distance to the tangent plane below the point, and on it the
    gradient of f is the unit normal exactly; far above it becomes the height g, as for `Terrain`.

    Args:
        along, across: splines along x and y.
        coefficients: (n_x + 3, n_y + 3).

    Raises:
        GroundError: the ground is steeper than `STEEPEST` somewhere.
    """

    along: SplineAxis
    across: SplineAxis
    coefficients: np.ndarray

    varies_across = True

    def __post_init__(self) -> None:
        x, y, sampled = self._sampled
        slope = np.hypot(sampled.x, sampled.y)
        i, j = np.unravel_index(int(np.argmax(slope)), slope.shape)
        if slope[i, j] > STEEPEST:
            raise GroundError(
                f"found a slope of {slope[i, j]:.4g} at x = {x[i]:.4g}, y = {y[j]:.4g} m, expected at most "
                f"{STEEPEST:g}; a vertical face is a wall"
            )

    @classmethod
    def through(cls, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> HeightField:
        """Return the natural bicubic spline through the points of a grid.

        Beyond its borders the ground levels off over two fifteenths of the map's length, or two of its steps if longer.

        Args:
            x, y: m, increasing, (n_x) and (n_y), two at least. z: m, (n_x, n_y).
        """
        along, across = SplineAxis.through(x), SplineAxis.through(y)
        return cls(along, across, across.through_rows(along.through_rows(z).T).T)

    def numbers(self, x: float, y: float) -> Heights:
        """Return h and its derivatives at a place, from the polynomials of its piece."""
        edges, others, polynomials = self._lists
        i, x_step, x_inside = _piece(edges, x)
        j, y_step, y_inside = _piece(others, y)
        found = _heights(polynomials[i][j], x_step, y_step)
        if x_inside and y_inside:
            return found
        along, across = float(x_inside), float(y_inside)
        return Heights(
            found.h, along * found.x, across * found.y, along * found.xx, along * across * found.xy, across * found.yy
        )

    def derivatives(self, x: np.ndarray, y: np.ndarray) -> Heights:
        """Return h and its derivatives at many places, (n) each, by scipy."""
        inside = [np.clip(at, axis.breaks[0], axis.breaks[-1]) for at, axis in ((x, self.along), (y, self.across))]
        places = np.stack(inside, axis=-1)
        found = [np.asarray(self._spline(places, nu=orders)) for orders in _ORDERS]
        for value, orders in zip(found, _ORDERS, strict=True):
            beyond = [order * (clipped != at) for order, clipped, at in zip(orders, inside, (x, y), strict=True)]
            value[np.any(beyond, axis=0)] = 0.0
        return Heights(*found)

    def expressions(self, x: ca.SX, y: ca.SX) -> Heights:
        """Return h and its derivatives as expressions without branches, of about (n_x + 3) (n_y + 3) products."""
        along, across = self.along.expressions(x), self.across.expressions(y)
        local = ca.SX(4, 4)
        for i, chosen in enumerate(along.weights):
            row = [
                sum(weight * self.coefficients[k, j] for k, weight in chosen.items()) for j in range(self.across.count)
            ]
            for j, other in enumerate(across.weights):
                local[i, j] = sum(weight * row[k] for k, weight in other.items())
        # The coefficients of the polynomial consist of weights only: to differentiate it costs what a polynomial costs.
        table = ca.mtimes([along.coefficients.T, local, across.coefficients])
        return _heights([ca.horzsplit(row) for row in ca.vertsplit(table)], along.step, across.step)

    def distance(self, point: Any) -> Any:
        """Return the gap f of a point (x, y, z), m."""
        at = self._at(point)
        above = point[2] - at.h
        return above * (1 + (at.x**2 + at.y**2) / (1 + (self.curvature * above) ** 2)) ** -0.5

    def normal(self, point: Any) -> Any:
        """Return the gradient of f, (3,)."""
        at = self._at(point)
        above = point[2] - at.h
        fade = 1 / (1 + (self.curvature * above) ** 2)
        root = 1 + (at.x**2 + at.y**2) * fade
        by_height = root**-0.5 + (at.x**2 + at.y**2) * (self.curvature * above * fade) ** 2 * root**-1.5
        by_slopes = -above * fade * root**-1.5
        parts = [
            -at.x * by_height + (at.x * at.xx + at.y * at.xy) * by_slopes,
            -at.y * by_height + (at.x * at.xy + at.y * at.yy) * by_slopes,
            by_height,
        ]
        return ca.vertcat(*parts) if isinstance(parts[0], ca.SX) else np.array(parts)

    def axes(self, point: Any) -> Axes:
        """Return the unit normal of the ground below the point, and tangents."""
        at = self._at(point)
        length = (1 + at.x**2 + at.y**2) ** 0.5
        parts = [-at.x / length, -at.y / length, 1 / length]
        return turned_axes(ca.vertcat(*parts) if isinstance(length, ca.SX) else np.array(parts))

    def distances(self, points: np.ndarray) -> np.ndarray:
        """Return the distance of many points, (3, n), from the tangent planes below them, m, (n)."""
        at = self.derivatives(points[0], points[1])
        return np.asarray((points[2] - at.h) / np.sqrt(1 + at.x**2 + at.y**2))

    def raised(self, radius: float) -> HeightField:
        """Return the ground through points at distance `radius`, m, along the normals."""
        from fesd_robot.contact.ground.raised_field import raised_field

        return raised_field(self, radius)

    def heights(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the heights at many places, m."""
        return np.asarray(self.derivatives(x, y).h)

    def bends(self, low: float, high: float) -> np.ndarray:
        """Return several x of every piece, m, increasing."""
        x = self.sampled_places[0]
        return x[(low < x) & (x < high)]

    def heights_in_words(self) -> str:
        """Say where it is uneven, and how high there."""
        x, y, at = self._sampled
        return (
            f"For x from {x[0]:.4g} to {x[-1]:.4g} m and y from {y[0]:.4g} to {y[-1]:.4g} m its heights are "
            f"{at.h.min():.4g} to {at.h.max():.4g} m; it goes on level beyond."
        )

    @cached_property
    def curvature(self) -> float:
        """Largest |h''| in any direction, 1/m."""
        at = self._sampled[2]
        return float((np.abs(at.xx + at.yy) / 2 + np.hypot((at.xx - at.yy) / 2, at.xy)).max())

    @property
    def sampled_places(self) -> tuple[np.ndarray, np.ndarray]:
        """x and y of a grid with several lines in every piece, m."""
        return self._sampled[0], self._sampled[1]

    def _at(self, point: Any) -> Heights:
        if isinstance(point[0], ca.SX):
            return self.expressions(point[0], point[1])
        return self.numbers(float(point[0]), float(point[1]))

    @cached_property
    def _sampled(self) -> tuple[np.ndarray, np.ndarray, Heights]:
        """x, y and everything there, (n, m)."""
        x, y = (
            np.append(
                (axis.breaks[:-1, None] + np.diff(axis.breaks)[:, None] * np.linspace(0, 1, _SAMPLES)[:-1]).ravel(),
                axis.breaks[-1],
            )
            for axis in (self.along, self.across)
        )
        return x, y, self.derivatives(*np.meshgrid(x, y, indexing="ij"))

    @cached_property
    def _spline(self) -> NdBSpline:
        return NdBSpline((self.along.knots, self.across.knots), self.coefficients, 3)

    @cached_property
    def _lists(self) -> tuple[list[float], list[float], list[Any]]:
        """The breaks along x and y, and entry (i, j, p, r): of (x - x_i)^p (y - y_j)^r on piece (i, j)."""
        local = np.lib.stride_tricks.sliding_window_view(self.coefficients, (4, 4))
        table = np.einsum("iap,ijab,jbr->ijpr", self.along.coefficients, local, self.across.coefficients, optimize=True)
        return self.along.breaks.tolist(), self.across.breaks.tolist(), table.tolist()


def _piece(edges: list[float], at: float) -> tuple[int, float, bool]:
    """Return the number of the piece that holds a place, how far it is from its left end, and whether it is inside."""
    inside = min(max(at, edges[0]), edges[-1])
    piece = min(bisect.bisect_right(edges, inside), len(edges) - 1) - 1
    return piece, inside - edges[piece], inside == at


def _heights(table: Sequence[Sequence[Any]], x_step: Any, y_step: Any) -> Heights:
    """Return the value and derivatives of the sum of table[p][r] x_step^p y_step^r, numbers or expressions."""
    by_y = list(zip(*(taylor(row, y_step) for row in table), strict=True))
    h, x, xx = taylor(by_y[0], x_step)
    y, xy, _ = taylor(by_y[1], x_step)
    return Heights(h, x, y, xx, xy, taylor(by_y[2], x_step)[0])
