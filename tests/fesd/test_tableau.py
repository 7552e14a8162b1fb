"""Runge-Kutta tableaus: known coefficients, order conditions, measured order, and the polynomials they reproduce."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import get_args

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.optimize import fsolve

from fesd_robot.errors import ModelError, OptionError
from fesd_robot.fesd.schemes import FAMILIES
from fesd_robot.fesd.tableau import Scheme, Tableau, make_tableau
from fesd_robot.ranges import MAX_STAGES

EVERY = [(scheme, stages) for scheme, f in FAMILIES.items() for stages in range(f.fewest, f.most + 1)]
COLLOCATION = [pair for pair in EVERY if pair[0] in ("gauss_legendre", "radau_iia")]
SMALL = [pair for pair in EVERY if pair[1] in (2, 3) or FAMILIES[pair[0]].explicit]
W3, W6, W15 = np.sqrt([3.0, 6.0, 15.0])


def _name(pair: object) -> str:
    return f"{pair[0]}-{pair[1]}" if isinstance(pair, tuple) else str(pair)


each = partial(pytest.mark.parametrize, ids=_name)


@pytest.fixture(scope="module", params=EVERY, ids=_name)
def tableau(request: pytest.FixtureRequest) -> Tableau:
    return make_tableau(*request.param)


@pytest.fixture(scope="module", params=COLLOCATION, ids=_name)
def collocation(request: pytest.FixtureRequest) -> Tableau:
    return make_tableau(*request.param)


def _over(matrix: list[list[float]], denominator: float) -> np.ndarray:
    return np.array(matrix) / denominator


TRAPEZOID, SIMPSON = ([0.5, 0.5], [0, 1]), ([1 / 6, 2 / 3, 1 / 6], [0, 0.5, 1])
BOOKS: dict[tuple[str, int], tuple[object, ...]] = {
    ("gauss_legendre", 1): ([[0.5]], [1], [0.5]),
    ("gauss_legendre", 2): (_over([[3, 3 - 2 * W3], [3 + 2 * W3, 3]], 12), [0.5, 0.5], [0.5 - W3 / 6, 0.5 + W3 / 6]),
    ("gauss_legendre", 3): (
        [
            [5 / 36, 2 / 9 - W15 / 15, 5 / 36 - W15 / 30],
            [5 / 36 + W15 / 24, 2 / 9, 5 / 36 - W15 / 24],
            [5 / 36 + W15 / 30, 2 / 9 + W15 / 15, 5 / 36],
        ],
        [5 / 18, 4 / 9, 5 / 18],
        [0.5 - W15 / 10, 0.5, 0.5 + W15 / 10],
    ),
    ("radau_ia", 1): ([[1]], [1], [0]),
    ("radau_ia", 2): ([[1 / 4, -1 / 4], [1 / 4, 5 / 12]], [1 / 4, 3 / 4], [0, 2 / 3]),
    ("radau_ia", 3): (
        _over(
            [[40, -20 - 20 * W6, -20 + 20 * W6], [40, 88 + 7 * W6, 88 - 43 * W6], [40, 88 + 43 * W6, 88 - 7 * W6]], 360
        ),
        [1 / 9, (16 + W6) / 36, (16 - W6) / 36],
        [0, (6 - W6) / 10, (6 + W6) / 10],
    ),
    ("radau_iia", 1): ([[1]], [1], [1]),
    ("radau_iia", 2): ([[5 / 12, -1 / 12], [3 / 4, 1 / 4]], [3 / 4, 1 / 4], [1 / 3, 1]),
    ("radau_iia", 3): (
        [
            [(88 - 7 * W6) / 360, (296 - 169 * W6) / 1800, (-2 + 3 * W6) / 225],
            [(296 + 169 * W6) / 1800, (88 + 7 * W6) / 360, (-2 - 3 * W6) / 225],
            [(16 - W6) / 36, (16 + W6) / 36, 1 / 9],
        ],
        [(16 - W6) / 36, (16 + W6) / 36, 1 / 9],
        [(4 - W6) / 10, (4 + W6) / 10, 1],
    ),
    ("lobatto_iiia", 2): ([[0, 0], [0.5, 0.5]], *TRAPEZOID),
    ("lobatto_iiia", 3): (_over([[0, 0, 0], [5, 8, -1], [4, 16, 4]], 24), *SIMPSON),
    ("lobatto_iiib", 2): ([[0.5, 0], [0.5, 0]], *TRAPEZOID),
    ("lobatto_iiib", 3): (_over([[1, -1, 0], [1, 2, 0], [1, 5, 0]], 6), *SIMPSON),
    ("lobatto_iiic", 2): ([[0.5, -0.5], [0.5, 0.5]], *TRAPEZOID),
    ("lobatto_iiic", 3): (_over([[2, -4, 2], [2, 5, -1], [2, 8, 2]], 12), *SIMPSON),
    ("explicit_euler", 1): ([[0]], [1], [0]),
    ("heun_2", 2): ([[0, 0], [1, 0]], *TRAPEZOID),
    ("heun_3", 3): ([[0, 0, 0], [1 / 3, 0, 0], [0, 2 / 3, 0]], [1 / 4, 0, 3 / 4], [0, 1 / 3, 2 / 3]),
    ("runge_kutta_4", 4): (
        [[0, 0, 0, 0], [0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 1, 0]],
        [1 / 6, 1 / 3, 1 / 3, 1 / 6],
        [0, 0.5, 0.5, 1],
    ),
}
"""A, b, c as printed by Hairer & Wanner, Solving ODEs II, IV.5, and Hairer, Norsett & Wanner, Solving ODEs I, II.1."""


@each("pair", BOOKS)
def test_textbook_coefficients(pair: tuple[Scheme, int]) -> None:
    """Every family has the coefficients of the books for small numbers of stages."""
    tableau = make_tableau(*pair)
    for coefficients, expected in zip((tableau.A, tableau.b, tableau.c), BOOKS[pair], strict=True):
        assert coefficients == pytest.approx(np.array(expected), abs=1e-15)


def test_names() -> None:
    """The names of the type are those of the families, and the books have each of them."""
    assert set(get_args(Scheme)) == set(FAMILIES) == {scheme for scheme, _ in BOOKS}


ASSUMPTIONS = {  # s stages: p, eta, zeta minus multiples of s
    "gauss_legendre": (0, 0, 0),
    "radau_ia": (-1, -1, 0),
    "radau_iia": (-1, 0, -1),
    "lobatto_iiia": (-2, 0, -2),
    "lobatto_iiib": (-2, -2, 0),
    "lobatto_iiic": (-2, -1, -1),
}


def test_order_conditions(tableau: Tableau) -> None:
    """B(p), C(eta), D(zeta) hold with p <= eta + zeta + 1, 2 eta + 2, or the rooted trees; C(eta + 1) does not."""
    A, b, c, s, order = tableau.A, tableau.b, tableau.c, tableau.stages, tableau.order
    powers = np.arange(1, order + 1)[:, None]
    assert c ** (powers - 1) @ b == pytest.approx((1 / powers).ravel(), abs=1e-14)
    assert max(tableau.order_defects().values()) <= 1e-14
    if tableau.explicit:
        assert order == s and tableau.stage_order == 1
        return
    loss = ASSUMPTIONS[tableau.scheme]
    eta, zeta = s + loss[1], s + loss[2]
    assert (order, tableau.stage_order) == (2 * s + loss[0], eta)
    assert order <= eta + zeta + 1 and order <= 2 * eta + 2
    for k in range(1, eta + 1):
        assert A @ c ** (k - 1) == pytest.approx(c**k / k, abs=1e-14)
    for k in range(1, zeta + 1):
        assert (b * c ** (k - 1)) @ A == pytest.approx(b * (1 - c**k) / k, abs=1e-14)


def test_names_of_the_defects() -> None:
    """The conditions are listed by their names; where nodes are not row sums these are not among them."""
    assert set(make_tableau("lobatto_iiic", 3).order_defects()) == {"B(4)", "row sums", "C(2)", "D(2)"}
    assert set(make_tableau("lobatto_iiib", 2).order_defects()) == {"B(2)", "D(2)"}
    assert set(make_tableau("heun_2").order_defects()) == {"B(2)", "row sums"}
    trees = [name for name in make_tableau("runge_kutta_4").order_defects() if name.startswith("sum")]
    assert [name.split(" = ")[1] for name in trees] == ["1/6", "1/8", "1/12", "1/24"]


def test_quadrature_ends_at_its_order(tableau: Tableau) -> None:
    """The weights integrate no power beyond the order: the order is not understated."""
    assert abs(tableau.b @ tableau.c**tableau.order - 1 / (tableau.order + 1)) > 1e-12


def _spiral(x: np.ndarray) -> np.ndarray:
    grow = 1 - x @ x
    return np.array([grow * x[0] - x[1], x[0] + grow * x[1]])


def _spiral_error(tableau: Tableau, steps: int, duration: float = 1.5) -> float:
    """Distance from r = (1 + 3 exp(-2 t))^(-1/2), angle t, which starts from (1/2, 0)."""
    x, h, s = np.array([0.5, 0.0]), duration / steps, tableau.stages
    slopes = np.tile(_spiral(x), s)

    def residual(flat: np.ndarray) -> np.ndarray:
        K = flat.reshape(s, 2)
        return flat - np.concatenate([_spiral(x + h * row @ K) for row in tableau.A])

    for _ in range(steps):
        slopes = fsolve(residual, slopes, xtol=1e-12)
        slopes = slopes - residual(slopes)  # a fixed-point iteration gains another factor of h
        x = x + h * tableau.b @ slopes.reshape(s, 2)
    radius = 1 / np.sqrt(1 + 3 * np.exp(-2 * duration))
    return float(np.linalg.norm(x - radius * np.array([np.cos(duration), np.sin(duration)])))


@each("pair", SMALL)
def test_measured_order(pair: tuple[Scheme, int]) -> None:
    """On x' = (1 - |x|^2) x + rotation the error falls with the order of the scheme."""
    tableau = make_tableau(*pair)
    coarse = {1: 80, 2: 40, 3: 20, 4: 12, 5: 8, 6: 6}[tableau.order]
    slope = np.log2(_spiral_error(tableau, coarse) / _spiral_error(tableau, 2 * coarse))
    assert slope == pytest.approx(tableau.order, abs=0.2)


