"""A linear program in a box, with a lower bound that does not depend on how well it was solved."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from scipy import sparse

from fesd_robot.native import kkt_library
from fesd_robot.nlp.large_linear_program import LinearProgram, casadi_matrix, interior_solution

MANY_UNKNOWNS = 2000
"""Unknowns of a linear program from which HiGHS's interior-point method is used: a robot in space has thousands, and
the simplex method then takes several times as long."""

IPOPT_UNKNOWNS = 5000
"""Unknowns from which IPOPT comes before it: that takes half of the time of a motion's program, but ten times that of
one without its structure."""

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

    A large program is solved by an interior-point method without crossover: a vertex takes it several times as long as
    an interior solution, and tells no more. HiGHS needs a basis to begin with, and gives up where small pivots make
    that singular; IPOPT needs none.

    Args:
        cost, low, high: (n,).
        matrix: A, (m, n).
        row_low, row_high: (m,), infinite where there is none.
        seconds: time limit.

    Returns:
        None if time or the solvers gave out.
    """
    if seconds <= 0:
        return None
    begin, columns = time.perf_counter(), sparse.csc_array(matrix)
    columns.sort_indices()
    program = LinearProgram(cost, columns, row_low, row_high, low, high)

    def solution(s: np.ndarray, y: np.ndarray) -> LinearSolution | None:
        y = np.where(y > 0, np.where(np.isfinite(row_low), y, 0.0), np.where(np.isfinite(row_high), y, 0.0))
        rest, value, rows = cost - columns.T @ y, float(cost @ s), y != 0
        bound = float(np.where(y > 0, row_low, row_high)[rows] @ y[rows] + np.minimum(rest * low, rest * high).sum())
        return LinearSolution(value, min(bound, value), s, y) if abs(value - bound) <= _LARGEST_GAP else None

    if len(cost) > IPOPT_UNKNOWNS and kkt_library():
        found = interior_solution(program, seconds=seconds, enough=lambda s, y: solution(s, y) is not None)
        if found:
            return solution(*found)
    found = _highs(program, seconds - (time.perf_counter() - begin))
    return solution(*found) if found else None


def _highs(program: LinearProgram, seconds: float) -> tuple[np.ndarray, np.ndarray] | None:
    """Return s and the multipliers of the rows, None if time or HiGHS gave out."""
    if seconds <= 0:
        return None
    n, matrix = len(program.cost), casadi_matrix(program.matrix)
    options: dict[str, Any] = {"output_flag": False, "time_limit": float(seconds), "threads": 1}
    if n > MANY_UNKNOWNS:
        options |= {"solver": "ipm", "run_crossover": "off", "ipm_optimality_tolerance": 1e-7}
    shape = {"h": ca.Sparsity(n, n), "a": matrix.sparsity()}
    solver = ca.conic("linear_program", "highs", shape, {"highs": options, "error_on_fail": False})
    found = solver(
        g=program.cost, a=matrix, lbx=program.low, ubx=program.high, lba=program.row_low, uba=program.row_high
    )
    s, y = np.asarray(found["x"]).ravel(), -np.asarray(found["lam_a"]).ravel()
    return (s, y) if solver.stats()["success"] and np.isfinite(s).all() and np.isfinite(y).all() else None
