"""A linear program in a box, solved by HiGHS, with a lower bound that does not depend on how well HiGHS solved it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from scipy import sparse

MANY_UNKNOWNS = 2000
"""Unknowns of a linear program from which HiGHS's interior-point method is used: a robot in space has thousands, and
the simplex method then takes several times as long."""

_LARGEST_GAP = 5e-6
"""Between the value of a solution and the bound from its multipliers; with a larger one it is none. The interior-point
method leaves 2e-6 for a quadruped in space, where multipliers of hundreds meet residuals of 1e-9."""


@dataclass(frozen=True)
class LinearSolution:
    """A solution of a linear program.

    Attributes:
        value: cost^T s.
        bound: lower bound on the optimum, from the Lagrange multipliers; at most `_LARGEST_GAP` below the value.
        s: (n,).
        multipliers: of the rows, positive at a lower bound and negative at an upper one, (m,).
    """

    value: float
    bound: float
    s: np.ndarray
    multipliers: np.ndarray


def solve_linear_program(
    cost: np.ndarray,
    matrix: sparse.sparray,
    row_low: np.ndarray,
    row_high: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    seconds: float,
) -> LinearSolution | None:
    """Return a solution of min cost^T s, row_low <= A s <= row_high, low <= s <= high with finite bounds on s.

    For multipliers y of the rows, of any accuracy, the sum over the box of the least (cost - A^T y)_j s_j and over the
    rows of the least y_i (A s)_i is a lower bound on the optimum. A solution is one if its value is that bound.

    A large program is solved by the interior-point method without crossover: a vertex takes it several times as long as
    an interior solution, and tells no more.

    Args:
        cost, low, high: (n,).
        matrix: A, (m, n).
        row_low, row_high: (m,), infinite where there is none.
        seconds: time limit.

    Returns:
        None if time or HiGHS gave out.
    """
    if seconds <= 0:
        return None
    columns = sparse.csc_array(matrix)
    columns.sort_indices()
    pattern = ca.Sparsity(len(row_low), len(cost), columns.indptr.tolist(), columns.indices.tolist())
    options: dict[str, Any] = {"output_flag": False, "time_limit": float(seconds), "threads": 1}
    if len(cost) > MANY_UNKNOWNS:
        options |= {"solver": "ipm", "run_crossover": "off", "ipm_optimality_tolerance": 1e-7}
    shape = {"h": ca.Sparsity(len(cost), len(cost)), "a": pattern}
    solver = ca.conic("linear_program", "highs", shape, {"highs": options, "error_on_fail": False})
    found = solver(g=cost, a=ca.DM(pattern, columns.data), lbx=low, ubx=high, lba=row_low, uba=row_high)
    s, y = np.asarray(found["x"]).ravel(), -np.asarray(found["lam_a"]).ravel()
    if not (solver.stats()["success"] and np.isfinite(s).all() and np.isfinite(y).all()):
        return None
    y = np.where(y > 0, np.where(np.isfinite(row_low), y, 0.0), np.where(np.isfinite(row_high), y, 0.0))
    rest = cost - columns.T @ y
    value = float(cost @ s)
    bound = float(np.where(y > 0, row_low, row_high)[y != 0] @ y[y != 0] + np.minimum(rest * low, rest * high).sum())
    return LinearSolution(value, min(bound, value), s, y) if value - bound <= _LARGEST_GAP else None
