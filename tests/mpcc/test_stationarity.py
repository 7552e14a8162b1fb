"""Stationarity of points of small problems whose multipliers are known, and of random ones against enumeration."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import linprog

from fesd_robot.errors import DimensionError, SolverError
from fesd_robot.mpcc import Block, Mpcc
from fesd_robot.mpcc.derivatives import linearise
from fesd_robot.mpcc.stationarity import stationarity

W = ca.SX.sym("w", 3)
X, Y, Z = W[0], W[1], W[2]
FREE = np.full(2, np.inf)


def _mpcc(f: ca.SX, G: ca.SX, H: ca.SX, n: int = 2, **parts: Any) -> Mpcc:
    f, G, H = (ca.substitute(ca.SX(part), W[n:], np.zeros(3 - n)) for part in (f, G, H))
    return Mpcc.from_expressions(w=W[:n], f=f, G=G, H=H, start=np.zeros(n), **parts)


def _one_sided(f: ca.SX) -> Mpcc:
    """min f, y >= 0, x y <= 0."""
    return _block(ca.Function("vanishing", [W[:2], ca.SX(0, 1)], [f, ca.SX(0, 1), X, Y]), np.array([True]))


def _block(function: ca.Function, one_sided: np.ndarray) -> Mpcc:
    n, n_g = function.size1_in(0), function.size1_out(1)
    block = Block(
        copy_names=["only"],
        function=function,
        index=np.arange(n).reshape(-1, 1),
        parameters=np.zeros((0, 1)),
        lower=np.zeros(n_g),
        upper=np.full(n_g, np.inf),
        constraint_names=[f"row {i}" for i in range(n_g)],
        pair_names=[f"pair {i}" for i in range(len(one_sided))],
        one_sided=one_sided,
    )
    return Mpcc(lower=np.full(n, -np.inf), upper=np.full(n, np.inf), start=np.zeros(n), blocks=[block])


SCHOLTES4 = _mpcc(X + Y - Z, X, Y, 3, g=ca.vertcat(4 * X - Z, 4 * Y - Z), g_lower=np.zeros(2), g_upper=FREE)

KNOWN = {
    "kth1, positive multipliers": (_mpcc(X + Y, X, Y), [0, 0], "S"),
    "kth2, one side": (_mpcc(X + (Y - 1) ** 2, X, Y), [0, 1], "S"),
    "kth3, solution": (_mpcc(0.5 * (X - 1) ** 2 + (Y - 1) ** 2, X, Y), [0, 1], "S"),
    "kth3, other axis": (_mpcc(0.5 * (X - 1) ** 2 + (Y - 1) ** 2, X, Y), [1, 0], "S"),
    "kth3, both multipliers negative": (_mpcc(0.5 * (X - 1) ** 2 + (Y - 1) ** 2, X, Y), [0, 0], "C"),
    "ralph2, all multipliers zero": (_mpcc(X**2 + Y**2 - 4 * X * Y, X, Y), [0, 0], "S"),
    "scholtes4, B- but not S-stationary": (SCHOLTES4, [0, 0, 0], "M"),
    "(x-1)^2 + y^2, y _|_ y-x, solution": (_mpcc((X - 1) ** 2 + Y**2, Y, Y - X), [0.5, 0.5], "S"),
    "(x-1)^2 + y^2, y _|_ y-x, origin": (_mpcc((X - 1) ** 2 + Y**2, Y, Y - X), [0, 0], "W"),
    "(y-1)^2 + x^2, y _|_ y-x, solution": (_mpcc((Y - 1) ** 2 + X**2, Y, Y - X), [0.5, 0.5], "S"),
    "(y-1)^2 + x^2, y _|_ y-x, origin": (_mpcc((Y - 1) ** 2 + X**2, Y, Y - X), [0, 0], "M"),
    "multipliers of both signs": (_mpcc(X - Y, X, Y), [0, 0], "W"),
    "a slope along the free side": (_mpcc((Y - 2) ** 2, X, Y), [0, 1], "none"),
    "no pair": (_mpcc((X - 2) ** 2, ca.SX(0, 1), ca.SX(0, 1)), [2, 7], "S"),
    "three equal inequalities": (
        _mpcc(X + Y, X, Y, g=ca.vertcat(X + Y, X + Y, 2 * X + 2 * Y), g_lower=np.zeros(3), g_upper=np.full(3, np.inf)),
        [0, 0],
        "S",
    ),
    "an equation as two inequalities": (
        _mpcc(-X, X, Y, g=ca.vertcat(X, -X, X), g_lower=np.zeros(3), g_upper=np.full(3, np.inf)),
        [0, 0],
        "S",
    ),
    "at an upper bound": (_mpcc(-X, X, Y, upper=np.array([1.0, 5.0])), [1, 0], "S"),
    "at the wrong bound": (_mpcc(-X, X, Y, lower=np.array([1.0, 0.0])), [1, 0], "none"),
    "vanishing, both zero, S": (_one_sided(2 * Y), [0, 0], "S"),
    "vanishing, both zero, xi < 0": (_one_sided(-Y), [0, 0], "M"),
    "vanishing, both zero, nu < 0": (_one_sided(-X), [0, 0], "M"),
    "vanishing, both zero, both < 0": (_one_sided(-X - Y), [0, 0], "C"),
    "vanishing, both zero, signs differ": (_one_sided(-X + Y), [0, 0], "W"),
    "vanishing, both zero, nu > 0": (_one_sided(X + Y), [0, 0], "none"),
    "vanishing, G > 0": (_one_sided(-3 * Y), [1, 0], "S"),
    "vanishing, G < 0, pushed to H = 0": (_one_sided(3 * Y), [-1, 0], "S"),
    "vanishing, G < 0, pulled from H = 0": (_one_sided(-3 * Y), [-1, 0], "none"),
    "vanishing, H > 0, pushed to G = 0": (_one_sided(-X), [0, 1], "S"),
    "vanishing, H > 0, pulled from G = 0": (_one_sided(X), [0, 1], "none"),
    "vanishing, neither zero": (_one_sided((X + 1) ** 2), [-1, 1], "S"),
}


def _equation(problem: Mpcc, w: np.ndarray, multipliers: Any) -> float:
    at = linearise(problem, w)
    left = at.gradient - multipliers.lower + multipliers.upper + at.g_jacobian.T @ multipliers.g
    return float(abs(left - at.G_jacobian.T @ multipliers.G - at.H_jacobian.T @ multipliers.H).max())


@pytest.mark.parametrize("name", KNOWN)
def test_known_points(name: str) -> None:
    """The strongest condition is the known one, and the returned multipliers satisfy the equation as reported."""
    problem, point, kind = KNOWN[name]
    w = np.array(point, dtype=float)
    found = stationarity(problem, w)
    assert found.kind == kind and found.undecided == ()
    size = max(1.0, float(abs(linearise(problem, w).gradient).max()))
    assert _equation(problem, w, found.multipliers) == pytest.approx(found.residual * size, abs=1e-9)
    assert (found.residual <= 1e-6) == (kind != "none")
    assert found.violation == 0.0 and found.unresolved == 0
    if kind in ("M", "C", "W"):
        assert found.biactive == 1 and len(found.worst_pairs) == 1
        assert found.worst_pairs[0].startswith("pair 0 in ")
    if kind == "S":
        assert found.worst_pairs == ()


@pytest.mark.parametrize("name", KNOWN)
@pytest.mark.parametrize("factors", [(1e3, 1, 1, 1), (1, 1e3, 1, 1), (1, 1, 1e3, 1), (1, 1, 1, 1e3), (1, 1e-3, 1e2, 1)])
def test_scaling_changes_nothing(name: str, factors: tuple[float, ...]) -> None:
    """Multiplying f, g, G or H by a positive factor leaves the verdict and divides the multiplier."""
    problem, point, kind = KNOWN[name]
    original = problem.blocks[0]
    p = ca.SX(0, 1)
    local = ca.SX.sym("w", problem.size)
    parts = [factor * part for factor, part in zip(factors, original.function(local, p), strict=True)]
    scaled = replace(problem, blocks=[replace(original, function=ca.Function("scaled", [local, p], parts))])
    w = np.array(point, dtype=float)
    found = stationarity(scaled, w)
    assert found.kind == kind
    if kind != "none" and name.startswith("kth"):
        expected = stationarity(problem, w).multipliers
        assert found.multipliers.G * factors[2] / factors[0] == pytest.approx(expected.G, abs=1e-6)
        assert found.multipliers.H * factors[3] / factors[0] == pytest.approx(expected.H, abs=1e-6)


@pytest.mark.parametrize("name", KNOWN)
def test_stating_a_pair_twice_cannot_strengthen_the_demand(name: str) -> None:
    """S, and whether there are multipliers at all, do not depend on redundant pairs; M and C only get weaker."""
    problem, point, kind = KNOWN[name]
    old, p, local = problem.blocks[0], ca.SX(0, 1), ca.SX.sym("w", problem.size)
    f, g, G, H = old.function(local, p)
    function = ca.Function("twice", [local, p], [f, g, ca.vertcat(G, G, 2 * G), ca.vertcat(H, H, H)])
    names = [f"pair {i}" for i in range(3 * len(old.pair_names))]
    block = replace(old, function=function, pair_names=names, one_sided=np.tile(old.sign_free, 3))
    twice = replace(problem, blocks=[block])
    found = stationarity(twice, np.array(point, dtype=float)).kind
    if kind in ("S", "none"):
        assert found == kind
    else:
        assert found != "S" and "MCW".index(found) <= "MCW".index(kind)


def test_bounds_that_repeat_a_side_do_not_count_twice() -> None:
    """x - y on x _|_ y is W-stationary at the origin, whether or not x, y >= 0 are bounds as well."""
    problem = _mpcc(X - Y, X, Y, lower=np.zeros(2))
    found = stationarity(problem, np.zeros(2))
    assert found.kind == "W"
    assert [*found.multipliers.G, *found.multipliers.H] == pytest.approx([1.0, -1.0])


def _enumerated(c: np.ndarray, rows: np.ndarray, G: np.ndarray, H: np.ndarray, one_sided: np.ndarray) -> str:
    """The strongest condition at the origin of a linear problem with all pairs biactive, one LP per sign pattern."""
    free, plus, minus, zero = (None, None), (0, None), (None, 0), (0, 0)
    patterns = {
        "S": ([(plus, plus)], [(zero, plus)]),
        "M": ([(plus, plus), (zero, free), (free, zero)], [(zero, free), (minus, zero)]),
        "C": ([(plus, plus), (minus, minus)], [(zero, free), (minus, minus)]),
        "W": ([(free, free)], [(minus, free)]),
    }
    for kind, (two, one) in patterns.items():
        for choice in itertools.product(*(one if flag else two for flag in one_sided)):
            bounds = [plus] * len(rows) + [nu for nu, _ in choice] + [xi for _, xi in choice]
            A = np.vstack([rows, G, H]).T
            if linprog(np.zeros(A.shape[1]), A_eq=A, b_eq=c, bounds=bounds).status == 0:
                return kind
    return "none"


def test_random_problems_agree_with_enumeration() -> None:
    """On linear problems with three biactive pairs of either sort the verdict is that of all sign patterns."""
    random = np.random.default_rng(4)
    seen = set()
    for _ in range(40):
        n, pairs, rows = int(random.integers(6, 9)), 3, 1
        G, H = random.integers(-2, 3, (2, pairs, n)).astype(float)
        g = random.integers(-2, 3, (rows, n)).astype(float)
        one_sided = random.random(pairs) < 0.4
        nu, xi = random.integers(-1, 2, (2, pairs))
        c = G.T @ np.where(one_sided, -abs(nu), nu) + H.T @ xi + g.T @ random.integers(0, 2, rows)
        c = c + (random.random() < 0.2) * random.integers(-1, 2, n)
        w = ca.SX.sym("w", n)
        function = ca.Function("random", [w, ca.SX(0, 1)], [ca.dot(c, w), g @ w, G @ w, H @ w])
        found = stationarity(_block(function, one_sided), np.zeros(n))
        expected = _enumerated(c, g, G, H, one_sided)
        assert found.kind == expected
        seen.add(expected)
    assert seen == {"S", "M", "C", "W", "none"}


def test_derivatives_of_copies() -> None:
    """Gradient and Jacobians of a block with copies that share variables agree with differences of its values."""
    w, p = ca.SX.sym("w", 2), ca.SX.sym("p")
    function = ca.Function("f", [w, p], [p * w[0] ** 2 * w[1], ca.sin(w), w[0] * w[1] + p, w[1] ** 3])
    block = Block(
        copy_names=["left", "right"],
        function=function,
        index=np.array([[0, 1], [1, 2]]),
        parameters=np.array([[2.0, 3.0]]),
        lower=np.zeros(2),
        upper=np.zeros(2),
        constraint_names=["a", "b"],
        pair_names=["c"],
    )
    problem = Mpcc(lower=-np.ones(3), upper=np.ones(3), start=np.zeros(3), blocks=[block])
    point, step = np.array([0.3, -0.5, 0.7]), 1e-6
    at = linearise(problem, point)
    for i, unit in enumerate(np.eye(3)):
        ahead, behind = (linearise(problem, point + sign * step * unit) for sign in (1, -1))
        assert at.gradient[i] == pytest.approx((ahead.f - behind.f) / (2 * step), abs=1e-8)
        for value, jacobian in (("g", at.g_jacobian), ("G", at.G_jacobian), ("H", at.H_jacobian)):
            difference = (getattr(ahead, value) - getattr(behind, value)) / (2 * step)
            assert jacobian.toarray()[:, i] == pytest.approx(difference, abs=1e-8)
    assert at.constraint_names == ["a in left", "b in left", "a in right", "b in right"]
    assert at.pair_names == ["c in left", "c in right"]
    assert at.g == pytest.approx(np.sin([0.3, -0.5, -0.5, 0.7]))


def test_a_pair_short_of_zero_is_counted() -> None:
    """Near (0, 1) both sides of a pair exceed the activity: the smaller is taken as zero, and the report says so."""
    found = stationarity(_mpcc(X + (Y - 1) ** 2, X, Y), np.array([1e-4, 1.0]))
    assert (found.kind, found.unresolved, found.biactive) == ("S", 1, 0)
    assert list(found.multipliers.G) == pytest.approx([1.0])


def test_no_time_is_undecided() -> None:
    """Without time nothing is claimed and everything is open."""
    found = stationarity(_mpcc(X + Y, X, Y), np.zeros(2), time_limit=0.0)
    assert found.kind == "none" and set(found.undecided) == {"S", "M", "C", "W"}


def test_a_violated_constraint_is_reported() -> None:
    """The violation of a row is told relative to its gradient."""
    problem = _mpcc(X + Y, X, Y, g=10 * X - 10)
    assert stationarity(problem, np.array([0.0, 0.0])).violation == pytest.approx(1.0)


def test_points_that_cannot_be_judged() -> None:
    """A point of another length and a derivative that is not finite are errors that name what is wrong."""
    with pytest.raises(DimensionError, match="w has shape"):
        stationarity(_mpcc(X + Y, X, Y), np.zeros(3))
    with pytest.raises(SolverError, match="pair 0"):
        stationarity(_mpcc(X + Y, ca.sqrt(X), Y), np.zeros(2))


@pytest.mark.parametrize(("slope", "kind"), [(1e-2, "S"), (1e-4, "S"), (1e-8, "none")])
def test_multipliers_that_hardly_exist(slope: float, kind: str) -> None:
    """min x with y + slope x >= 0 and -y >= 0 has multipliers 1 / slope; those above 1e7 do not count."""
    problem = _mpcc(X, ca.SX(0, 1), ca.SX(0, 1), g=ca.vertcat(Y + slope * X, -Y), g_lower=np.zeros(2), g_upper=FREE)
    found = stationarity(problem, np.zeros(2))
    assert found.kind == kind
    if kind == "S":
        assert found.multipliers.largest == pytest.approx(1 / slope)


def test_small_multipliers_are_preferred() -> None:
    """Where nearly dependent constraints leave a choice of multipliers, the ones without cancellation are returned."""
    rows = ca.vertcat(X, Y + 1e-6 * X, Y)
    problem = _mpcc(X, ca.SX(0, 1), ca.SX(0, 1), g=rows, g_lower=np.zeros(3), g_upper=np.zeros(3))
    found = stationarity(problem, np.zeros(2))
    assert found.kind == "S" and found.multipliers.largest == pytest.approx(1.0)
