"""An NLP without its fixed variables and free rows: the same functions, the same solution."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from fesd_robot.mpcc import Mpcc
from fesd_robot.mpcc.assembly import Compile, RelaxedNlp, assemble
from fesd_robot.mpcc.ipopt import NlpPoint, solve_nlp
from fesd_robot.mpcc.reduced_nlp import ReducedNlp
from fesd_robot.mpcc.relaxations import relaxation_named

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


@pytest.fixture(scope="module", params=["never", "always"])
def whole(request: pytest.FixtureRequest) -> RelaxedNlp:
    """All of an NLP with two fixed variables and two free rows, interpreted and compiled."""
    compiled: Compile = request.param
    nlp = assemble(PROBLEM, relaxation_named("scholtes"), compiled)
    assert len(nlp.lower) == len(G_LOWER)
    return replace(nlp, lower=G_LOWER, upper=G_UPPER)


def test_functions_are_those_of_what_is_left(whole: RelaxedNlp) -> None:
    """Values and derivatives of the reduced NLP are the entries of the whole's with fixed variables at their bounds."""
    reduced = ReducedNlp.of(whole, LOWER, UPPER)
    free, rows = np.flatnonzero(~FIXED), [0, 2, 3]
    assert np.flatnonzero(reduced.free).tolist() == free.tolist() and np.flatnonzero(reduced.bounded).tolist() == rows
    random, p = np.random.default_rng(3), np.zeros(2)
    x = np.where(FIXED, 0.7, random.normal(size=SIZE))
    multiplier = np.zeros(len(G_LOWER))
    multiplier[rows] = random.normal(size=3)
    f, g = whole.nlp(x, p)
    assert [float(one) for one in (reduced.nlp.nlp(x[free], p)[0], reduced.nlp.gradient(x[free], p)[0])] == [
        float(f)
    ] * 2
    for found, expected in (
        (reduced.nlp.nlp(x[free], p)[1], np.asarray(g)[rows]),
        (reduced.nlp.gradient(x[free], p)[1], np.asarray(whole.gradient(x, p)[1])[free]),
        (reduced.nlp.jacobian(x[free], p)[1], np.asarray(ca.densify(whole.jacobian(x, p)[1]))[np.ix_(rows, free)]),
        (
            reduced.nlp.hessian(x[free], p, 0.4, multiplier[rows]),
            np.asarray(ca.densify(whole.hessian(x, p, 0.4, multiplier)))[np.ix_(free, free)],
        ),
    ):
        assert np.asarray(ca.densify(found)) == pytest.approx(expected, abs=1e-15)
    assert reduced.nlp.hessian.sparsity_out(0).is_triu()
    assert reduced.nlp.lower.tolist() == G_LOWER[rows].tolist() and reduced.nlp.upper.tolist() == G_UPPER[rows].tolist()


def test_the_solution_is_that_of_the_whole(whole: RelaxedNlp) -> None:
    """Variables and the multipliers of bounded rows agree; multipliers of what was left out are zero."""
    start = NlpPoint(np.where(FIXED, 0.7, 0.5), np.zeros(SIZE), np.zeros(len(G_LOWER)))
    options = {"tol": 1e-10}
    expected = solve_nlp(whole, sigma=(0.0, 0.0), start=start, lower=LOWER, upper=UPPER, options=options).point
    reduced = ReducedNlp.of(whole, LOWER, UPPER)
    part = solve_nlp(
        reduced.nlp,
        sigma=(0.0, 0.0),
        start=reduced.part(start),
        lower=LOWER[reduced.free],
        upper=UPPER[reduced.free],
        options=options,
    )
    found = reduced.whole(part.point, start)
    assert part.converged and found.x == pytest.approx(expected.x, abs=1e-8)
    assert found.lam_g == pytest.approx(expected.lam_g, abs=1e-7) and np.abs(found.lam_g).max() > 0.1
    assert not found.lam_g[~reduced.bounded].any() and not found.lam_x[FIXED].any()


def test_where_nothing_is_left_out_it_is_the_same(whole: RelaxedNlp) -> None:
    """Without fixed variables and free rows the functions are those of the whole, and so are points."""
    bounded = replace(whole, lower=np.full(len(G_LOWER), -1.0))
    reduced = ReducedNlp.of(bounded, np.full(SIZE, -np.inf), np.full(SIZE, np.inf))
    assert reduced.nlp is bounded
    point = NlpPoint(np.arange(6.0), np.ones(6), np.ones(5))
    back = reduced.whole(reduced.part(point), point)
    assert all(np.array_equal(getattr(back, name), getattr(point, name)) for name in ("x", "lam_x", "lam_g"))
