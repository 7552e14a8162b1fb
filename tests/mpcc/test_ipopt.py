"""What is asked at every iterate of IPOPT."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from fesd_robot.mpcc import Mpcc
from fesd_robot.mpcc.assembly import assemble
from fesd_robot.mpcc.ipopt import Iterate, NlpPoint, solve_nlp
from fesd_robot.mpcc.relaxations import relaxation_named
from fesd_robot.mpcc.status import NlpStatus

W = ca.SX.sym("w", 2)
START = np.array([3.0, -2.0])
PROBLEM = Mpcc.from_expressions(
    w=W,
    f=ca.sumsqr(W - np.array([2.0, 1.0])),
    G=ca.SX(0, 1),
    H=ca.SX(0, 1),
    start=START,
    g=W[0] + W[1],
    g_bounds=(None, 1.0),
)
"""min (x - 2)^2 + (y - 1)^2 with x + y <= 1 and x >= 1.25, whose solution is (1.25, -0.25) with a cost of 2.125."""

LOWER, UPPER, SOLUTION = np.array([1.25, -np.inf]), np.full(2, np.inf), 2.125


def test_bounds_of_iterates_are_those_of_weak_duality() -> None:
    """The bounds of a convex NLP come to the cost of its solution before its objective does, and end there."""
    nlp, seen = assemble(PROBLEM, relaxation_named("scholtes"), "never"), list[Iterate]()
    start = NlpPoint(START, np.zeros(2), np.zeros(1))
    options = {"bound_relax_factor": 0.0, "tol": 1e-10}

    def watched(at: Iterate) -> bool:
        seen.append(at)
        return False

    solve_nlp(nlp, sigma=(0, 0), start=start, lower=LOWER, upper=UPPER, options=options, hopeless=watched)
    assert [one.iteration for one in seen] == list(range(1, len(seen) + 1))
    assert seen[-1].bound == pytest.approx(SOLUTION, abs=1e-7) and seen[-1].violation < 1e-9
    assert [abs(one.bound - SOLUTION) < 1e-3 for one in seen[-4:]] == [True] * 4


def test_an_nlp_that_is_given_up_ends_like_one_without_iterations() -> None:
    """It ends in the iteration in which it is given up."""
    nlp = assemble(PROBLEM, relaxation_named("scholtes"), "never")
    start = NlpPoint(START, np.zeros(2), np.zeros(1))
    found = solve_nlp(
        nlp, sigma=(0, 0), start=start, lower=LOWER, upper=UPPER, options={}, hopeless=lambda at: at.iteration == 3
    )
    assert found.status is NlpStatus.ITERATION_LIMIT and found.iterations == 2
