"""The relaxed NLP put together from blocks, compared with CasADi's derivatives of the whole."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from fesd_robot.complementarity import Complementarity, Label, Place
from fesd_robot.mpcc import Block, BlockEquations, Mpcc
from fesd_robot.mpcc.assembly import Compile, RelaxedNlp, assemble
from fesd_robot.mpcc.blocks import UNRELAXED_SIGMA
from fesd_robot.mpcc.relaxations import scholtes

SIZE = 7
SIGMA = np.array([0.3, 20.0])


def _coupled() -> Mpcc:
    """Three overlapping copies of a block with both levels and a vanishing constraint, and a block of another kind."""
    w, p = ca.SX.sym("w", 3), ca.SX.sym("p", 2)
    chain = Block(
        BlockEquations(
            name="chain",
            variables=w,
            parameters=p,
            cost=p[0] * ca.sin(w[0]) * w[1] + w[2] ** 4,
            rows=ca.vertcat(w[0] * w[1] * w[2] - p[1], ca.exp(w[0]) + w[2]),
            lower=np.array([0.0, -1.0]),
            upper=np.array([0.0, 2.0]),
            constraints=[Label("product"), Label("exponential")],
            complementarities=[
                Complementarity(Label("plain"), w[0], w[1]),
                Complementarity(Label("vanishing"), w[1] ** 2 - w[2], ca.cos(w[0]), vanishing=True, level="velocity"),
                Complementarity(Label("other level"), w[0] * w[2], w[2] + p[1], level="velocity"),
            ],
        ),
        places=[Place(name=name) for name in "abc"],
        index=np.array([[0, 4, 6], [1, 2, 4], [2, 0, 1]]),
        values=np.array([[1.0, -2.0, 0.5], [0.1, 0.2, 0.3]]),
    )
    v = ca.SX.sym("v", 2)
    end = Block(
        BlockEquations(
            name="end",
            variables=v,
            parameters=ca.SX(0, 1),
            cost=ca.sumsqr(v),
            rows=ca.SX(0, 1),
            lower=np.zeros(0),
            upper=np.zeros(0),
            constraints=[],
        ),
        places=[Place()],
        index=np.array([[5], [0]]),
        values=np.zeros((0, 1)),
    )
    free = np.full(SIZE, np.inf)
    return Mpcc(lower=-free, upper=free, start=np.zeros(SIZE), blocks=[chain, end])


@pytest.fixture(scope="module")
def nlp() -> RelaxedNlp:
    return assemble(_coupled(), scholtes)


@pytest.fixture(params=range(3))
def point(request: pytest.FixtureRequest) -> np.ndarray:
    return np.random.default_rng(request.param).uniform(-1.5, 1.5, SIZE)


def test_cost_and_rows_are_those_of_the_blocks(nlp: RelaxedNlp, point: np.ndarray) -> None:
    """f and g agree with the MPCC's own evaluation, each pair is relaxed by the sigma of its level, bounds fit."""
    problem = _coupled()
    f, g = (np.asarray(value).ravel() for value in nlp.program.nlp(point, nlp.parameters(SIGMA)))
    assert f.item() == pytest.approx(problem.residuals(point).objective, rel=1e-14)
    _, constraints, G, H = problem.blocks[0].evaluate(point)
    relaxed = G * H - SIGMA[[0, 1, 1]][:, None]
    # Rows of a copy: its constraints, its pairs, G >= 0 unless it vanishes, H >= 0 of all.
    expected = np.vstack([constraints, relaxed, G[[0, 2]], H])
    assert g == pytest.approx(expected.T.ravel(), rel=1e-13, abs=1e-13)
    infinity = np.inf
    assert nlp.lower.tolist() == [0, -1, *[-infinity] * 3, *[0] * 5] * 3
    assert nlp.upper.tolist() == [0, 2, *[0] * 3, *[infinity] * 5] * 3


def test_derivatives_are_those_of_the_whole(nlp: RelaxedNlp, point: np.ndarray) -> None:
    """Gradient, Jacobian and the upper triangle of the Lagrangian's Hessian equal those of CasADi."""
    x, sigma = ca.MX.sym("x", SIZE), ca.MX.sym("sigma", 2)
    p = ca.vertcat(sigma, ca.DM(nlp.values))
    f, g = nlp.program.nlp(x, p)
    multiplier = np.random.default_rng(1).normal(size=g.numel())
    weight = 0.7
    whole = ca.Function(
        "whole",
        [x, sigma],
        [ca.gradient(f, x), ca.jacobian(g, x), ca.hessian(weight * f + ca.dot(multiplier, g), x)[0]],
    )
    gradient, jacobian, hessian = (np.asarray(ca.DM(value).full()) for value in whole(point, SIGMA))
    at = nlp.parameters(SIGMA)
    assert np.asarray(nlp.program.gradient(point, at)[1]) == pytest.approx(gradient, abs=1e-12)
    assert np.asarray(nlp.program.jacobian(point, at)[1].full()) == pytest.approx(jacobian, abs=1e-12)
    actual = np.asarray(nlp.program.hessian(point, at, weight, multiplier).full())
    assert actual == pytest.approx(np.triu(hessian), abs=1e-12)
    assert np.abs(np.triu(hessian, 1)).max() > 0.1


