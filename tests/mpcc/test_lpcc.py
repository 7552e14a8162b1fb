"""B-stationarity of points of small problems that are known, and of random ones against all their branches."""

from __future__ import annotations

import itertools
import time
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import linprog

from fesd_robot.mpcc import Block, HomotopyOptions, Mpcc, solve
from fesd_robot.mpcc.branches import lpcc_at
from fesd_robot.mpcc.derivatives import active_set, linearise
from fesd_robot.mpcc.lpcc import BCertificate, b_stationary
from fesd_robot.mpcc.stationarity import stationarity

W = ca.SX.sym("w", 3)
X, Y, Z = W[0], W[1], W[2]


def _mpcc(f: ca.SX, G: ca.SX, H: ca.SX, n: int = 2, one_sided: bool = False, **parts: Any) -> Mpcc:
    f, G, H = (ca.substitute(ca.SX(part), W[n:], np.zeros(3 - n)) for part in (f, G, H))
    problem = Mpcc.from_expressions(w=W[:n], f=f, G=G, H=H, start=np.zeros(n), **parts)
    block = replace(problem.blocks[0], one_sided=np.full(problem.pairs, one_sided))
    return replace(problem, blocks=[block])


SCHOLTES4 = _mpcc(
    X + Y - Z, X, Y, 3, g=ca.vertcat(4 * X - Z, 4 * Y - Z), g_lower=np.zeros(2), g_upper=np.full(2, np.inf)
)
KTH3 = _mpcc(0.5 * (X - 1) ** 2 + (Y - 1) ** 2, X, Y)

KNOWN = {
    "kth1": (_mpcc(X + Y, X, Y), [0, 0], True),
    "kth2": (_mpcc(X + (Y - 1) ** 2, X, Y), [0, 1], True),
    "kth3, solution": (KTH3, [0, 1], True),
    "kth3, local solution": (KTH3, [1, 0], True),
    "kth3, C-stationary origin": (KTH3, [0, 0], False),
    "kth3, on the way": (KTH3, [0, 0.5], False),
    "ralph2": (_mpcc(X**2 + Y**2 - 4 * X * Y, X, Y), [0, 0], True),
    "scholtes4": (SCHOLTES4, [0, 0, 0], True),
    "(x-1)^2 + y^2, solution": (_mpcc((X - 1) ** 2 + Y**2, Y, Y - X), [0.5, 0.5], True),
    "(x-1)^2 + y^2, W-stationary origin": (_mpcc((X - 1) ** 2 + Y**2, Y, Y - X), [0, 0], False),
    "(y-1)^2 + x^2, solution": (_mpcc((Y - 1) ** 2 + X**2, Y, Y - X), [0.5, 0.5], True),
    "(y-1)^2 + x^2, M-stationary origin": (_mpcc((Y - 1) ** 2 + X**2, Y, Y - X), [0, 0], False),
    "no pair": (_mpcc((X - 2) ** 2, ca.SX(0, 1), ca.SX(0, 1)), [2, 7], True),
    "redundant pairs, solution": (_mpcc(X + Y, ca.vertcat(X, X, 2 * X), ca.vertcat(Y, 3 * Y, Y)), [0, 0], True),
    "redundant pairs, origin": (_mpcc(-X + Y, ca.vertcat(X, X, 2 * X), ca.vertcat(Y, 3 * Y, Y)), [0, 0], False),
    "an inequality blocks the branch": (
        _mpcc(-X + Y, X, Y, g=ca.vertcat(-X, -2 * X), g_lower=np.zeros(2), g_upper=np.full(2, np.inf)),
        [0, 0],
        True,
    ),
    "a bound blocks the branch": (_mpcc(-X + Y, X, Y, upper=np.array([0.0, 1.0])), [0, 0], True),
    "vanishing, S": (_mpcc(Y, X, Y, one_sided=True), [0, 0], True),
    "vanishing, along H = 0": (_mpcc(-X + Y, X, Y, one_sided=True), [0, 0], False),
    "vanishing, along H = 0 backwards": (_mpcc(X + 2 * Y, X, Y, one_sided=True), [0, 0], False),
    "vanishing, along G = 0": (_mpcc(-Y, X, Y, one_sided=True), [0, 0], False),
    "vanishing, into the cone": (_mpcc(X - Y, X, Y, one_sided=True), [0, 0], False),
    "vanishing, G > 0 forbids H > 0": (_mpcc(-3 * Y, X, Y, one_sided=True), [1, 0], True),
    "vanishing, G < 0 permits H > 0": (_mpcc(-3 * Y, X, Y, one_sided=True), [-1, 0], False),
    "vanishing, H > 0 forbids G > 0": (_mpcc(-X, X, Y, one_sided=True), [0, 1], True),
    "vanishing, H > 0 permits G < 0": (_mpcc(X, X, Y, one_sided=True), [0, 1], False),
    "vanishing, inside": (_mpcc((X + 1) ** 2, X, Y, one_sided=True), [-1, 1], True),
}