def test_kind(tableau: Tableau) -> None:
    """Explicitness, stages at the ends, collocation, and distinct nodes in [0, 1] are those of the family."""
    scheme = tableau.scheme
    assert tableau.explicit == FAMILIES[scheme].explicit
    assert tableau.ends_at_stage == (scheme in ("radau_iia", "lobatto_iiia", "lobatto_iiic"))
    assert tableau.starts_at_stage == (scheme == "lobatto_iiia" or tableau.explicit)
    assert tableau.collocation == (scheme in ("radau_iia", "gauss_legendre"))
    assert [tableau.derivative is None, tableau.end is None] == [not tableau.collocation] * 2
    if not tableau.explicit:
        assert (np.diff(tableau.c) > 0).all() and tableau.c[-1] <= 1 and (tableau.b > 0).all()
        assert (tableau.c[0] == 0.0) == (scheme.startswith("lobatto") or scheme == "radau_ia")


@pytest.mark.parametrize("stages", range(2, MAX_STAGES + 1))
def test_symmetry(stages: int) -> None:
    """Gauss, Lobatto IIIA and IIIB are their own mirror images in time, and IIIA with IIIB is a symplectic pair."""
    for scheme in ("gauss_legendre", "lobatto_iiia", "lobatto_iiib"):
        tableau = make_tableau(scheme, stages)
        assert tableau.c + tableau.c[::-1] == pytest.approx(np.ones(stages), abs=2e-15)
        assert tableau.A + tableau.A[::-1, ::-1] == pytest.approx(np.tile(tableau.b, (stages, 1)), abs=2e-14)
    A, b = make_tableau("lobatto_iiia", stages).A, tableau.b
    assert b[:, None] * tableau.A + (b[:, None] * A).T == pytest.approx(np.outer(b, b), abs=1e-14)


