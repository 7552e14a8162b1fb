"""B-stationarity of points of small problems that are known, and of random ones against all their branches."""

from __future__ import annotations

import itertools
import time
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import linprog

from fesd_robot.complementarity import ActiveFactor, Place
from fesd_robot.mpcc import Block, HomotopyOptions, Mpcc, Run, solve
from fesd_robot.mpcc.b_stationarity import BCertificate, b_stationary
from fesd_robot.mpcc.derivatives import active_set, linearise
from fesd_robot.mpcc.lpcc import Lpcc, lpcc_at
from fesd_robot.mpcc.stationarity import stationarity

from .known import X, Y, Z, from_origin, lower_rows, scaled, vanishing


def _vanishing(f: ca.SX) -> Mpcc:
    return vanishing(from_origin(f, X, Y))


SCHOLTES4 = from_origin(X + Y - Z, X, Y, 3, **lower_rows(4 * X - Z, 4 * Y - Z))
KTH3 = from_origin(0.5 * (X - 1) ** 2 + (Y - 1) ** 2, X, Y)

LIMIT = 200.0
"""s, for a large problem; it takes some ten, and several times as long beside other work."""

KNOWN = {
    "kth1": (from_origin(X + Y, X, Y), [0, 0], True),
    "kth2": (from_origin(X + (Y - 1) ** 2, X, Y), [0, 1], True),
    "kth3, solution": (KTH3, [0, 1], True),
    "kth3, local solution": (KTH3, [1, 0], True),
    "kth3, C-stationary origin": (KTH3, [0, 0], False),
    "kth3, on the way": (KTH3, [0, 0.5], False),
    "ralph2": (from_origin(X**2 + Y**2 - 4 * X * Y, X, Y), [0, 0], True),
    "scholtes4": (SCHOLTES4, [0, 0, 0], True),
    "(x-1)^2 + y^2, solution": (from_origin((X - 1) ** 2 + Y**2, Y, Y - X), [0.5, 0.5], True),
    "(x-1)^2 + y^2, W-stationary origin": (from_origin((X - 1) ** 2 + Y**2, Y, Y - X), [0, 0], False),
    "(y-1)^2 + x^2, solution": (from_origin((Y - 1) ** 2 + X**2, Y, Y - X), [0.5, 0.5], True),
    "(y-1)^2 + x^2, M-stationary origin": (from_origin((Y - 1) ** 2 + X**2, Y, Y - X), [0, 0], False),
    "no pair": (from_origin((X - 2) ** 2, ca.SX(0, 1), ca.SX(0, 1)), [2, 7], True),
    "redundant pairs, solution": (from_origin(X + Y, ca.vertcat(X, X, 2 * X), ca.vertcat(Y, 3 * Y, Y)), [0, 0], True),
    "redundant pairs, origin": (from_origin(-X + Y, ca.vertcat(X, X, 2 * X), ca.vertcat(Y, 3 * Y, Y)), [0, 0], False),
    "an inequality blocks the branch": (
        from_origin(-X + Y, X, Y, **lower_rows(-X, -2 * X)),
        [0, 0],
        True,
    ),
    "a bound blocks the branch": (from_origin(-X + Y, X, Y, bounds=(None, np.array([0.0, 1.0]))), [0, 0], True),
    "vanishing, S": (_vanishing(Y), [0, 0], True),
    "vanishing, along H = 0": (_vanishing(-X + Y), [0, 0], False),
    "vanishing, along H = 0 backwards": (_vanishing(X + 2 * Y), [0, 0], False),
    "vanishing, along G = 0": (_vanishing(-Y), [0, 0], False),
    "vanishing, into the cone": (_vanishing(X - Y), [0, 0], False),
    "vanishing, G > 0 forbids H > 0": (_vanishing(-3 * Y), [1, 0], True),
    "vanishing, G < 0 permits H > 0": (_vanishing(-3 * Y), [-1, 0], False),
    "vanishing, H > 0 forbids G > 0": (_vanishing(-X), [0, 1], True),
    "vanishing, H > 0 permits G < 0": (_vanishing(X), [0, 1], False),
    "vanishing, inside": (_vanishing((X + 1) ** 2), [-1, 1], True),
}


def _G_is_zero(certificate: BCertificate) -> np.ndarray:
    """Which pairs have G as their active factor in the certificate's branch, the others have H."""
    (factors,) = certificate.branch.factors
    assert set(factors) <= {ActiveFactor.G, ActiveFactor.H}
    return np.array([factor is ActiveFactor.G for factor in factors], dtype=bool)


