"""Slack variables in the place of sigma: the NLP they make, and how a homotopy ends with them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot.complementarity import Complementarity, Label, Place
from fesd_robot.errors import OptionError
from fesd_robot.mpcc import Block, BlockEquations, HomotopyOptions, Mpcc, Run, solve
from fesd_robot.mpcc.assembly import RelaxedNlp, assemble
from fesd_robot.mpcc.relaxations import RELAXATIONS
from fesd_robot.mpcc.steering import Steering

from .known import KNOWN

SIGMA = np.array([0.2, 5.0])
BY_NAME = {known.name: known for known in KNOWN}


def _chain() -> Mpcc:
    """Two copies, on variables (0, 1) and (2, 1), with a pair of each level, and a block without pairs."""
    w, v, none = ca.SX.sym("w", 2), ca.SX.sym("v", 1), ca.SX(0, 1)
    pairs = Block(
        BlockEquations(
            name="pairs",
            variables=w,
            parameters=none,
            cost=ca.sin(w[0]) * w[1],
            rows=w[0] - w[1],
            lower=np.zeros(1),
            upper=np.zeros(1),
            constraints=[Label("difference")],
            complementarities=[
                Complementarity(Label("first"), w[0], w[1] ** 2),
                Complementarity(Label("second"), ca.exp(w[0]), w[1] + 3, level="velocity"),
            ],
        ),
        places=[Place(name="left"), Place(name="right")],
        index=np.array([[0, 2], [1, 1]]),
        values=np.zeros((0, 2)),
    )
    end = Block(
        BlockEquations(
            name="end",
            variables=v,
            parameters=none,
            cost=v**4,
            rows=none,
            lower=np.zeros(0),
            upper=np.zeros(0),
            constraints=[],
        ),
        places=[Place()],
        index=np.array([[1]]),
        values=np.zeros((0, 1)),
    )
    free = np.full(3, np.inf)
    return Mpcc(lower=-free, upper=free, start=np.zeros(3), blocks=[pairs, end])


def _nlp(relaxation: str, steering: Steering) -> tuple[RelaxedNlp, np.ndarray]:
    """The NLP of the chain and a point with positive slacks."""
    nlp = assemble(_chain(), RELAXATIONS[relaxation], steering=steering)
    generator = np.random.default_rng(3)
    return nlp, np.append(generator.uniform(-1, 1, 3), generator.uniform(0.1, 1, nlp.slacks.count))


@pytest.mark.parametrize("relaxation", ["scholtes", "kadrani"])
@pytest.mark.parametrize("steering", ["l1", "linf"])
def test_cost_and_rows(relaxation: str, steering: Steering) -> None:
    """The cost has rho s; each pair's rows have its own slack, or the common one times the ratio of its level."""
    nlp, point = _nlp(relaxation, steering)
    w, slack, power = point[:3], point[3:], RELAXATIONS[relaxation].power
    f, g = (np.asarray(value).ravel() for value in nlp.program.nlp(point, SIGMA))
    ratio = (SIGMA[1] / SIGMA[0]) ** (1 / power)
    if steering == "l1":
        parameters, price = slack.reshape(2, 2).T, slack @ (1 / SIGMA[[0, 1, 0, 1]])
    else:
        parameters, price = slack[0] * np.array([[1, 1], [ratio, ratio]]), slack[0] / SIGMA[0]
    assert f.item() == pytest.approx(_chain().residuals(w).objective + price)
    _, _, G, H = _chain().blocks[0].evaluate(w)
    symbols = [ca.SX.sym(name, 2) for name in "GHt"]
    rows = ca.Function("rows", symbols, [RELAXATIONS[relaxation].formula(*symbols)])
    expected = np.asarray(rows.map(2)(G, H, parameters))
    assert g.reshape(2, -1).T[1 : 1 + len(expected)] == pytest.approx(expected)