def _check_descent(problem: Mpcc, w: np.ndarray, found: BCertificate, radius: float = 1e-2) -> None:
    """The direction is feasible to first order, goes down as claimed, and keeps the branch that is told."""
    at, d = linearise(problem, w), found.direction
    assert at.gradient @ d == pytest.approx(found.slope * radius * max(1.0, abs(at.gradient).max()), rel=1e-6)
    assert found.bound <= found.slope < -1e-5
    assert (abs(d) <= radius * np.maximum(1.0, abs(w)) * (1 + 1e-9)).all()
    assert (w + d >= problem.lower - 1e-9).all() and (w + d <= problem.upper + 1e-9).all()
    g, G, H = at.g + at.g_jacobian @ d, at.G + at.G_jacobian @ d, at.H + at.H_jacobian @ d
    assert (g >= at.g_lower - 1e-8).all() and (g <= at.g_upper + 1e-8).all() and (H >= -1e-8).all()
    assert (G[~at.one_sided] >= -1e-8).all()
    assert (np.maximum(G, 0)[found.G_side] <= 1e-8).all() and (abs(H[~found.G_side]) <= 1e-8).all()


@pytest.mark.parametrize("name", KNOWN)
@pytest.mark.parametrize("radius", [1e-2, 1e-4, 1.0])
def test_known_points(name: str, radius: float) -> None:
    """The verdict is the known one at every radius, and a direction of descent is one."""
    problem, point, expected = KNOWN[name]
    w = np.array(point, dtype=float)
    found = b_stationary(problem, w, radius=radius)
    assert found.verdict == ("B-stationary" if expected else "descent")
    if expected:
        assert found.slope == 0.0 and found.bound >= -1e-5 and not found.direction.any() and found.leaving == ()
    else:
        _check_descent(problem, w, found, radius)


def test_scholtes4_needs_the_branches() -> None:
    """At a B-stationary point without S-multipliers only the search over branches decides."""
    found = b_stationary(SCHOLTES4, np.zeros(3))
    assert found.verdict == "B-stationary" and found.reason == "no descent on any branch"
    assert stationarity(SCHOLTES4, np.zeros(3)).kind == "M"


def test_the_branch_is_told() -> None:
    """At the M-stationary origin of (y-1)^2 + x^2, y _|_ y - x, descent keeps y - x = 0 and lets y grow."""
    problem, point, _ = KNOWN["(y-1)^2 + x^2, M-stationary origin"]
    found = b_stationary(problem, np.array(point, dtype=float))
    assert found.direction == pytest.approx([0.01, 0.01])
    assert found.G_side.tolist() == [False] and found.leaving == ("pair 0 in problem: G > 0",)


@pytest.mark.parametrize("name", KNOWN)
@pytest.mark.parametrize("factor", [1e-2, 1e3])
@pytest.mark.parametrize("part", [0, 1, 2, 3], ids=["f", "g", "G", "H"])
def test_scaling_changes_nothing(name: str, part: int, factor: float) -> None:
    """Multiplying f, g, G or H by a positive factor leaves the verdict."""
    problem, point, expected = KNOWN[name]
    old, p, w = problem.blocks[0], ca.SX(0, 1), ca.SX.sym("w", problem.size)
    parts = list(old.function(w, p))
    parts[part] *= factor
    scaled = replace(problem, blocks=[replace(old, function=ca.Function("scaled", [w, p], parts))])
    found = b_stationary(scaled, np.array(point, dtype=float))
    assert found.verdict == ("B-stationary" if expected else "descent")


def _random(random: np.random.Generator, n: int, pairs: int) -> tuple[Mpcc, list[np.ndarray]]:
    """A linear problem whose pairs are all zero at the origin, and (c, g, G, H, one_sided)."""
    G, H = random.integers(-2, 3, (2, pairs, n)).astype(float)
    g = random.integers(-2, 3, (2, n)).astype(float)
    one_sided = random.random(pairs) < 0.4
    nu, xi = random.integers(-1, 4, (2, pairs))
    c = G.T @ np.where(one_sided, np.minimum(nu, 0), nu) + H.T @ xi + g.T @ random.integers(0, 2, 2)
    w = ca.SX.sym("w", n)
    problem = Mpcc.from_expressions(
        w=w, f=ca.dot(c, w), g=g @ w, G=G @ w, H=H @ w, start=np.zeros(n), g_lower=np.zeros(2), g_upper=np.full(2, 9.0)
    )
    block = replace(problem.blocks[0], one_sided=one_sided)
    return replace(problem, blocks=[block]), [c, g, G, H, one_sided]


