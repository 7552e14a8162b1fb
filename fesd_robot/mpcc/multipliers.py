"""The stationarity equation of an MPCC at a point, and the Lagrange multipliers that solve it best for given signs."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy import sparse
from scipy.optimize import linprog

from fesd_robot.mpcc.derivatives import ActiveSet, Linearisation, repeated_bounds, row_scales
from fesd_robot.mpcc.linear_program import MANY_UNKNOWNS, solve_linear_program

_MULTIPLIER_PRICE = 1e-7
"""Price of a scaled Lagrange multiplier against a residual: one of more than its inverse does not count as existing."""

_HIGHS_ATTEMPTS = (
    ("highs", 1e-8, _MULTIPLIER_PRICE),
    ("highs-ipm", 1e-7, _MULTIPLIER_PRICE),
    ("highs", 1e-7, _MULTIPLIER_PRICE),
    ("highs", 1e-7, 0.0),
    ("highs", 1e-6, 0.0),
)
"""HiGHS methods, tolerances and prices, tried in turn: on degenerate problems it gives up on some of them."""

_RESIDUAL_MISMATCH = 5e-7
"""By how much a residual may exceed what HiGHS claims; beyond, its multipliers are round-off and the next is tried."""

_ROUND_OFF = 1e-13
"""Entries of a row of largest entry 1 that are round-off."""


@dataclass(frozen=True)
class Multipliers:
    """Lagrange multipliers of bounds (n,), g (n_g,) and sides G, H (n_pairs,), in units of f over the constraint's.

    Attributes:
        lower, upper: of the bounds on the variables, >= 0.
        g: of g, positive at an upper bound and negative at a lower one.
        G, H: nu and xi, of the sides of the pairs.
    """

    lower: np.ndarray
    upper: np.ndarray
    g: np.ndarray
    G: np.ndarray
    H: np.ndarray

    @property
    def largest(self) -> float:
        """The largest absolute value; a huge one belongs to a point where multipliers hardly exist."""
        return max((float(abs(part).max()) for part in vars(self).values() if part.size), default=0.0)


@dataclass(frozen=True)
class StationarityEquation:
    """c + A y = 0 with low <= y <= high, bounds 0 or infinite; c and the columns of A have no entry above 1.

    Attributes:
        c: grad f / max(1, max abs(grad f)), (n,).
        rows: the transpose of A, one row per active bound, row of g, or side, shape (m, n).
        low, high: what weak stationarity allows, (m,).
        pairs: where nu and xi of every biactive pair sit in y, shape (biactive, 2).
        pair_rows: which pairs these are, (biactive,).
        unpack: y -> Lagrange multipliers in the problem's units.
    """

    c: np.ndarray
    rows: sparse.csr_array
    low: np.ndarray
    high: np.ndarray
    pairs: np.ndarray
    pair_rows: np.ndarray
    unpack: Callable[[np.ndarray], Multipliers] = field(repr=False)

    def residual(self, y: np.ndarray) -> float:
        """Return max abs(c + A y)."""
        return float(abs(self.c + self.rows.T @ y).max(initial=0.0))


def stationarity_equation(at: Linearisation, active: ActiveSet) -> StationarityEquation:
    """Return the equation of weak stationarity, scaled.

    Args:
        at: expansion at a point.
        active: what counts as zero there.
    """
    n, size = len(at.w), max(1.0, float(abs(at.gradient).max(initial=0.0)))
    coincident_lower, coincident_upper = repeated_bounds(at, active)
    where = [
        np.flatnonzero(part)
        for part in (
            active.lower & ~coincident_lower,
            active.upper & ~coincident_upper,
            active.g_lower | active.g_upper,
            active.G,
            active.H,
        )
    ]
    identity = sparse.csr_array(sparse.eye_array(n))
    rows = sparse.csr_array(
        sparse.vstack(
            [
                -identity[where[0]],
                identity[where[1]],
                at.g_jacobian[where[2]],
                -at.G_jacobian[where[3]],
                -at.H_jacobian[where[4]],
            ]
        )
    )
    scale = row_scales(rows)
    free_xi = ~at.vanishing | (at.G > 0) | active.G
    low = [
        np.zeros(len(where[0]) + len(where[1])),
        np.where(active.g_lower, -np.inf, 0.0)[where[2]],
        np.full(len(where[3]), -np.inf),
        np.where(free_xi, -np.inf, 0.0)[where[4]],
    ]
    high = [
        np.full(len(where[0]) + len(where[1]), np.inf),
        np.where(active.g_upper, np.inf, 0.0)[where[2]],
        np.where(at.vanishing, 0.0, np.inf)[where[3]],
        np.full(len(where[4]), np.inf),
    ]
    ends = np.cumsum([len(part) for part in where])
    biactive = np.flatnonzero(active.biactive)
    pairs = np.array([ends[2] + np.searchsorted(where[3], biactive), ends[3] + np.searchsorted(where[4], biactive)]).T

    def unpack(y: np.ndarray) -> Multipliers:
        lengths = (n, n, len(at.g), len(at.G), len(at.H))
        parts = [np.zeros(length) for length in lengths]
        for part, index, values in zip(parts, where, np.split(y * size / scale, ends[:-1]), strict=True):
            part[index] = values
        return Multipliers(*parts)

    rows = sparse.csr_array(sparse.diags_array(1.0 / scale) @ rows)
    rows.data[abs(rows.data) < _ROUND_OFF] = 0.0
    rows.eliminate_zeros()
    return StationarityEquation(
        at.gradient / size, rows, np.concatenate(low), np.concatenate(high), pairs, biactive, unpack
    )


def least_residual(
    equation: StationarityEquation, low: np.ndarray, high: np.ndarray, deadline: float, sign_cost: float = 0.0
) -> np.ndarray | None:
    """Return the y in its box with the least ||c + A y||_1 + sign_cost sum of max(0, -y) over biactive pairs.

    y are the multipliers of the linear program min c^T s, abs(s) <= 1, with A_j^T s <= price where y_j may be positive
    and A_j^T s >= -price, for biactive pairs A_j^T s >= -price - sign_cost, where it may be negative. Its optimum is
    minus the minimum asked for, with price ||y||_1 added; posed this way HiGHS sees bounded unknowns only, and of many
    multipliers finds small ones.

    Args:
        equation: the equation.
        low, high: the box, 0 or infinite, (m,).
        deadline: when to stop, in the time of `time.perf_counter`.
        sign_cost: price of a negative multiplier of a biactive pair.

    Returns:
        y of shape (m,), or None if time or HiGHS gave out.
    """
    extra = np.zeros(len(low))
    extra[equation.pairs.ravel()] = sign_cost
    negative, positive = low < 0, high > 0
    if len(equation.c) > MANY_UNKNOWNS:
        box = np.ones(len(equation.c))
        row_low = np.where(negative, -_MULTIPLIER_PRICE - extra, -np.inf)
        row_high = np.where(positive, _MULTIPLIER_PRICE, np.inf)
        remaining = deadline - time.perf_counter()
        solved = solve_linear_program(equation.c, equation.rows, row_low, row_high, -box, box, remaining)
        if solved is not None:
            y = np.clip(-solved.multipliers, low, high)
            if equation.residual(y) <= _RESIDUAL_MISMATCH - solved.value:
                return y
    for method, tolerance, price in _HIGHS_ATTEMPTS:
        free = negative & positive & (price + extra == 0.0)
        equal, below, above = (np.flatnonzero(part) for part in (free, positive & ~free, negative & ~free))
        remaining = deadline - time.perf_counter()
        if remaining <= 0:
            return None
        result = linprog(
            equation.c,
            A_ub=sparse.csc_array(sparse.vstack([equation.rows[below], -equation.rows[above]])),
            b_ub=np.concatenate([np.full(len(below), price), price + extra[above]]),
            A_eq=sparse.csc_array(equation.rows[equal]),
            b_eq=np.zeros(len(equal)),
            bounds=(-1.0, 1.0),
            method=method,
            options={
                "primal_feasibility_tolerance": tolerance,
                "dual_feasibility_tolerance": tolerance,
                "time_limit": remaining,
            },
        )
        if result.status == 0:
            y = np.zeros(len(low))
            first, second = np.split(result.ineqlin.marginals, [len(below)])
            y[equal] = -result.eqlin.marginals
            y[below] -= first
            y[above] += second
            y = np.clip(y, low, high)
            if equation.residual(y) <= _RESIDUAL_MISMATCH - result.fun:
                return y
    return None
