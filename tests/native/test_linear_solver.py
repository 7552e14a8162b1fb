"""The linear solver: solutions, inertia and rank of systems of every kind, and what happens without it."""

from __future__ import annotations

import logging
import threading
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from fesd_robot.errors import SolverError
from fesd_robot.mpcc import HomotopyOptions, Mpcc, Run, solve
from fesd_robot.native import CompilationError, kkt_library, linear_solver
from fesd_robot.native.compiler import begin
from fesd_robot.native.linear_solver import KktSystem, RepeatedKktSystem, self_test

LIBRARY = kkt_library()
assert LIBRARY, "the tests need a C++ compiler"


def _random(kind: str, seed: int) -> np.ndarray:
    """A sparse symmetric matrix: definite, quasi-definite, indefinite, a KKT system with zero block, badly scaled."""
    generator = np.random.default_rng(seed)
    n = int(generator.integers(2, 120))
    m = int(generator.integers(1, n)) if kind != "definite" else 0
    dense = generator.normal(size=(n, n)) * (generator.uniform(size=(n, n)) < 4 / n)
    hessian = dense @ dense.T + np.diag(10.0 ** generator.uniform(-2, 2, n))
    if kind == "indefinite":
        hessian = dense + dense.T + np.diag(generator.normal(size=n) * (generator.uniform(size=n) < 0.5))
    coupling = generator.normal(size=(m, n)) * (generator.uniform(size=(m, n)) < 4 / n)
    coupling[np.arange(m), generator.permutation(n)[:m]] += 2.0
    corner = -np.diag(10.0 ** generator.uniform(-3, 0, m)) if kind == "quasidefinite" else np.zeros((m, m))
    matrix = np.block([[hessian, coupling.T], [coupling, corner]])
    if kind == "scaled":
        scale = 10.0 ** generator.uniform(-5, 5, n + m)
        matrix = scale[:, None] * matrix * scale
    return matrix


def _system(matrix: np.ndarray, generator: np.random.Generator) -> tuple[KktSystem, np.ndarray]:
    """The lower triangle in random order, from either triangle, some entries split in two."""
    row, column = np.nonzero(np.tril(matrix))
    value = matrix[row, column]
    split = generator.uniform(size=len(row)) < 0.2
    row, column = np.append(row, row[split]), np.append(column, column[split])
    value = np.append(np.where(split, 0.25, 1.0) * value, 0.75 * value[split])
    order, flip = generator.permutation(len(row)), generator.uniform(size=len(row)) < 0.5
    row, column, value = row[order], column[order], value[order]
    assert LIBRARY
    return KktSystem(np.where(flip, column, row), np.where(flip, row, column), len(matrix), LIBRARY), value


def _inertia(matrix: np.ndarray) -> tuple[int, float]:
    """Number of negative eigenvalues and the relative size of the smallest, of the matrix scaled to unit rows."""
    scale = 1 / np.sqrt(np.abs(matrix).max(axis=1))
    scale = scale / np.sqrt(np.abs(scale[:, None] * matrix * scale).max(axis=1))
    eigenvalues = np.linalg.eigvalsh(scale[:, None] * matrix * scale)
    return int((eigenvalues < 0).sum()), float(np.abs(eigenvalues).min() / np.abs(eigenvalues).max())


def test_a_factorization_that_would_take_too_long_is_given_up() -> None:
    """Where no pivot of a band is acceptable but with the last row, all columns would be delayed to one dense front, at
    ten thousand times the operations of other values: rank 0. What comes after it is right again."""
    n, generator = 3000, np.random.default_rng(0)
    i = np.arange(n - 1)
    row, column = (
        np.concatenate([np.arange(n), i[1:], np.full(n - 1, n - 1)]),
        np.concatenate([np.arange(n), i[:-1], i]),
    )
    band = np.ones(len(row)) * 0.3
    band[:n] = 4.0
    band[n - 1] = 1000.0
    weak = band.copy()
    weak[: 2 * n - 2] *= 1e-14 * generator.uniform(0.5, 1.0, 2 * n - 2)
    assert LIBRARY
    system = KktSystem(row, column, n, LIBRARY)
    right = generator.normal(size=n)
    for values, rank in ((band, n), (weak, 0), (weak, 0), (band, n)):
        assert system.factorize(values)[0] == rank
        if rank:
            x = system.solve(right)
            product = np.bincount(row, values * x[column], n) + np.bincount(column, values * x[row], n)
            product -= np.bincount(row[:n], values[:n] * x, n)
            assert product == pytest.approx(right, abs=1e-9)