@pytest.mark.parametrize("compiled", ["never", "always"])
def test_a_cost_of_zero_is_a_number(compiled: Compile) -> None:
    """Without a cost, f and its gradient are dense zeros, as IPOPT needs them."""
    w = ca.SX.sym("w", 2)
    nlp = assemble(Mpcc.from_expressions(w=w, f=ca.SX(1, 1), g=w[0] * w[1], start=np.ones(2)), scholtes, compiled)
    f, slope = nlp.program.gradient(np.ones(2), SIGMA)
    assert f.nonzeros() == [0.0] and slope.nonzeros() == [0.0, 0.0]
    assert [value.nonzeros() for value in nlp.program.nlp(np.ones(2), SIGMA)] == [[0.0], [1.0]]


NAMES = ["bound", "difference", "upper bound", "product"]


def _signed(lower: list[float], copies: list[list[int]], shift: float | None = None) -> tuple[Mpcc, RelaxedNlp]:
    """Pairs whose sides G are w0, w0 - w1, 1 - w1, w0 w1, all plus a parameter if any, and H = 1."""
    w, p = ca.SX.sym("w", 2), ca.SX.sym("p", 0 if shift is None else 1)
    left = ca.vertcat(w[0], w[0] - w[1], 1 - w[1], w[0] * w[1]) + ca.sum1(p)
    block = Block(
        BlockEquations(
            name="signed",
            variables=w,
            parameters=p,
            cost=ca.SX(0),
            rows=ca.SX(0, 1),
            lower=np.zeros(0),
            upper=np.zeros(0),
            constraints=[],
            complementarities=[Complementarity(Label(name), left[k], ca.SX(1)) for k, name in enumerate(NAMES)],
        ),
        places=[Place(element=k) for k in range(len(copies))],
        index=np.array(copies).T,
        values=np.full((p.numel(), len(copies)), 0.0 if shift is None else shift),
    )
    n = len(lower)
    problem = Mpcc(lower=np.array(lower), upper=np.ones(n), start=np.zeros(n), blocks=[block])
    return problem, assemble(problem, scholtes)


@pytest.mark.parametrize(
    ("lower", "copies", "shift", "remaining"),
    [
        ([0, 0], [[0, 1]], None, ["difference", "product"]),
        ([1, 0], [[0, 1]], None, ["product"]),
        ([-1e-9, 0], [[0, 1]], None, ["bound", "difference", "product"]),
        ([-np.inf, -np.inf], [[0, 1]], None, ["bound", "difference", "product"]),
        ([0, 0, -1], [[0, 1], [2, 1]], None, ["bound", "difference", "product"]),
        ([1, 0], [[0, 1]], -3.0, NAMES),
    ],
    ids=["box", "difference implied", "just negative", "unbounded", "one copy may be negative", "parameter"],
)
def test_only_implied_signs_are_left_out(
    lower: list[float], copies: list[list[int]], shift: float | None, remaining: list[str]
) -> None:
    """A row G >= 0 goes only where the bounds of every copy imply it; nonlinear and parametric ones stay."""
    problem, nlp = _signed(lower, copies, shift)
    point = np.random.default_rng(3).uniform(-1, 1, len(lower))
    rows = np.asarray(nlp.program.nlp(point, nlp.parameters([0, 0]))[1]).reshape(len(copies), -1)[:, len(NAMES) :]
    _, _, G, _ = problem.blocks[0].evaluate(point)
    expected = G[[NAMES.index(name) for name in remaining]].T
    assert rows.shape == expected.shape
    assert rows == pytest.approx(expected)


@pytest.mark.parametrize("seed", range(4))
def test_rows_and_bounds_together_say_every_sign(seed: int) -> None:
    """At random points in the box all G >= 0 hold exactly where the remaining rows hold."""
    lower = [-0.3, 0.0, 0.1]
    problem, nlp = _signed(lower, [[0, 1], [0, 2]])
    seen = set()
    for point in np.random.default_rng(seed).uniform(lower, 1, (200, 3)):
        rows = np.asarray(nlp.program.nlp(point, nlp.parameters([10.0, 10.0]))[1]).ravel()
        by_rows = bool((rows >= nlp.lower).all() and (rows <= nlp.upper).all())
        by_pairs = problem.residuals(point).constraint_violation == 0
        assert by_rows == by_pairs
        seen.add(by_pairs)
    assert seen == {True, False}


def test_a_cost_may_be_another_while_pairs_are_relaxed(point: np.ndarray) -> None:
    """What is added depends on sigma of the velocity level and is gone below a small one, in value and gradient;
    residuals do not count it."""
    problem = _coupled()
    first, second = problem.blocks
    chain = first.equations
    product = chain.variables[0] * chain.variables[1]

    def with_added(weight: float) -> Mpcc:
        equations = replace(chain, cost=chain.cost + weight * product)
        return replace(problem, blocks=[replace(first, equations=equations), second])

    relaxed = replace(first, equations=replace(chain, while_relaxed=product * chain.sigma**2))
    other = replace(problem, blocks=[relaxed, second])
    nlp = assemble(other, scholtes)
    for sigma, weight in (
        (20.0, 400.0),
        (2 * UNRELAXED_SIGMA, 4 * UNRELAXED_SIGMA**2),
        (UNRELAXED_SIGMA, 0.0),
        (0.0, 0.0),
    ):
        at, expected = nlp.parameters([0.3, sigma]), assemble(with_added(weight), scholtes)
        for part in ("nlp", "gradient"):
            value, known = (
                np.asarray(getattr(one.program, part)(point, at)[part == "gradient"]).ravel() for one in (nlp, expected)
            )
            assert value == pytest.approx(known, rel=1e-12, abs=1e-12)
    assert other.residuals(point).objective == problem.residuals(point).objective