def test_continuous_weights(tableau: Tableau) -> None:
    """Dense output starts at 0, ends at b, and integrates every polynomial that the distinct nodes determine."""
    fraction = np.linspace(0, 1, 9)
    weights = tableau.continuous_weights(fraction)
    assert weights.shape == (9, tableau.stages)
    assert weights[0] == pytest.approx(0, abs=1e-15) and weights[-1] == pytest.approx(tableau.b, abs=1e-14)
    for k in range(1, len(set(tableau.c)) + 1):
        assert weights @ tableau.c ** (k - 1) == pytest.approx(fraction**k / k, abs=1e-14)


def test_equal_nodes_share_their_weight() -> None:
    """Both midpoint slopes of the classical scheme have the weight tau^2 - 2/3 tau^3."""
    tau = np.array([0.3, 0.7])
    weights = make_tableau("runge_kutta_4").continuous_weights(tau)
    middle = tau**2 - 2 / 3 * tau**3
    expected = np.column_stack([tau - 1.5 * tau**2 + 2 / 3 * tau**3, middle, middle, 2 / 3 * tau**3 - tau**2 / 2])
    assert weights == pytest.approx(expected, abs=1e-15)


def test_dense_output_of_collocation_is_its_polynomial(collocation: Tableau) -> None:
    """X_0 + h sum_j b_j(tau) K_j is the polynomial through X_0 and the stages; D and e are its slope and its end."""
    rng, fraction = np.random.default_rng(2), np.linspace(0, 1, 11)
    x0, slopes = rng.normal(size=2), rng.normal(size=(collocation.stages, 2))
    values = np.vstack([x0, x0 + collocation.A @ slopes])
    dense = x0 + collocation.continuous_weights(fraction) @ slopes
    assert collocation.interpolate(values, fraction) == pytest.approx(dense, abs=1e-12)
    assert collocation.derivative @ values == pytest.approx(slopes, abs=1e-10)
    assert collocation.end @ values == pytest.approx(x0 + collocation.b @ slopes, abs=1e-11)