def _check_descent(problem: Mpcc, w: np.ndarray, certificate: BCertificate, radius: float = 1e-2) -> None:
    """The direction is feasible to first order, goes down as claimed, and keeps to the branch that is returned."""
    at, d, G_zero = linearise(problem, w), certificate.direction, _G_is_zero(certificate)
    assert certificate.branch.conditions == problem.pair_labels
    assert at.gradient @ d == pytest.approx(certificate.slope * radius * max(1.0, abs(at.gradient).max()), rel=1e-6)
    assert certificate.bound <= certificate.slope < -1e-5
    assert (abs(d) <= radius * np.maximum(1.0, abs(w)) * (1 + 1e-9)).all()
    assert (w + d >= problem.lower - 1e-9).all() and (w + d <= problem.upper + 1e-9).all()
    g, G, H = at.g + at.g_jacobian @ d, at.G + at.G_jacobian @ d, at.H + at.H_jacobian @ d
    assert (g >= at.g_lower - 1e-8).all() and (g <= at.g_upper + 1e-8).all() and (H >= -1e-8).all()
    assert (G[~at.vanishing] >= -1e-8).all()
    assert (np.maximum(G, 0)[G_zero] <= 1e-8).all() and (abs(H[~G_zero]) <= 1e-8).all()


@pytest.mark.parametrize("name", KNOWN)
@pytest.mark.parametrize("radius", [1e-2, 1e-4, 1.0])
def test_known_points(name: str, radius: float) -> None:
    """The verdict is the known one at every radius, and a direction of descent is one."""
    problem, point, expected = KNOWN[name]
    w = np.array(point, dtype=float)
    certificate = b_stationary(problem, w, radius=radius)
    assert certificate.verdict == ("certified" if expected else "refuted")
    if expected:
        assert (
            certificate.slope == 0.0
            and certificate.bound >= -1e-5
            and not certificate.direction.any()
            and certificate.leaving == ()
        )
    else:
        _check_descent(problem, w, certificate, radius)


def test_scholtes4_needs_the_branches() -> None:
    """At a B-stationary point without S-multipliers only the search over branches decides."""
    certificate = b_stationary(SCHOLTES4, np.zeros(3))
    assert certificate.verdict == "certified" and certificate.reason == "no descent on any branch"
    assert stationarity(SCHOLTES4, np.zeros(3)).kind == "M"


def test_the_branch_of_a_descent() -> None:
    """At the M-stationary origin of (y-1)^2 + x^2, y _|_ y - x, descent keeps y - x = 0 and lets y grow."""
    problem, point, _ = KNOWN["(y-1)^2 + x^2, M-stationary origin"]
    certificate = b_stationary(problem, np.array(point, dtype=float))
    assert certificate.direction == pytest.approx([0.01, 0.01])
    assert _G_is_zero(certificate).tolist() == [False] and [str(one) for one in certificate.leaving] == ["pair 0"]


@pytest.mark.parametrize("name", KNOWN)
@pytest.mark.parametrize("factor", [1e-2, 1e3])
@pytest.mark.parametrize("part", ["f", "g", "G", "H"])
def test_scaling_changes_nothing(name: str, part: str, factor: float) -> None:
    """Multiplying f, g, G or H by a positive factor leaves the verdict."""
    problem, point, expected = KNOWN[name]
    certificate = b_stationary(scaled(problem, **{part: factor}), np.array(point, dtype=float))
    assert certificate.verdict == ("certified" if expected else "refuted")


def _random(random: np.random.Generator, n: int, pairs: int) -> tuple[Mpcc, list[np.ndarray]]:
    """A linear problem whose pairs are all zero at the origin, and (c, g, G, H, vanishes)."""
    G, H = random.integers(-2, 3, (2, pairs, n)).astype(float)
    g = random.integers(-2, 3, (2, n)).astype(float)
    vanishes = random.random(pairs) < 0.4
    nu, xi = random.integers(-1, 4, (2, pairs))
    c = G.T @ np.where(vanishes, np.minimum(nu, 0), nu) + H.T @ xi + g.T @ random.integers(0, 2, 2)
    w = ca.SX.sym("w", n)
    problem = Mpcc.from_expressions(
        w=w, f=ca.dot(c, w), g=g @ w, G=G @ w, H=H @ w, start=np.zeros(n), g_bounds=(0.0, 9.0)
    )
    return vanishing(problem, where=vanishes), [c, g, G, H, vanishes]


def _all_branches(c: np.ndarray, g: np.ndarray, G: np.ndarray, H: np.ndarray, vanishes: np.ndarray) -> float:
    """Least slope in the unit box over all branches, one linear program each."""
    least = 0.0
    for choice in itertools.product([True, False], repeat=len(G)):
        G_zero, H_zero = np.array(choice), ~np.array(choice)
        # G = 0 or, of a vanishing constraint, G <= 0, with H >= 0; or H = 0 with, of the others, G >= 0.
        below = [G[G_zero], H[H_zero], -G[~vanishes], -H, -g]
        A = np.vstack(below)
        least = min(least, linprog(c, A_ub=A, b_ub=np.zeros(len(A)), bounds=(-1, 1)).fun)
    return least / max(1.0, abs(c).max())


