"""Linear programs: against scipy's answer, and a bound that no multipliers lift above the optimum."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.optimize import linprog

from fesd_robot.mpcc import linear_program
from fesd_robot.mpcc.linear_program import IPOPT_UNKNOWNS, MANY_UNKNOWNS, solve_linear_program


def program(n: int, seed: int) -> tuple[np.ndarray, sparse.csr_array, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Cost, rows and bounds of a program that zero solves feasibly, a third of its rows equations."""
    random = np.random.default_rng(seed)
    rows = sparse.random_array((n // 2, n), density=4 / n, rng=random, data_sampler=random.standard_normal).tocsr()
    high = np.where(random.random(n // 2) < 0.3, 0.0, random.random(n // 2))
    low = np.where(high == 0.0, 0.0, np.where(random.random(n // 2) < 0.5, -np.inf, -random.random(n // 2)))
    return random.standard_normal(n), rows, low, high, -random.random(n), random.random(n)


@pytest.mark.parametrize("n", [20, 200, MANY_UNKNOWNS + 500])
def test_as_scipy(n: int) -> None:
    """Value and bound are scipy's optimum, and the solution is feasible, by simplex and by interior point."""
    cost, rows, row_low, row_high, low, high = program(n, n)
    found = solve_linear_program(cost, rows, row_low, row_high, low, high, 60.0)
    finite = np.isfinite(row_low)
    right = linprog(
        cost,
        A_ub=sparse.vstack([rows, -rows[finite]]),
        b_ub=np.concatenate([row_high, -row_low[finite]]),
        bounds=np.column_stack([low, high]),
    )
    assert found is not None
    assert found.bound <= found.value == pytest.approx(right.fun, abs=1e-5 * abs(right.fun))
    assert found.bound == pytest.approx(right.fun, abs=5e-6)
    product = rows @ found.s
    assert (product <= row_high + 1e-6).all() and (product >= row_low - 1e-6).all()
    assert (found.s <= high + 1e-9).all() and (found.s >= low - 1e-9).all()


@pytest.mark.slow
@pytest.mark.parametrize(("n", "copies"), [(IPOPT_UNKNOWNS + 500, 1), (500, 8)])
def test_large_program_of_a_motion(monkeypatch: pytest.MonkeyPatch, n: int, copies: int) -> None:
    """Rows of one entry, repeated equations and columns without room, by IPOPT alone: scipy's optimum, and proven.

    With many copies equations outnumber variables.
    """
    monkeypatch.setattr(linear_program, "_highs", lambda *_: None)
    monkeypatch.setattr(linear_program, "IPOPT_UNKNOWNS", n - 1)
    cost, rows, row_low, row_high, low, high = program(n, 5)
    single = sparse.diags_array(np.where(np.arange(len(cost)) % 2, -2.0, 0.5)).tocsr()[:300]
    equations = sparse.vstack([rows[row_low == row_high]] * copies)
    assert (equations.shape[0] > len(cost)) == (copies > 1)
    rows = sparse.csr_array(sparse.vstack([rows, equations, single]))
    row_low = np.concatenate([row_low, np.zeros(equations.shape[0]), np.full(300, -0.1)])
    row_high = np.concatenate([row_high, np.zeros(equations.shape[0]), np.tile([0.0, 0.1, np.inf], 100)])
    low[300:330] = high[300:330] = 0.0
    found = solve_linear_program(cost, rows, row_low, row_high, low, high, 60.0)
    finite, bounded = np.isfinite(row_low), np.isfinite(row_high)
    right = linprog(
        cost,
        A_ub=sparse.vstack([rows[bounded], -rows[finite]]),
        b_ub=np.concatenate([row_high[bounded], -row_low[finite]]),
        bounds=np.column_stack([low, high]),
    )
    assert found is not None
    assert found.value == pytest.approx(right.fun, abs=1e-5)
    assert right.fun - 1e-5 <= found.bound <= right.fun + 1e-6
    assert (rows @ found.s <= row_high + 1e-7).all() and (rows @ found.s >= row_low - 1e-7).all()


def test_no_solution() -> None:
    """Rows that cannot hold together, and no time, have none."""
    cost, rows, row_low, row_high, low, high = program(20, 1)
    assert solve_linear_program(cost, rows, row_low, row_high, low, high, 0.0) is None
    assert solve_linear_program(cost, rows, row_low + 100, row_high + 100, low, high, 10.0) is None


def test_a_loose_solution_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the multipliers do not prove to be the optimum is not returned."""
    monkeypatch.setattr(linear_program, "_LARGEST_GAP", -1.0)
    assert solve_linear_program(*program(20, 1), 10.0) is None