def test_polynomials_of_degree_n_s_are_exact(collocation: Tableau) -> None:
    """Derivative at the stages, value at the end and value in between of a polynomial of degree n_s are its own."""
    x = Polynomial(np.random.default_rng(0).normal(size=collocation.stages + 1))
    values, fraction = x(np.concatenate([[0.0], collocation.c])), np.linspace(0, 1, 11)
    assert collocation.derivative @ values == pytest.approx(x.deriv()(collocation.c), abs=1e-11)
    assert collocation.end @ values == pytest.approx(x(1.0), abs=1e-12)
    interpolated = collocation.interpolate(np.column_stack([values, 2 * values]), fraction)
    assert interpolated == pytest.approx(np.column_stack([x(fraction), 2 * x(fraction)]), abs=1e-12)


@each("pair", [pair for pair in SMALL if pair not in COLLOCATION])
def test_other_schemes_are_not_interpolated(pair: tuple[Scheme, int]) -> None:
    """A scheme that is no collocation scheme refuses to interpolate its states and says what to use."""
    tableau = make_tableau(*pair)
    with pytest.raises(ModelError, match=rf"{pair[0]} is no collocation scheme .*continuous_weights"):
        tableau.interpolate(np.zeros((tableau.stages + 1, 1)), np.zeros(1))


@each("pair", [*SMALL, ("radau_ia", 1), *[pair for pair in EVERY if pair[1] == MAX_STAGES]])
def test_a_perturbed_tableau_is_refused(pair: tuple[Scheme, int]) -> None:
    """No coefficient of A, b or c can be off by 1e-6, in either direction."""
    good = make_tableau(*pair)
    for part in ("A", "b", "c"):
        for entry in range(getattr(good, part).size):
            for change in (1e-6, -1e-6):
                wrong = getattr(good, part).copy()
                wrong.flat[entry] += change
                with pytest.raises(ModelError, match=f"tableau {pair[0]} with {pair[1]} stages misses its order"):
                    replace(good, **{part: wrong})


def test_wrong_orders_and_undefined_numbers_are_refused(tableau: Tableau) -> None:
    """A tableau that claims one order more than it has, or has no number as a coefficient, does not pass."""
    with pytest.raises(ModelError, match="misses its order conditions"):
        replace(tableau, order=tableau.order + 1)
    with pytest.raises(ModelError, match="misses its order conditions"):
        replace(tableau, b=tableau.b * np.nan)


@pytest.mark.parametrize(
    ("scheme", "stages", "message"),
    [
        ("radau_iia", 0, "stages of radau_iia must be between 1 and 9, found 0"),
        ("gauss_legendre", 10, "stages of gauss_legendre must be between 1 and 9, found 10"),
        ("lobatto_iiic", 1, "stages of lobatto_iiic must be between 2 and 9, found 1"),
        ("lobatto_iiia", None, r"lobatto_iiia needs a number of stages \(valid: 2 to 9\)"),
        ("explicit_euler", 2, "explicit_euler has 1 stage, found 2"),
        ("runge_kutta_4", 3, "runge_kutta_4 has 4 stages, found 3"),
        ("lobatto_3", 2, r"unknown scheme 'lobatto_3' \(did you mean 'lobatto_iii.'\?\) \(valid: explicit_euler, .*\)"),
        ("xyz", 2, r"^unknown scheme 'xyz' \(valid: explicit_euler, [^(]*, runge_kutta_4\)$"),
    ],
)
def test_what_does_not_exist_is_refused(scheme: Scheme, stages: int | None, message: str) -> None:
    """The error names what was found and what there is."""
    with pytest.raises(OptionError, match=message):
        make_tableau(scheme, stages)


def test_explicit_schemes_know_their_stages() -> None:
    """The number of stages may be left out where there is one only, and given if it is that one."""
    for scheme, stages in (("explicit_euler", 1), ("heun_2", 2), ("heun_3", 3), ("runge_kutta_4", 4)):
        assert make_tableau(scheme).stages == make_tableau(scheme, stages).stages == stages  # type: ignore[arg-type]