def _all_branches(c: np.ndarray, g: np.ndarray, G: np.ndarray, H: np.ndarray, one_sided: np.ndarray) -> float:
    """Least slope in the unit box over all branches, one linear program each."""
    least = 0.0
    for choice in itertools.product([True, False], repeat=len(G)):
        kept_G, kept_H = np.array(choice), ~np.array(choice)
        # G = 0 or, one-sided, G <= 0, with H >= 0; or H = 0 with, two-sided, G >= 0.
        below = [G[kept_G], H[kept_H], -G[~one_sided], -H, -g]
        A = np.vstack(below)
        least = min(least, linprog(c, A_ub=A, b_ub=np.zeros(len(A)), bounds=(-1, 1)).fun)
    return least / max(1.0, abs(c).max())


def test_random_problems_agree_with_all_branches() -> None:
    """With four biactive pairs of either sort the verdict is that of the 16 branches, and S implies it."""
    random = np.random.default_rng(11)
    seen, implied = set(), set()
    for _ in range(60):
        problem, parts = _random(random, 5, 4)
        w = np.zeros(5)
        found = b_stationary(problem, w)
        assert found.verdict == ("descent" if _all_branches(*parts) < -1e-5 else "B-stationary")
        kind = stationarity(problem, w).kind
        assert found.verdict == "B-stationary" or kind != "S"
        if found.verdict == "descent":
            _check_descent(problem, w, found)
        seen.add(found.verdict)
        implied.add((found.verdict, kind == "S"))
    assert seen == {"B-stationary", "descent"}
    assert ("B-stationary", False) in implied


def test_both_searches_agree() -> None:
    """The mixed-integer program and the depth-first search find the same: a bound of zero or a branch of descent."""
    random = np.random.default_rng(5)
    for _ in range(30):
        problem, parts = _random(random, 6, 4)
        at = linearise(problem, np.zeros(6))
        lpcc = lpcc_at(at, active_set(at, 1e-6), np.full(6, 0.01), 0.01)
        deadline = time.perf_counter() + 60
        descent = _all_branches(*parts) < -1e-5
        for bound, state in (lpcc.mixed_integer(deadline), lpcc.depth_first(-1e-5, deadline)):
            if descent:
                assert state is not None
                solved = lpcc.solve(state, deadline)
                assert solved is not None and solved[0] < -1e-5
            else:
                assert bound >= -1e-5


def test_descent_is_followed_to_a_certified_point() -> None:
    """From a point with descent, the homotopy's solution of the same problem is certified."""
    problem, _, _ = KNOWN["kth3, C-stationary origin"]
    solution = solve(problem, HomotopyOptions(tolerance=1e-8, sigma_factor=0.1))
    found = b_stationary(problem, solution.w, activity=1e-4)
    assert solution.solved and found.verdict == "B-stationary"


def test_an_infeasible_point_is_not_judged() -> None:
    """A point that violates a constraint by more than the activity is unknown, with the violation as reason."""
    found = b_stationary(_mpcc(X + Y, X, Y), np.array([-1e-3, 0.0]))
    assert found.verdict == "unknown" and "violates a constraint by 1.0e-03" in found.reason
    assert found.bound == -np.inf


def test_no_time_is_unknown() -> None:
    """Without time nothing is claimed."""
    found = b_stationary(SCHOLTES4, np.zeros(3), time_limit=0.0)
    assert (found.verdict, found.reason, found.bound) == ("unknown", "time limit", -np.inf)


@pytest.mark.parametrize("odd", [None, 700])
def test_a_large_problem_takes_seconds(odd: int | None) -> None:
    """A thousand copies of scholtes4 are B- and M-, not S-stationary; one copy with another cost is found and named."""
    copies = 1000
    slope = np.ones((1, copies))
    if odd is not None:
        slope[0, odd] = -1.0
    p, old = ca.SX.sym("p"), SCHOLTES4.blocks[0]
    _, g, G, H = old.function(W, ca.SX(0, 1))
    block = Block(
        copy_names=[f"copy {k}" for k in range(copies)],
        function=ca.Function("copies", [W, p], [p * X + Y - Z, g, G, H]),
        index=np.arange(3 * copies).reshape(copies, 3).T,
        parameters=slope,
        lower=old.lower,
        upper=old.upper,
        constraint_names=old.constraint_names,
        pair_names=["pair"],
    )
    free = np.full(3 * copies, np.inf)
    problem = Mpcc(lower=-free, upper=free, start=np.zeros(3 * copies), blocks=[block])
    begin = time.perf_counter()
    found = b_stationary(problem, problem.start, time_limit=30.0)
    stationary = stationarity(problem, problem.start, time_limit=30.0)
    assert time.perf_counter() - begin < 20.0
    assert stationary.biactive == found.biactive == copies
    assert stationary.kind == "M" and len(stationary.worst_pairs) == 5
    if odd is None:
        assert found.verdict == "B-stationary"
    else:
        _check_descent(problem, problem.start, found)
        assert "pair in copy 700: G > 0" in found.leaving
