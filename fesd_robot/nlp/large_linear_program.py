"""A large linear program in a box by IPOPT, whose linear solver knows the equations of a motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from scipy import sparse

from fesd_robot.nlp.casadi_solver import IterationCallback
from fesd_robot.nlp.ipopt import linear_program_options

ITERATIONS, TOLERANCE = 300, 1e-9
"""Of IPOPT."""

CURVATURE = 1e-9
"""Added to the cost, times s^T s / 2: where many solutions exist, the equations of an iteration have one."""

INFEASIBLE = 1e-8
"""Largest violation of a row or a bound by a solution."""


@dataclass(frozen=True)
class LinearProgram:
    """min cost^T s, row_low <= A s <= row_high, low <= s <= high.

    Attributes:
        cost, low, high: (n,), finite.
        matrix: A by columns, sorted, (m, n).
        row_low, row_high: (m,), infinite where there is none.
    """

    cost: np.ndarray
    matrix: sparse.csc_array
    row_low: np.ndarray
    row_high: np.ndarray
    low: np.ndarray
    high: np.ndarray


def casadi_matrix(columns: sparse.csc_array) -> ca.DM:
    """Return a sparse matrix, its columns sorted, as CasADi's."""
    (m, n), starts, indices = columns.shape, columns.indptr.tolist(), columns.indices.tolist()
    return ca.DM(ca.Sparsity(m, n, starts, indices), columns.data)


def interior_solution(
    program: LinearProgram, *, seconds: float, enough: Callable[[np.ndarray, np.ndarray], bool]
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return s and the multipliers of the rows of a linear program.

    Rows of one entry become bounds, rows that the box implies and columns without room are left out; then it is
    Mehrotra's predictor and corrector.

    Args:
        program: of thousands of unknowns.
        seconds: time limit.
        enough: of s and multipliers, whether that will do; asked once an iteration where s violates nothing.

    Returns:
        None unless `enough` says so of some iterate.

    Source: Mehrotra, SIAM J. Optim. 2, 1992; Waechter, Biegler, Math. Program. 106, 2006.
    """
    small = _Reduced(program)
    n, equations = len(small.cost), int((small.row_low == small.row_high).sum())
    idle = np.ones(max(equations - n, 0))  # IPOPT takes as many equations as variables at most, dependent ones or not
    found: list[tuple[np.ndarray, np.ndarray]] = []

    def judged(values: Sequence[ca.DM]) -> bool:
        x, multipliers = np.asarray(values[0]).ravel(), -np.asarray(values[4]).ravel()
        s, y = small.whole(x[:n], multipliers)
        if small.violation(x[:n]) <= INFEASIBLE and enough(s, y):
            found.append((s, y))
        return bool(found)

    x = ca.MX.sym("x", n + len(idle))
    cost_of_x = ca.dot(ca.DM(small.cost), x[:n]) + 0.5 * CURVATURE * ca.dot(x, x)
    problem: dict[str, Any] = {"x": x, "f": cost_of_x, "g": ca.mtimes(small.matrix, x[:n])}
    callback = IterationCallback(n + len(idle), len(small.row_low), 0, judged)
    options: dict[str, Any] = {
        "ipopt": linear_program_options(seconds, ITERATIONS, TOLERANCE),
        "print_time": False,
        "error_on_fail": False,
        "iteration_callback": callback,
    }
    solver = ca.nlpsol("linear_program", "ipopt", problem, options)
    low, high = np.append(small.low, -idle), np.append(small.high, idle)
    solver(x0=0.0, lbx=low, ubx=high, lbg=small.row_low, ubg=small.row_high)
    return found[0] if found else None


class _Reduced:
    """The program without rows and columns that need no linear algebra."""

    def __init__(self, program: LinearProgram) -> None:
        columns, low, high = program.matrix, program.low, program.high
        row_low, row_high = program.row_low, program.row_high
        self._program = program
        reach = abs(columns) @ np.maximum(abs(low), abs(high))
        asked = (row_low > -reach) | (row_high < reach)
        rows = sparse.csr_array(columns)
        alone = np.flatnonzero(asked & (np.diff(rows.indptr) == 1))
        self._alone, self._variable = alone, rows.indices[rows.indptr[alone]]
        self._entry = rows.data[rows.indptr[alone]]
        ends = np.sort(np.array([row_low[alone], row_high[alone]]) / self._entry, axis=0)
        self._low, self._high = low.copy(), high.copy()
        np.maximum.at(self._low, self._variable, ends[0])
        np.minimum.at(self._high, self._variable, ends[1])
        tightest = ends[0] == self._low[self._variable], ends[1] == self._high[self._variable]
        self._bounding = [np.flatnonzero(one) for one in tightest]
        self._free = np.flatnonzero(self._low < self._high)
        kept = np.setdiff1d(np.flatnonzero(asked), alone)
        matrix = sparse.csr_array(rows[kept][:, self._free])
        filled = np.diff(matrix.indptr) > 0
        fixed = np.where(self._low < self._high, 0.0, 0.5 * (self._low + self._high))
        self._fixed, self._kept = fixed, kept[filled]
        shift = (rows @ fixed)[self._kept]
        self.row_low, self.row_high = row_low[self._kept] - shift, row_high[self._kept] - shift
        self.cost, self.low, self.high = program.cost[self._free], self._low[self._free], self._high[self._free]
        self._matrix = matrix[filled]
        sorted_columns = sparse.csc_array(self._matrix)
        sorted_columns.sort_indices()
        self.matrix = casadi_matrix(sorted_columns)

    def violation(self, x: np.ndarray) -> float:
        """Return the largest violation of a row or a bound."""
        rows = self._matrix @ x
        parts = (self.row_low - rows, rows - self.row_high, self.low - x, x - self.high)
        return max(float(part.max(initial=0.0)) for part in parts)

    def whole(self, x: np.ndarray, multipliers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return s and the multipliers of all rows; those of bounds of variables go to the rows of one entry."""
        s, y = self._fixed.copy(), np.zeros(self._program.matrix.shape[0])
        s[self._free], y[self._kept] = x, multipliers
        rest = self._program.cost - self._program.matrix.T @ y
        for rows, sign in zip(self._bounding, (1, -1), strict=True):
            pressed = rows[sign * rest[self._variable[rows]] > 0]
            _, first = np.unique(self._variable[pressed], return_index=True)
            chosen = pressed[first]
            y[self._alone[chosen]] = rest[self._variable[chosen]] / self._entry[chosen]
        return s, y
