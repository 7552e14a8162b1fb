"""Stationarity of points of small problems whose multipliers are known, and of random ones against enumeration."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import linprog

from fesd_robot.complementarity import Complementarity, Label, Place
from fesd_robot.errors import DimensionError, SolverError
from fesd_robot.mpcc import Block, BlockEquations, Mpcc, linear_program, multipliers
from fesd_robot.mpcc import stationarity as stationarity_module
from fesd_robot.mpcc.derivatives import linearise
from fesd_robot.mpcc.stationarity import stationarity

from .known import X, Y, Z, from_origin, lower_rows, scaled, upper_rows, vanishing


def _vanishing(f: ca.SX) -> Mpcc:
    """min f, y >= 0, x y <= 0."""
    return vanishing(from_origin(f, X, Y))


SCHOLTES4 = from_origin(X + Y - Z, X, Y, 3, **lower_rows(4 * X - Z, 4 * Y - Z))

KNOWN = {
    "kth1, positive multipliers": (from_origin(X + Y, X, Y), [0, 0], "S"),
    "kth2, one side": (from_origin(X + (Y - 1) ** 2, X, Y), [0, 1], "S"),
    "kth3, solution": (from_origin(0.5 * (X - 1) ** 2 + (Y - 1) ** 2, X, Y), [0, 1], "S"),
    "kth3, other axis": (from_origin(0.5 * (X - 1) ** 2 + (Y - 1) ** 2, X, Y), [1, 0], "S"),
    "kth3, both multipliers negative": (from_origin(0.5 * (X - 1) ** 2 + (Y - 1) ** 2, X, Y), [0, 0], "C"),
    "ralph2, all multipliers zero": (from_origin(X**2 + Y**2 - 4 * X * Y, X, Y), [0, 0], "S"),
    "scholtes4, B- but not S-stationary": (SCHOLTES4, [0, 0, 0], "M"),
    "(x-1)^2 + y^2, y _|_ y-x, solution": (from_origin((X - 1) ** 2 + Y**2, Y, Y - X), [0.5, 0.5], "S"),
    "(x-1)^2 + y^2, y _|_ y-x, origin": (from_origin((X - 1) ** 2 + Y**2, Y, Y - X), [0, 0], "W"),
    "(y-1)^2 + x^2, y _|_ y-x, solution": (from_origin((Y - 1) ** 2 + X**2, Y, Y - X), [0.5, 0.5], "S"),
    "(y-1)^2 + x^2, y _|_ y-x, origin": (from_origin((Y - 1) ** 2 + X**2, Y, Y - X), [0, 0], "M"),
    "multipliers of both signs": (from_origin(X - Y, X, Y), [0, 0], "W"),
    "a slope along the free side": (from_origin((Y - 2) ** 2, X, Y), [0, 1], "none"),
    "no pair": (from_origin((X - 2) ** 2, ca.SX(0, 1), ca.SX(0, 1)), [2, 7], "S"),
    "three equal inequalities": (
        from_origin(X + Y, X, Y, **lower_rows(X + Y, X + Y, 2 * X + 2 * Y)),
        [0, 0],
        "S",
    ),
    "an equation as two inequalities": (
        from_origin(-X, X, Y, **lower_rows(X, -X, X)),
        [0, 0],
        "S",
    ),
    "at an upper bound": (from_origin(-X, X, Y, bounds=(None, np.array([1.0, 5.0]))), [1, 0], "S"),
    "at the wrong bound": (from_origin(-X, X, Y, bounds=(np.array([1.0, 0.0]), None)), [1, 0], "none"),
    "vanishing, both zero, S": (_vanishing(2 * Y), [0, 0], "S"),
    "vanishing, both zero, xi < 0": (_vanishing(-Y), [0, 0], "M"),
    "vanishing, both zero, nu < 0": (_vanishing(-X), [0, 0], "M"),
    "vanishing, both zero, both < 0": (_vanishing(-X - Y), [0, 0], "C"),
    "vanishing, both zero, signs differ": (_vanishing(-X + Y), [0, 0], "W"),
    "vanishing, both zero, nu > 0": (_vanishing(X + Y), [0, 0], "none"),
    "vanishing, G > 0": (_vanishing(-3 * Y), [1, 0], "S"),
    "vanishing, G < 0, pushed to H = 0": (_vanishing(3 * Y), [-1, 0], "S"),
    "vanishing, G < 0, pulled from H = 0": (_vanishing(-3 * Y), [-1, 0], "none"),
    "vanishing, H > 0, pushed to G = 0": (_vanishing(-X), [0, 1], "S"),
    "vanishing, H > 0, pulled from G = 0": (_vanishing(X), [0, 1], "none"),
    "vanishing, neither zero": (_vanishing((X + 1) ** 2), [-1, 1], "S"),
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
    result = stationarity(problem, w)
    assert result.kind == kind and result.undecided == ()
    size = max(1.0, float(abs(linearise(problem, w).gradient).max()))
    assert _equation(problem, w, result.multipliers) == pytest.approx(result.residual * size, abs=1e-9)
    assert (result.residual <= 1e-6) == (kind != "none")
    assert result.violation == 0.0 and result.unresolved == 0
    if kind in ("M", "C", "W"):
        assert result.biactive == 1 and result.worst_pairs == ("pair 0",)
    if kind == "S":
        assert result.worst_pairs == ()


@pytest.mark.parametrize("name", KNOWN)
@pytest.mark.parametrize("factors", [(1e3, 1, 1, 1), (1, 1e3, 1, 1), (1, 1, 1e3, 1), (1, 1, 1, 1e3), (1, 1e-3, 1e2, 1)])
def test_scaling_changes_nothing(name: str, factors: tuple[float, ...]) -> None:
    """Multiplying f, g, G or H by a positive factor leaves the verdict and divides the multiplier."""
    problem, point, kind = KNOWN[name]
    w = np.array(point, dtype=float)
    result = stationarity(scaled(problem, *factors), w)
    assert result.kind == kind
    if kind != "none" and name.startswith("kth"):
        expected = stationarity(problem, w).multipliers
        assert result.multipliers.G * factors[2] / factors[0] == pytest.approx(expected.G, abs=1e-6)
        assert result.multipliers.H * factors[3] / factors[0] == pytest.approx(expected.H, abs=1e-6)


@pytest.mark.parametrize("name", KNOWN)
def test_stating_a_pair_twice_cannot_strengthen_the_demand(name: str) -> None:
    """S, and whether there are multipliers at all, do not depend on redundant pairs; M and C only get weaker."""
    problem, point, kind = KNOWN[name]
    (block,) = problem.blocks
    conditions = [*block.complementarities, *block.complementarities]
    conditions += [replace(one, G=2 * one.G) for one in block.complementarities]
    equations = replace(block.equations, complementarities=conditions)
    twice = replace(problem, blocks=[replace(block, equations=equations)])
    weaker = stationarity(twice, np.array(point, dtype=float)).kind
    if kind in ("S", "none"):
        assert weaker == kind
    else:
        assert weaker != "S" and "MCW".index(weaker) <= "MCW".index(kind)


def test_bounds_that_repeat_a_side_do_not_count_twice() -> None:
    """x - y on x _|_ y is W-stationary at the origin, whether or not x, y >= 0 are bounds as well."""
    problem = from_origin(X - Y, X, Y, bounds=(0.0, None))
    result = stationarity(problem, np.zeros(2))
    assert result.kind == "W"
    assert [*result.multipliers.G, *result.multipliers.H] == pytest.approx([1.0, -1.0])


def _enumerated(c: np.ndarray, rows: np.ndarray, G: np.ndarray, H: np.ndarray, vanishes: np.ndarray) -> str:
    """The strongest condition at the origin of a linear problem with all pairs biactive, one LP per sign pattern."""
    free, plus, minus, zero = (None, None), (0, None), (None, 0), (0, 0)
    patterns = {
        "S": ([(plus, plus)], [(zero, plus)]),
        "M": ([(plus, plus), (zero, free), (free, zero)], [(zero, free), (minus, zero)]),
        "C": ([(plus, plus), (minus, minus)], [(zero, free), (minus, minus)]),
        "W": ([(free, free)], [(minus, free)]),
    }
    for kind, (both, one) in patterns.items():
        for choice in itertools.product(*(one if flag else both for flag in vanishes)):
            bounds = [plus] * len(rows) + [nu for nu, _ in choice] + [xi for _, xi in choice]
            A = np.vstack([rows, G, H]).T
            if linprog(np.zeros(A.shape[1]), A_eq=A, b_eq=c, bounds=bounds).status == 0:
                return kind
    return "none"


@pytest.mark.slow
def test_random_problems_agree_with_enumeration() -> None:
    """On linear problems with three biactive pairs of either sort the verdict is that of all sign patterns."""
    random = np.random.default_rng(4)
    seen = set()
    for _ in range(40):
        n, pairs, rows = int(random.integers(6, 9)), 3, 1
        G, H = random.integers(-2, 3, (2, pairs, n)).astype(float)
        g = random.integers(-2, 3, (rows, n)).astype(float)
        vanishes = random.random(pairs) < 0.4
        nu, xi = random.integers(-1, 2, (2, pairs))
        c = G.T @ np.where(vanishes, -abs(nu), nu) + H.T @ xi + g.T @ random.integers(0, 2, rows)
        c = c + (random.random() < 0.2) * random.integers(-1, 2, n)
        w = ca.SX.sym("w", n)
        problem = Mpcc.from_expressions(
            w=w, f=ca.dot(c, w), start=np.zeros(n), g=g @ w, G=G @ w, H=H @ w, g_bounds=(0.0, None)
        )
        expected = _enumerated(c, g, G, H, vanishes)
        assert stationarity(vanishing(problem, where=vanishes), np.zeros(n)).kind == expected
        seen.add(expected)
    assert seen == {"S", "M", "C", "W", "none"}


def test_derivatives_of_copies() -> None:
    """Gradient and Jacobians of a block with copies that share variables agree with differences of its values."""
    w, p = ca.SX.sym("w", 2), ca.SX.sym("p")
    left, right = places = Place(interval=0), Place(interval=1)
    first, second, pair = Label("a"), Label("b"), Label("c")
    block = Block(
        BlockEquations(
            name="f",
            variables=w,
            parameters=p,
            cost=p * w[0] ** 2 * w[1],
            rows=ca.sin(w),
            lower=np.zeros(2),
            upper=np.zeros(2),
            constraints=[first, second],
            complementarities=[Complementarity(pair, w[0] * w[1] + p, w[1] ** 3)],
        ),
        places=places,
        index=np.array([[0, 1], [1, 2]]),
        values=np.array([[2.0, 3.0]]),
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
    assert list(at.constraint_labels) == [first.at(left), second.at(left), first.at(right), second.at(right)]
    assert list(at.pair_labels) == [pair.at(left), pair.at(right)]
    assert at.g == pytest.approx(np.sin([0.3, -0.5, -0.5, 0.7]))


def test_a_pair_short_of_zero_is_counted() -> None:
    """Near (0, 1) both sides of a pair exceed the activity: the smaller is taken as zero, and the report says so."""
    result = stationarity(from_origin(X + (Y - 1) ** 2, X, Y), np.array([1e-4, 1.0]))
    assert (result.kind, result.unresolved, result.biactive) == ("S", 1, 0)
    assert list(result.multipliers.G) == pytest.approx([1.0])


def test_no_time_is_undecided() -> None:
    """Without time nothing is claimed and everything is open."""
    result = stationarity(from_origin(X + Y, X, Y), np.zeros(2), time_limit=0.0)
    assert result.kind == "none" and set(result.undecided) == {"S", "M", "C", "W"}


def test_a_violated_constraint_is_reported() -> None:
    """The violation of a row is relative to its gradient."""
    problem = from_origin(X + Y, X, Y, g=10 * X - 10)
    assert stationarity(problem, np.array([0.0, 0.0])).violation == pytest.approx(1.0)


def test_points_that_are_refused() -> None:
    """A point of another length and a derivative that is not finite are errors that name what is wrong."""
    with pytest.raises(DimensionError, match="w has shape"):
        stationarity(from_origin(X + Y, X, Y), np.zeros(3))
    with pytest.raises(SolverError, match="pair 0"):
        stationarity(from_origin(X + Y, ca.sqrt(X), Y), np.zeros(2))


@pytest.mark.parametrize(("slope", "kind"), [(1e-2, "S"), (1e-4, "S"), (1e-8, "none")])
def test_multipliers_that_hardly_exist(slope: float, kind: str) -> None:
    """min x with y + slope x >= 0 and -y >= 0 has multipliers 1 / slope; those above 1e7 do not count."""
    problem = from_origin(X, ca.SX(0, 1), ca.SX(0, 1), **lower_rows(Y + slope * X, -Y))
    result = stationarity(problem, np.zeros(2))
    assert result.kind == kind
    if kind == "S":
        assert result.multipliers.largest == pytest.approx(1 / slope)


def test_small_multipliers_are_preferred() -> None:
    """Where nearly dependent constraints leave a choice of multipliers, the ones without cancellation are returned."""
    rows = ca.vertcat(X, Y + 1e-6 * X, Y)
    problem = from_origin(X, ca.SX(0, 1), ca.SX(0, 1), g=rows)
    result = stationarity(problem, np.zeros(2))
    assert result.kind == "S" and result.multipliers.largest == pytest.approx(1.0)


@pytest.mark.parametrize("pairs", [5, 40])
def test_many_wrong_pairs_take_few_programs(pairs: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """An interior solution has wrong signs in every pair; M is found in four linear programs, however many these are.

    Every pair has min x + y - c z with z <= a x and z <= b y, which is M-, not S-stationary at the origin.
    """
    monkeypatch.setattr(multipliers, "MANY_UNKNOWNS", 0)
    monkeypatch.setattr(linear_program, "IPOPT_UNKNOWNS", 0)
    x, y, z = (ca.SX.sym(name, pairs) for name in "xyz")
    a, b, c = np.random.default_rng(0).uniform([[4], [4], [1]], [[5], [5], [2]], (3, pairs))
    problem = Mpcc.from_expressions(
        w=ca.vertcat(x, y, z),
        f=ca.sum1(x + y - ca.DM(c) * z),
        G=x,
        H=y,
        start=np.zeros(3 * pairs),
        **upper_rows(z - ca.DM(a) * x, z - ca.DM(b) * y),
    )
    programs: list[float] = []

    def counted(*args: Any, **options: Any) -> np.ndarray | None:
        programs.append(1.0)
        return multipliers.least_residual(*args, **options)

    monkeypatch.setattr(stationarity_module, "least_residual", counted)
    assert stationarity(problem, np.zeros(3 * pairs)).kind == "M"
    assert len(programs) == 4
