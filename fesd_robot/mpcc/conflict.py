"""Conflicting constraints where no motion is feasible: the bounds that the least violation rests on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.optimize import linprog

from fesd_robot.complementarity import Label
from fesd_robot.mpcc.derivatives import linearise, row_sizes
from fesd_robot.mpcc.polishing import BranchBounds
from fesd_robot.mpcc.problem import Mpcc

TRUST = 1.0
"""How far the variables may move from the point, relative to one plus their size."""

LEAST_VIOLATION = 1e-6
"""Sum of the violations below which the linear program finds nothing in the way."""


@dataclass(frozen=True)
class Demand:
    """A bound that the least violation rests on.

    Attributes:
        label: of the variable.
        bound: its value.
        upper: whether it is an upper bound.
        price: by how much the violation falls when the bound is moved, times one plus its size.
    """

    label: Label
    bound: float
    upper: bool
    price: float


@dataclass(frozen=True)
class Conflict:
    """Demands that no motion near a point meets together.

    Attributes:
        violation: least sum of violations.
        demands: bounds that it rests on, the largest price first.
    """

    violation: float
    demands: tuple[Demand, ...]


def conflict_at(problem: Mpcc, bounds: BranchBounds, w: np.ndarray, seconds: float) -> Conflict | None:
    """Return the conflicting constraints at w to first order; None if there are none, or they are not found.

    min sum(s) over d and s >= 0 with g_lower - s <= g + J d <= g_upper + s, lower <= w + d <= upper, |d| <= trust: the
    Lagrange multipliers of the bounds on variables are the prices. Rows are divided by their largest derivative.

    Args:
        problem: a branch NLP, without pairs.
        bounds: of its branch.
        w: the point, (n).
        seconds: that it may take.

    Source: the elastic problem of SQP's feasibility restoration (Fletcher, Leyffer 2002), as a linear program.
    """
    at = linearise(problem, np.clip(w, bounds.lower, bounds.upper))
    size = np.maximum(1.0, row_sizes(at.g_jacobian))
    matrix = sparse.csr_array(at.g_jacobian / size[:, None])
    low, high = (bounds.g_lower - at.g) / size, (bounds.g_upper - at.g) / size
    below, above = np.isfinite(low), np.isfinite(high)
    rows = sparse.csr_array(sparse.vstack([-matrix[below], matrix[above]]))
    n, slacks, scale = len(at.w), rows.shape[0], 1.0 + np.abs(at.w)
    d_low = np.maximum(bounds.lower - at.w, -TRUST * scale)
    d_high = np.minimum(bounds.upper - at.w, TRUST * scale)
    result = linprog(
        np.append(np.zeros(n), np.ones(slacks)),
        A_ub=sparse.csr_array(sparse.hstack([rows, -sparse.eye_array(slacks)])),
        b_ub=np.append(-low[below], high[above]),
        bounds=np.column_stack([np.append(d_low, np.zeros(slacks)), np.append(d_high, np.full(slacks, np.inf))]),
        method="highs",
        options={"time_limit": seconds},
    )
    if result.status != 0 or result.fun < LEAST_VIOLATION:
        return None
    sides = (
        (False, bounds.lower, result.lower.marginals[:n], bounds.lower - at.w > -TRUST * scale),
        (True, bounds.upper, -result.upper.marginals[:n], bounds.upper - at.w < TRUST * scale),
    )
    demands = [
        Demand(problem.variable_label(int(i)), float(bound[i]), upper, float(price[i] * scale[i]))
        for upper, bound, price, is_bound in sides
        for i in np.flatnonzero(is_bound & (price > 0))
    ]
    return Conflict(float(result.fun), tuple(sorted(demands, key=lambda demand: -demand.price)))