@pytest.mark.parametrize("kind", ["definite", "quasidefinite", "indefinite", "kkt", "scaled"])
def test_solutions_and_inertia(kind: str) -> None:
    """On random matrices the backward error after one refinement is below 1e-12 and the inertia that of eigenvalues."""
    seen = 0
    for seed in range(60):
        matrix, generator = _random(kind, seed), np.random.default_rng(seed)
        negative, smallest = _inertia(matrix)
        if smallest < 1e-10:
            continue  # too near to a singular matrix for a sign to mean anything
        system, values = _system(matrix, generator)
        rank, counted = system.factorize(values, threshold=1e-6)
        assert (rank, counted) == (len(matrix), negative), seed
        right = generator.normal(size=len(matrix)) * np.abs(matrix).max(axis=1)
        x = system.solve(right)
        for _ in range(2):
            x = x + system.solve(right - matrix @ x)
        error = np.abs(right - matrix @ x) / (np.abs(matrix) @ np.abs(x) + np.abs(right))
        assert error.max() < 1e-12, seed
        seen += 1
    assert seen > 40


@pytest.mark.parametrize("copies", [1, 3])
def test_singular_matrices_are_noticed(copies: int) -> None:
    """Repeated constraints leave exactly that many pivots out, or tiny ones that spoil the solution."""
    generator = np.random.default_rng(5)
    n, m = 30, 8
    coupling = generator.integers(-2, 3, size=(m, n)).astype(float)
    coupling = np.vstack([coupling, coupling[:copies]])
    matrix = np.block([[np.eye(n), coupling.T], [coupling, np.zeros((m + copies, m + copies))]])
    system, values = _system(matrix, generator)
    rank, negative = system.factorize(values)
    right = generator.normal(size=len(matrix))
    unsolved = np.abs(right - matrix @ system.solve(right)).max()
    assert rank == len(matrix) - copies or unsolved > 1e-3
    assert negative <= m + copies


def _optimal_control(generator: np.random.Generator, intervals: int, curvature: float, corner: float) -> np.ndarray:
    """A KKT system of states and controls on a chain; one Hessian in ten has a negative eigenvalue of this size."""
    states, controls = 3, 2
    n, m = intervals * (states + controls), (intervals - 1) * states
    hessian, jacobian = np.zeros((n, n)), np.zeros((m, n))
    for k in range(intervals):
        own = slice(k * (states + controls), (k + 1) * (states + controls))
        root = generator.normal(size=(states + controls, states + controls))
        hessian[own, own] = root @ root.T
        if generator.uniform() < 0.1:
            direction = generator.normal(size=states + controls)
            hessian[own, own] -= curvature * np.outer(direction, direction)
        if k:
            rows = slice((k - 1) * states, k * states)
            jacobian[rows, own.start - states - controls : own.start] = generator.normal(size=(states, 5))
            jacobian[rows, own.start : own.start + states] = -np.eye(states)
    return np.block([[hessian, jacobian.T], [jacobian, -corner * np.eye(m)]])


@pytest.mark.parametrize("corner", [0.0, 1e-3])
def test_stopping_early_tells_right_from_wrong(corner: float) -> None:
    """Stopped early or not, the count is that of the constraints where it truly is, else larger, and solutions hold."""
    seen = [0, 0]
    for seed in range(60):
        generator = np.random.default_rng(seed)
        definite = _optimal_control(np.random.default_rng(seed), 20, 0.0, corner)
        matrix = _optimal_control(np.random.default_rng(seed), 20, generator.uniform(0, 8), corner)
        row, column = np.nonzero(np.tril((matrix != 0) | (definite != 0)))
        assert LIBRARY
        system, constraints = KktSystem(row, column, len(matrix), LIBRARY), 57
        true = int((np.linalg.eigvalsh(matrix) < 0).sum())
        assert system.factorize(definite[row, column], stop_early=True)[1] == constraints
        system.solve(np.ones(len(matrix)))
        negative = system.factorize(matrix[row, column], stop_early=True)[1]
        assert negative == (constraints if true == constraints else constraints + 1) or negative == true, seed
        seen[true > constraints] += 1
        right = generator.normal(size=len(matrix))
        assert matrix @ system.solve(right) == pytest.approx(right, abs=1e-5), seed
        assert system.factorize(matrix[row, column])[1] == true, seed
    assert min(seen) > 5, seen


def test_zero_rows_and_columns() -> None:
    """A variable that occurs nowhere makes the matrix singular, with the rank of the others."""
    matrix = np.diag([2.0, 0.0, -3.0])
    assert LIBRARY
    system = KktSystem(np.arange(3), np.arange(3), 3, LIBRARY)
    assert system.factorize(np.diag(matrix)) == (2, 1)