@pytest.mark.slow
def test_random_problems_agree_with_all_branches() -> None:
    """With four biactive pairs of either sort the verdict is that of the 16 branches, and S implies it."""
    random = np.random.default_rng(11)
    seen, implied = set(), set()
    for _ in range(60):
        problem, parts = _random(random, 5, 4)
        w = np.zeros(5)
        certificate = b_stationary(problem, w)
        assert certificate.verdict == ("refuted" if _all_branches(*parts) < -1e-5 else "certified")
        kind = stationarity(problem, w).kind
        assert certificate.verdict == "certified" or kind != "S"
        if certificate.verdict == "refuted":
            _check_descent(problem, w, certificate)
        seen.add(certificate.verdict)
        implied.add((certificate.verdict, kind == "S"))
    assert seen == {"certified", "refuted"}
    assert ("certified", False) in implied


def _lpcc(problem: Mpcc) -> Lpcc:
    """The LPCC of a problem at the origin, in a box of 0.01."""
    at = linearise(problem, np.zeros(problem.size))
    return lpcc_at(at, active_set(at, 1e-6), np.full(problem.size, 0.01), 0.01)


def test_sides_that_stay_zero_do_not_grow() -> None:
    """A linear program is solved with any sides at zero; without any it is a lower bound for all others."""
    random = np.random.default_rng(2)
    deadline = time.perf_counter() + 60
    for _ in range(10):
        lpcc = _lpcc(_random(random, 6, 4)[0])
        relaxed = lpcc.solve(lpcc.undecided, deadline)
        assert relaxed is not None
        for _ in range(5):
            zero = random.random((2, 4)) < 0.5
            solved = lpcc.solve(zero, deadline)
            assert solved is not None and solved.value >= relaxed.value - 1e-9
            assert (lpcc.growth(solved.s)[zero] <= 1e-8).all()


def test_both_searches_agree() -> None:
    """The mixed-integer program and the depth-first search find the same: a bound of zero or a branch of descent."""
    random = np.random.default_rng(5)
    for _ in range(30):
        problem, parts = _random(random, 6, 4)
        lpcc = _lpcc(problem)
        deadline = time.perf_counter() + 60
        descent = _all_branches(*parts) < -1e-5
        for bound, zero in (lpcc.mixed_integer(deadline), lpcc.depth_first(-1e-5, deadline)):
            if descent:
                assert zero is not None and zero.shape == (2, 4) and zero.any(axis=0).all()
                solved = lpcc.solve(zero, deadline)
                assert solved is not None and solved.value < -1e-5
            else:
                assert bound >= -1e-5


def test_descent_is_followed_to_a_certified_point() -> None:
    """From a point with descent, the homotopy's solution of the same problem is certified."""
    problem, _, _ = KNOWN["kth3, C-stationary origin"]
    solution = solve(problem, Run(HomotopyOptions(tolerance=1e-8, sigma_factor=0.1)))
    certificate = b_stationary(problem, solution.w, activity=1e-4)
    assert solution.solved and certificate.verdict == "certified"


def test_an_infeasible_point_is_unknown() -> None:
    """A point that violates a constraint by more than the activity is unknown, with the violation as reason."""
    certificate = b_stationary(from_origin(X + Y, X, Y), np.array([-1e-3, 0.0]))
    assert certificate.verdict == "unknown" and "violates a constraint by 1.0e-03" in certificate.reason
    assert certificate.bound == -np.inf


def test_no_time_is_unknown() -> None:
    """Without time nothing is claimed."""
    certificate = b_stationary(SCHOLTES4, np.zeros(3), time_limit=0.0)
    assert (certificate.verdict, certificate.reason, certificate.bound) == ("unknown", "time limit", -np.inf)


@pytest.mark.slow
@pytest.mark.parametrize("odd", [None, 700])
def test_a_large_problem_is_decided_within_its_time_limit(odd: int | None) -> None:
    """A thousand copies of scholtes4 are B- and M-, not S-stationary; one copy with another cost is found and named."""
    copies = 1000
    slope = np.ones((1, copies))
    if odd is not None:
        slope[0, odd] = -1.0
    p = ca.SX.sym("p")
    block = Block(
        replace(SCHOLTES4.blocks[0].equations, parameters=p, cost=p * X + Y - Z),
        places=[Place(name=f"copy {k}") for k in range(copies)],
        index=np.arange(3 * copies).reshape(copies, 3).T,
        values=slope,
    )
    free = np.full(3 * copies, np.inf)
    problem = Mpcc(lower=-free, upper=free, start=np.zeros(3 * copies), blocks=[block])
    certificate = b_stationary(problem, problem.start, time_limit=LIMIT)
    stationary = stationarity(problem, problem.start, time_limit=LIMIT)
    assert stationary.biactive == certificate.biactive == copies
    assert stationary.kind == "M" and len(stationary.worst_pairs) == 5
    if odd is None:
        assert certificate.verdict == "certified"
    else:
        _check_descent(problem, problem.start, certificate)
        assert "pair 0, copy 700" in map(str, certificate.leaving)
