"""An NLP without its fixed variables and free rows: the same functions, the same solution."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from fesd_robot.mpcc import Mpcc
from fesd_robot.mpcc.assembly import Compile, assemble
from fesd_robot.mpcc.relaxations import relaxation_named
from fesd_robot.nlp import FREE, Nlp, NlpNumbers, NlpPoint, NlpSettings, ReducedNlp, prepared

SIZE = 6
W = ca.SX.sym("w", SIZE)
ROWS = ca.vertcat(W[0] * W[1] - W[2], W[2] + W[3] ** 2, ca.sin(W[4]) * W[0], W[5] - W[1], W[1] * W[3] + W[4])
PROBLEM = Mpcc.from_expressions(
    w=W,
    f=ca.sumsqr(W - np.arange(SIZE)) + W[0] * W[4] ** 2,
    G=ca.SX(0, 1),
    H=ca.SX(0, 1),
    start=np.full(SIZE, 0.5),
    g=ROWS,
)
G_LOWER = np.array([0.0, -np.inf, -np.inf, -1.0, -np.inf])
G_UPPER = np.array([0.0, np.inf, 0.3, np.inf, np.inf])
FIXED = np.array([False, False, True, False, False, True])
LOWER, UPPER = np.where(FIXED, 0.7, -np.inf), np.where(FIXED, 0.7, np.inf)
NUMBERS = NlpNumbers(LOWER, UPPER, G_LOWER, G_UPPER, np.zeros(2))


@pytest.fixture(scope="module", params=["never", "always"])
def whole(request: pytest.FixtureRequest) -> Nlp:
    """All of an NLP with two fixed variables and two free rows, interpreted and compiled."""
    compiled: Compile = request.param
    nlp = assemble(PROBLEM, relaxation_named("scholtes"), compiled).program
    assert nlp.rows == len(G_LOWER)
    return nlp


def test_functions_are_those_of_what_is_left(whole: Nlp) -> None:
    """Values and derivatives of the reduced NLP are the entries of the whole's with fixed variables at their bounds."""
    reduced = ReducedNlp.of(whole, NUMBERS)
    own, q = reduced.numbers(NUMBERS), reduced.numbers(NUMBERS).p
    free, rows = np.flatnonzero(~FIXED), [0, 2, 3]
    assert np.flatnonzero(reduced.free).tolist() == free.tolist() and np.flatnonzero(reduced.bounded).tolist() == rows
    random, p = np.random.default_rng(3), np.zeros(2)
    x = np.where(FIXED, 0.7, random.normal(size=SIZE))
    multiplier = np.zeros(len(G_LOWER))
    multiplier[rows] = random.normal(size=3)
    f, g = whole.nlp(x, p)
    assert [float(one) for one in (reduced.nlp.nlp(x[free], q)[0], reduced.nlp.gradient(x[free], q)[0])] == [
        float(f)
    ] * 2
    for found, expected in (
        (reduced.nlp.nlp(x[free], q)[1], np.asarray(g)[rows]),
        (reduced.nlp.gradient(x[free], q)[1], np.asarray(whole.gradient(x, p)[1])[free]),
        (reduced.nlp.jacobian(x[free], q)[1], np.asarray(ca.densify(whole.jacobian(x, p)[1]))[np.ix_(rows, free)]),
        (
            reduced.nlp.hessian(x[free], q, 0.4, multiplier[rows]),
            np.asarray(ca.densify(whole.hessian(x, p, 0.4, multiplier)))[np.ix_(free, free)],
        ),
    ):
        assert np.asarray(ca.densify(found)) == pytest.approx(expected, abs=1e-15)
    assert reduced.nlp.hessian.sparsity_out(0).is_triu()
    assert own.g_lower.tolist() == G_LOWER[rows].tolist() and own.g_upper.tolist() == G_UPPER[rows].tolist()


def test_the_solution_is_that_of_the_whole(whole: Nlp) -> None:
    """Variables and the multipliers of bounded rows agree; multipliers of what was left out are zero."""
    start = NlpPoint.without_multipliers(np.where(FIXED, 0.7, 0.5), len(G_LOWER))
    settings, reduced = NlpSettings(FREE, tolerance=1e-10), ReducedNlp.of(whole, NUMBERS)
    expected = prepared(whole, settings).solve(NUMBERS, start).point
    part = prepared(reduced.nlp, settings).solve(reduced.numbers(NUMBERS), reduced.part(start))
    found = reduced.whole(part.point, start)
    assert part.converged and found.x == pytest.approx(expected.x, abs=1e-8)
    assert found.lam_g == pytest.approx(expected.lam_g, abs=1e-7) and np.abs(found.lam_g).max() > 0.1
    assert not found.lam_g[~reduced.bounded].any() and not found.lam_x[FIXED].any()


def test_where_nothing_is_left_out_it_is_the_same(whole: Nlp) -> None:
    """Without fixed variables and free rows the functions are those of the whole, and so are points."""
    unbounded = np.full(SIZE, np.inf)
    reduced = ReducedNlp.of(whole, NlpNumbers(-unbounded, unbounded, np.full(len(G_LOWER), -1.0), G_UPPER, np.zeros(2)))
    assert reduced.nlp is whole
    point = NlpPoint(np.arange(6.0), np.ones(6), np.ones(5))
    back = reduced.whole(reduced.part(point), point)
    assert all(np.array_equal(getattr(back, name), getattr(point, name)) for name in ("x", "lam_x", "lam_g"))


def test_other_values_of_fixed_variables_make_nothing_new(whole: Nlp) -> None:
    """Where the same variables are fixed elsewhere the reduced NLP is the same, and its solution that of the whole."""
    moved = NlpNumbers(LOWER - 0.1 * FIXED, UPPER - 0.1 * FIXED, G_LOWER, G_UPPER, np.zeros(2))
    settings, reduced = NlpSettings(FREE, tolerance=1e-10), ReducedNlp.of(whole, moved)
    assert reduced is ReducedNlp.of(whole, NUMBERS)
    start = NlpPoint.without_multipliers(np.where(FIXED, 0.6, 0.5), len(G_LOWER))
    expected = prepared(whole, settings).solve(moved, start).point
    found = reduced.whole(
        prepared(reduced.nlp, settings).solve(reduced.numbers(moved), reduced.part(start)).point, start
    )
    assert found.x == pytest.approx(expected.x, abs=1e-8) and found.x[FIXED] == pytest.approx(0.6)