@pytest.mark.parametrize("kind", ["definite", "indefinite", "kkt"])
def test_a_system_that_is_settled_has_the_same_solution(kind: str) -> None:
    """With an order of elimination for its own pivots a system, and another one on its pattern, is solved as before."""
    assert LIBRARY
    for seed in range(20):
        generator, matrix = np.random.default_rng(seed), _random(kind, seed)
        if _inertia(matrix)[1] < 1e-10:
            continue
        row, column = np.nonzero(np.tril(matrix))
        system = RepeatedKktSystem(row, column, len(matrix), LIBRARY)
        right = generator.normal(size=len(matrix))
        found = [system.factorize(matrix[row, column])]
        system.settle()
        for factor in (1.0, 3.0):
            found.append(system.factorize(factor * matrix[row, column]))
            scaled, x = factor * matrix, system.solve(right)
            x += system.solve(right - scaled @ x)
            assert np.abs(scaled @ x - right).max() < 1e-9 * max(np.abs(scaled).max() * np.abs(x).max(), 1.0)
        assert found == [_inertia(matrix)[0]] * 3


def test_a_singular_system_has_no_inertia() -> None:
    """A matrix with a row of zeros is called singular, and the next one on its pattern is not."""
    assert LIBRARY
    row, column = np.tril_indices(4)
    system = RepeatedKktSystem(row, column, 4, LIBRARY)
    matrix = np.diag([1.0, -2.0, 3.0, 0.0])
    assert system.factorize(matrix[row, column]) is None
    matrix[3, 3] = -1.0
    assert system.factorize(matrix[row, column]) == 2


def test_values_change_on_one_pattern() -> None:
    """One analysis serves many factorizations, and several systems live side by side."""
    generator = np.random.default_rng(1)
    matrices = [_random("kkt", seed) for seed in (2, 3)]
    systems = [_system(matrix, generator) for matrix in matrices]
    for factor in (1.0, -2.0, 1e-3):
        for system, values in systems:
            system.factorize(factor * values)
        for matrix, (system, _) in zip(matrices, systems, strict=True):
            right = generator.normal(size=len(matrix))
            assert factor * matrix @ system.solve(right) == pytest.approx(right, abs=1e-6)


def _problem() -> Mpcc:
    """min (x - 1)² + (y - 2)² over 0 <= x _|_ y >= 0, with solution (0, 2)."""
    w = ca.SX.sym("w", 2)
    return Mpcc.from_expressions(
        w=w, f=(w[0] - 1) ** 2 + (w[1] - 2) ** 2, G=w[0], H=w[1], start=np.array([0.5, 1.0]), bounds=(0.0, None)
    )


@pytest.mark.parametrize("solver", ["auto", "fesd", "mumps"])
def test_ipopt_takes_the_solver(solver: str) -> None:
    """IPOPT reaches the same solution with ours as with MUMPS."""
    solution = solve(_problem(), Run(HomotopyOptions(linear_solver=solver)))
    assert solution.solved
    assert solution.w == pytest.approx([0, 2], abs=1e-4)


def test_without_a_compiler(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, tmp_path: Path) -> None:
    """Without a compiler one line of the log says so, ``auto`` uses MUMPS, and ``fesd`` is an error that says why."""
    monkeypatch.setenv("CXX", "no-such-compiler")
    monkeypatch.setenv("FESD_ROBOT_CACHE", str(tmp_path))
    kkt_library.cache_clear()
    try:
        with caplog.at_level(logging.WARNING):
            assert solve(_problem(), Run(HomotopyOptions(linear_solver="auto"))).solved
            assert [record.message for record in caplog.records] == [
                "IPOPT uses MUMPS, for our own linear solver is not available: no C++ compiler found (set CXX, or "
                "install one)"
            ]
            with pytest.raises(SolverError, match="'fesd' needs a C\\+\\+ compiler"):
                solve(_problem(), Run(HomotopyOptions(linear_solver="fesd")))
    finally:
        kkt_library.cache_clear()


@pytest.mark.parametrize("fails", [False, True])
def test_building_begins_beside_other_work(fails: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """The library is compiled in another thread; that it cannot be is left to whoever needs it."""
    begun, threads, unhandled = threading.Event(), list[threading.Thread](), list[object]()

    def build() -> None:
        threads.append(threading.current_thread())
        begun.set()
        if fails:
            raise CompilationError("no compiler")

    monkeypatch.setattr(threading, "excepthook", unhandled.append)
    begin(build)
    assert begun.wait(10)
    threads[0].join(10)
    assert threads[0] is not threading.current_thread() and not unhandled


def test_a_library_that_fails_its_test_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    """A wrong solution is found before IPOPT relies on it."""
    monkeypatch.setattr(KktSystem, "factorize", lambda self, values, threshold=1e-8: (self.order, 0))
    assert LIBRARY
    with pytest.raises(SolverError, match="failed its test: rank 40 of 40, 0 negative eigenvalues instead of 0"):
        self_test(LIBRARY)
    monkeypatch.setattr(linear_solver, "shared_library", lambda *_, **__: LIBRARY)
    kkt_library.cache_clear()
    assert kkt_library() is None
    kkt_library.cache_clear()
