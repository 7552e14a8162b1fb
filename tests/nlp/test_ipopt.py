"""What is asked at every iterate of IPOPT."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from fesd_robot.mpcc import Mpcc
from fesd_robot.mpcc.assembly import RelaxedNlp, assemble
from fesd_robot.mpcc.relaxations import relaxation_named
from fesd_robot.nlp import FREE, Iterate, NlpNumbers, NlpPoint, NlpSettings, NlpStatus, Start, prepared

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


def numbers(nlp: RelaxedNlp, lower: np.ndarray = LOWER) -> NlpNumbers:
    """Those of the problem."""
    return NlpNumbers(lower, UPPER, nlp.lower, nlp.upper, np.zeros(2))


def test_bounds_of_iterates_are_those_of_weak_duality() -> None:
    """The bounds of a convex NLP come to the cost of its solution before its objective does, and end there."""
    nlp, seen = assemble(PROBLEM, relaxation_named("scholtes"), "never"), list[Iterate]()

    def watched(at: Iterate) -> bool:
        seen.append(at)
        return False

    solver = prepared(nlp.program, NlpSettings(FREE, tolerance=1e-10))
    solver.solve(numbers(nlp), NlpPoint.without_multipliers(START, 1), hopeless=watched)
    assert [one.iteration for one in seen] == list(range(1, len(seen) + 1))
    assert seen[-1].bound == pytest.approx(SOLUTION, abs=1e-7) and seen[-1].violation < 1e-9
    assert [abs(one.bound - SOLUTION) < 1e-3 for one in seen[-4:]] == [True] * 4


def test_an_nlp_that_is_given_up_ends_like_one_without_iterations() -> None:
    """It ends in the iteration in which it is given up."""
    nlp = assemble(PROBLEM, relaxation_named("scholtes"), "never")
    start = NlpPoint.without_multipliers(START, 1)
    found = prepared(nlp.program, NlpSettings(FREE)).solve(numbers(nlp), start, hopeless=lambda at: at.iteration == 3)
    assert found.status is NlpStatus.ITERATION_LIMIT and found.iterations == 2


def test_a_solver_is_made_once_for_all_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """With another bound the same solver leads to that bound's solution, (x, 1 - x), and nothing is made for it."""
    nlp = assemble(PROBLEM, relaxation_named("scholtes"), "never")
    solver, start = prepared(nlp.program, NlpSettings(FREE, tolerance=1e-10)), NlpPoint.without_multipliers(START, 1)
    monkeypatch.setattr(ca, "nlpsol", lambda *_: pytest.fail("another solver is made"))
    for least in (1.25, 1.5, 1.25):
        again = prepared(nlp.program, NlpSettings(FREE, tolerance=1e-10))
        assert again is solver
        found = again.solve(numbers(nlp, np.array([least, -np.inf])), start)
        assert found.converged and found.point.x == pytest.approx([least, 1 - least], abs=1e-7)


def test_a_solve_at_its_solution_ends_at_once() -> None:
    """With the multipliers of the solution no more than two iterations are left."""
    nlp = assemble(PROBLEM, relaxation_named("scholtes"), "never")
    found = prepared(nlp.program, NlpSettings(FREE, tolerance=1e-9)).solve(
        numbers(nlp), NlpPoint.without_multipliers(START, 1)
    )
    again = prepared(nlp.program, NlpSettings(Start(1e-9, 1e-9, multipliers=True), tolerance=1e-8)).solve(
        numbers(nlp), found.point
    )
    assert again.converged and again.iterations <= 2


def test_an_nlp_that_cannot_begin_takes_no_iterations() -> None:
    """With more equations than variables IPOPT does not begin, and its own number of iterations is any."""
    overdetermined = Mpcc.from_expressions(
        w=W, f=ca.sumsqr(W), g=ca.vertcat(W[0] - 1, W[1] - 2, W[0] + W[1] - 4), start=START
    )
    nlp = assemble(overdetermined, relaxation_named("scholtes"), "never")
    bounds = NlpNumbers(np.full(2, -np.inf), UPPER, nlp.lower, nlp.upper, np.zeros(2))
    found = prepared(nlp.program, NlpSettings(FREE)).solve(bounds, NlpPoint.without_multipliers(START, 3))
    assert found.status is not NlpStatus.CONVERGED and found.iterations == 0
