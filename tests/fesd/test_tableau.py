"""Runge-Kutta tableaus: known coefficients, order conditions, and the polynomials they reproduce."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from fesd_robot.fesd import Tableau, make_tableau
from fesd_robot.fesd.tableau import MAX_STAGES, Scheme

EVERY = list(product(("radau_iia", "gauss_legendre"), range(1, MAX_STAGES + 1)))
ROOT = np.sqrt(3) / 6


@pytest.fixture(scope="module", params=EVERY, ids=lambda pair: f"{pair[0]}-{pair[1]}")
def tableau(request: pytest.FixtureRequest) -> Tableau:
    return make_tableau(*request.param)


def _random(degree: int, seed: int = 0) -> Polynomial:
    return Polynomial(np.random.default_rng(seed).normal(size=degree + 1))


@pytest.mark.parametrize(
    ("scheme", "stages", "matrix", "weights", "nodes"),
    [
        ("radau_iia", 1, [[1]], [1], [1]),
        ("radau_iia", 2, [[5 / 12, -1 / 12], [3 / 4, 1 / 4]], [3 / 4, 1 / 4], [1 / 3, 1]),
        ("gauss_legendre", 1, [[1 / 2]], [1], [1 / 2]),
        ("gauss_legendre", 2, [[1 / 4, 1 / 4 - ROOT], [1 / 4 + ROOT, 1 / 4]], [1 / 2, 1 / 2], [0.5 - ROOT, 0.5 + ROOT]),
    ],
)
def test_textbook_coefficients(
    scheme: Scheme, stages: int, matrix: list[list[float]], weights: list[float], nodes: list[float]
) -> None:
    """Implicit Euler, midpoint and the two-stage schemes are those of the books."""
    found = make_tableau(scheme, stages)
    for coefficients, expected in ((found.A, matrix), (found.b, weights), (found.c, nodes)):
        assert coefficients == pytest.approx(np.array(expected), abs=1e-15)


def test_order_conditions(tableau: Tableau) -> None:
    """B(p), C(n_s) and D(p - n_s) hold, so the scheme has order 2 n_s - 1 (Radau IIA) or 2 n_s (Gauss-Legendre)."""
    A, b, c, stages = tableau.A, tableau.b, tableau.c, tableau.stages
    order = 2 * stages - (tableau.scheme == "radau_iia")
    assert tableau.order == order
    powers = np.arange(1, order + 1)[:, None]
    assert c ** (powers - 1) @ b == pytest.approx((1 / powers).ravel(), abs=1e-13)
    for k in range(1, stages + 1):
        assert A @ c ** (k - 1) == pytest.approx(c**k / k, abs=1e-13)
    for k in range(1, order - stages + 1):
        assert (b * c ** (k - 1)) @ A == pytest.approx(b * (1 - c**k) / k, abs=1e-13)
    assert max(tableau.order_defects().values()) <= 1e-13


def test_quadrature_ends_at_its_order(tableau: Tableau) -> None:
    """The weights integrate no power beyond the order: the order is not understated."""
    p = tableau.order
    assert abs(tableau.b @ tableau.c**p - 1 / (p + 1)) > 1e-12


def test_nodes(tableau: Tableau) -> None:
    """Nodes grow inside (0, 1]; the last one is the end of the step for Radau IIA only; weights are positive."""
    assert (np.diff(tableau.c) > 0).all() and tableau.c[0] > 0 and tableau.c[-1] <= 1
    assert tableau.ends_at_stage == (tableau.scheme == "radau_iia")
    assert (tableau.b > 0).all()


def test_polynomials_of_degree_n_s_are_exact(tableau: Tableau) -> None:
    """Derivative at the stages, value at the end and value in between of a polynomial of degree n_s are its own."""
    x = _random(tableau.stages)
    values = x(np.concatenate([[0.0], tableau.c]))
    assert tableau.derivative @ values == pytest.approx(x.deriv()(tableau.c), abs=1e-11)
    assert tableau.end @ values == pytest.approx(x(1.0), abs=1e-12)
    fraction = np.linspace(0, 1, 11)
    found = tableau.interpolate(np.column_stack([values, 2 * values]), fraction)
    assert found == pytest.approx(np.column_stack([x(fraction), 2 * x(fraction)]), abs=1e-12)


def test_one_degree_more_is_not_exact(tableau: Tableau) -> None:
    """The polynomial of degree n_s + 1 through the nodes is not reproduced between them."""
    nodes = np.concatenate([[0.0], tableau.c])
    vanishing = Polynomial.fromroots(nodes)
    assert np.abs(tableau.interpolate(vanishing(nodes)[:, None], np.array([0.5 * nodes[1]]))).max() <= 1e-15
    assert abs(vanishing(0.5 * nodes[1])) > 1e-10


def test_the_two_forms_are_one_scheme(tableau: Tableau) -> None:
    """Integral and differential form agree: D (x0; x0 + h A k) = h k, and the end is x0 + h b k."""
    rng = np.random.default_rng(2)
    x0, slopes = rng.normal(), rng.normal(size=tableau.stages)
    values = np.concatenate([[x0], x0 + tableau.A @ slopes])
    assert tableau.derivative @ values == pytest.approx(slopes, abs=1e-10)
    assert tableau.end @ values == pytest.approx(x0 + tableau.b @ slopes, abs=1e-11)


def test_one_step_has_the_order(tableau: Tableau) -> None:
    """One step of the rotation x' = i x misses exp(i h) by an error that falls like h^(p + 1)."""

    def error(h: float) -> float:
        stages = np.linalg.solve(np.eye(tableau.stages) - 1j * h * tableau.A, np.ones(tableau.stages))
        return float(abs(1 + 1j * h * tableau.b @ stages - np.exp(1j * h)))

    assert error(1.0) <= 0.5 ** (tableau.order - 1)
    if error(0.5) > 1e-13:
        assert np.log2(error(1.0) / error(0.5)) == pytest.approx(tableau.order + 1, abs=0.4)


@pytest.mark.parametrize("stages", [0, -1, MAX_STAGES + 1])
def test_a_wrong_number_of_stages_is_refused(stages: int) -> None:
    """The error names what was found and the range."""
    with pytest.raises(ValueError, match=f"stages must be between 1 and {MAX_STAGES}, found {stages}"):
        make_tableau("radau_iia", stages)


def test_an_unknown_scheme_is_refused() -> None:
    """The error names what was found and what there is."""
    with pytest.raises(ValueError, match=r"unknown scheme 'lobatto' \(valid: gauss_legendre, radau_iia\)"):
        make_tableau("lobatto", 2)  # type: ignore[arg-type]


@pytest.mark.parametrize("part", ["A", "b", "c"])
@pytest.mark.parametrize(("scheme", "stages"), [("radau_iia", 3), ("gauss_legendre", 2), ("radau_iia", 1)])
def test_a_perturbed_tableau_is_refused(scheme: Scheme, stages: int, part: str) -> None:
    """A coefficient that is off by 1e-9 does not pass construction."""
    good = make_tableau(scheme, stages)
    wrong = getattr(good, part).copy()
    wrong.flat[0] += 1e-9
    with pytest.raises(ValueError, match=f"tableau {scheme} with {stages} stages misses its order conditions by"):
        replace(good, **{part: wrong})


def test_an_overstated_order_is_refused() -> None:
    """A tableau that claims one order more than it has does not pass construction."""
    for scheme, stages in EVERY[:2] + EVERY[-9:-7]:
        good = make_tableau(scheme, stages)
        with pytest.raises(ValueError, match="misses its order conditions"):
            replace(good, order=good.order + 1)
