"""MPCCs of which nothing is known: what attempts, slacks and descent find."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from fesd_robot.errors import OptionError
from fesd_robot.mpcc import ATTEMPTS, Attempt, HomotopyOptions, Run, solve_by_attempts
from fesd_robot.mpcc.attempts import _least
from fesd_robot.mpcc.elastic import ElasticProblem
from fesd_robot.running import Deadline

from .known import KNOWN, Known, X, Y, from_origin, mpcc


@pytest.mark.parametrize("known", KNOWN, ids=lambda known: known.name)
def test_known_solutions(known: Known) -> None:
    """Small problems of the literature end at one of their solutions, and no branch descends from there."""
    found = solve_by_attempts(known.problem, attempts=ATTEMPTS if known.solutions else ATTEMPTS[:1])
    assert found.solution.solved == bool(known.solutions)
    if not known.solutions:
        assert found.conflict is not None and found.conflict.total > 1e-3
        return
    assert known.error(found.solution.w) <= known.distance
    assert found.certificate is not None and found.certificate.b_stationary == "certified"


def test_conflict_names_rows(capfd: pytest.CaptureFixture[str]) -> None:
    """Of x = 1 and y = 2 with 0 <= x complementary to y one has to give way: the cheaper, by 1; CasADi says nothing."""
    problem = from_origin(X**2, X, Y, g=ca.vertcat(X, Y), g_bounds=(np.array([1.0, 2.0]), np.array([1.0, 2.0])))
    found = solve_by_attempts(problem, Run(deadline=Deadline(10.0)), attempts=(Attempt("as given"),))
    assert not found.solution.solved and found.certificate is None and found.conflict is not None
    assert found.conflict.certified and found.conflict.total == pytest.approx(1.0, abs=1e-5)
    assert str(found.conflict).startswith("no point nearby meets all constraints: g[0] by 1.0e+00")
    assert capfd.readouterr().err == ""


def test_slacks_lead_to_the_branch_that_holds_the_constraints() -> None:
    """From the branch y = 0, on which y - x = 1 is violated by 1, the LPCC knows the way to x = 0."""
    elastic = ElasticProblem.of(mpcc(X**2, X, Y, [5.0, 0.0], g=Y - X - 1))
    start = elastic.at(elastic.original.start)
    assert start[2:].sum() == pytest.approx(6.0)
    first, certified = _least(elastic.problem, start, Run(HomotopyOptions()), enough=1.1)
    assert first is not None and first.residuals.objective == pytest.approx(1.0, abs=1e-4) and not certified
    end, _ = _least(elastic.problem, start, Run(HomotopyOptions()), enough=0.0)
    assert end is not None
    np.testing.assert_allclose(end.w[:2], [0.0, 1.0], atol=1e-6)


def test_slacks_of_inequalities() -> None:
    """A row within its bounds needs no slack, one outside as much as it is outside, a pair its smaller side."""
    rows = {"g": ca.vertcat(X, Y), "g_bounds": (np.array([-1.0, 0.0]), np.array([1.0, np.inf]))}
    elastic = ElasticProblem.of(from_origin(X, X, Y, **rows))
    assert elastic.at(np.array([3.0, 0.5]))[2:].tolist() == [0, 0, 2, 0, 0, 0.5]
    assert elastic.at(np.array([0.0, -0.5]))[2:].tolist() == [0, 0.5, 0, 0, 0, 0]
    least = elastic.least_violation(elastic.at(np.array([3.0, -0.5])), certified=True)
    assert [(str(label), excess) for label, excess in least.rows] == [("g[0]", 2.0), ("g[1]", 0.5)]


def test_further_homotopies_do_not_make_it_dearer() -> None:
    """The cheapest solution is returned, and NLPs of all homotopies are reported."""
    problem = from_origin((X - 1) ** 2 + (Y - 2) ** 2, X, Y)
    one, three = solve_by_attempts(problem), solve_by_attempts(problem, further=2)
    assert three.solution.residuals.objective <= one.solution.residuals.objective + 1e-9
    assert len(three.solution.reports) > len(one.solution.reports)


def test_no_time() -> None:
    """Without time the start comes back, and nothing is claimed."""
    found = solve_by_attempts(from_origin(X, X, Y), Run(deadline=Deadline(0.0)))
    assert not found.solution.solved and found.certificate is None and found.conflict is None


def test_what_is_asked_for_is_checked() -> None:
    """No attempts, or fewer than none further ones, are refused."""
    problem = from_origin(X, X, Y)
    with pytest.raises(OptionError, match="attempts: found none"):
        solve_by_attempts(problem, attempts=())
    with pytest.raises(OptionError, match="further: found -1"):
        solve_by_attempts(problem, further=-1)