@pytest.mark.parametrize("relaxation", ["scholtes", "fischer_burmeister", "kanzow_schwartz", "lin_fukushima"])
@pytest.mark.parametrize("steering", ["direct", "l1", "linf"])
def test_derivatives(relaxation: str, steering: Steering) -> None:
    """Gradient, Jacobian and Hessian in the variables and the slacks are those of CasADi."""
    nlp, point = _nlp(relaxation, steering)
    x, sigma = ca.MX.sym("x", len(point)), ca.MX.sym("sigma", 2)
    f, g = nlp.program.nlp(x, sigma)
    multiplier = np.random.default_rng(1).normal(size=g.numel())
    lagrangian = 0.7 * f + ca.dot(multiplier, g)
    outputs = [ca.gradient(f, x), ca.jacobian(g, x), ca.hessian(lagrangian, x)[0]]
    whole = ca.Function("whole", [x, sigma], outputs)
    gradient, jacobian, hessian = (np.asarray(ca.DM(value).full()) for value in whole(point, SIGMA))
    assert np.asarray(nlp.program.gradient(point, SIGMA)[1]) == pytest.approx(gradient, abs=1e-12)
    assert np.asarray(nlp.program.jacobian(point, SIGMA)[1].full()) == pytest.approx(jacobian, abs=1e-12)
    upper = np.asarray(nlp.program.hessian(point, SIGMA, 0.7, multiplier).full())
    assert upper == pytest.approx(np.triu(hessian), abs=1e-12)


def test_slacks_and_their_bounds() -> None:
    """One a pair with l1, one in all with linf, none without pairs or with sigma as a parameter."""
    assert [_nlp("scholtes", steering)[0].slacks.count for steering in ("direct", "l1", "linf")] == [0, 4, 1]
    assert _nlp("scholtes", "l1")[0].slacks.upper(0.5, 100.0).tolist() == [0.5, 50, 0.5, 50]
    assert _nlp("kadrani", "l1")[0].slacks.upper(0.25, 100.0).tolist() == [0.5, 5, 0.5, 5]
    assert _nlp("scholtes", "linf")[0].slacks.upper(0.5, 100.0).tolist() == [0.5]
    smooth = replace(_chain(), blocks=_chain().blocks[1:])
    for steering in ("l1", "linf"):
        assert assemble(smooth, RELAXATIONS["scholtes"], steering=steering).slacks.count == 0
        assert solve(smooth, Run(HomotopyOptions(steering=steering))).solved


@pytest.mark.parametrize("steering", ["l1", "linf"])
def test_an_exact_penalty_ends_the_homotopy(steering: Steering) -> None:
    """Where a finite rho makes the products zero no further NLP is solved; without multipliers rho has to grow."""
    options = HomotopyOptions(steering=steering, sigma_factor=0.1)
    exact, inexact = (solve(BY_NAME[name].problem, Run(options)) for name in ("near_miss", "no_multipliers"))
    assert exact.solved and inexact.solved
    assert len(exact.reports) < len(inexact.reports) < len(options.sigmas()) + 1
    assert exact.reports[-1].sigma >= 0.01
    assert exact.w == pytest.approx([0, 2], abs=1e-7)


@pytest.mark.parametrize("steering", ["l1", "linf"])
def test_slack_that_stays_is_not_solved(steering: Steering) -> None:
    """x = y = 1 is feasible with a slack of 1 however dear it is: every NLP converges, and the MPCC is not solved."""
    solution = solve(
        BY_NAME["infeasible"].problem, Run(HomotopyOptions(steering=steering, sigma_start=1.0, sigma_factor=0.1))
    )
    assert (solution.solved, solution.feasible, solution.status) == (False, False, "slack left")
    assert solution.reports[-1].status == "converged" and solution.reports[-1].sigma == 1e-8
    assert solution.residuals.complementarity == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("steering", ["l1", "linf"])
def test_a_small_bound_on_the_slack_makes_the_nlp_infeasible(steering: Steering) -> None:
    """The slack is at most sigma_start."""
    options = HomotopyOptions(steering=steering, sigma_start=0.5)
    assert solve(BY_NAME["infeasible"].problem, Run(options)).status == "infeasible"


def test_an_assembled_nlp_keeps_its_steering() -> None:
    """What was assembled with slacks is solved with them."""
    problem = BY_NAME["near_miss"].problem
    nlp = assemble(problem, RELAXATIONS["natural_residual"], steering="linf")
    given, own = (
        solve(problem, Run(options), nlp=assembled)
        for options, assembled in (
            (HomotopyOptions(), nlp),
            (HomotopyOptions(relaxation="natural_residual", steering="linf"), None),
        )
    )
    assert given.w.tolist() == own.w.tolist() and given.w.shape == (2,)


@pytest.mark.parametrize(
    "make", [HomotopyOptions, lambda steering: assemble(_chain(), RELAXATIONS["scholtes"], steering=steering)]
)
def test_an_unknown_steering_is_refused(make: Any) -> None:
    """The error has the nearest name."""
    with pytest.raises(OptionError, match=r"unknown steering 'lnf' \(did you mean 'linf'\?\)"):
        make(steering="lnf")
