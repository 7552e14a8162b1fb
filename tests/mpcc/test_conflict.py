"""Conflicting constraints where nothing is feasible, held against problems that can be solved by hand."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from fesd_robot.mpcc import BranchBounds, Mpcc, conflict_at


def _bounds(problem: Mpcc) -> BranchBounds:
    return BranchBounds(problem.lower, problem.upper, problem.blocks[0].lower, problem.blocks[0].upper)


def _sum(least: float, upper: tuple[float, float, float]) -> Mpcc:
    """x + y >= least below upper bounds; z is free of the row."""
    w, bounds = ca.SX.sym("w", 3), (np.full(3, -5.0), np.array(upper))
    return Mpcc.from_expressions(w, ca.SX(0), start=np.zeros(3), g=w[0] + w[1], bounds=bounds, g_bounds=(least, None))


def test_upper_bounds_that_are_too_low_are_named_with_their_prices() -> None:
    """x + y >= 3 with x <= 1, y <= 1.5 lacks 0.5; either bound moved by one gains one; z and lower bounds do not."""
    problem = _sum(3.0, (1.0, 1.5, 0.2))
    w = np.array([0.8, 1.0, 0.2])
    conflict = conflict_at(problem, _bounds(problem), w, 10.0)
    assert conflict is not None and conflict.violation == pytest.approx(0.5)
    found = {(one.label.kind, one.upper): (one.bound, one.price) for one in conflict.demands}
    assert found == {
        ("w[0]", True): (1.0, pytest.approx(1.8)),
        ("w[1]", True): (1.5, pytest.approx(2.0)),
    }
    assert [one.label.kind for one in conflict.demands] == ["w[1]", "w[0]"], "the largest price first"


def test_what_can_be_met_is_no_conflict() -> None:
    """Where the linear program finds a point without violation, nothing stands in the way."""
    problem = _sum(2.0, (1.0, 1.5, 0.2))
    assert conflict_at(problem, _bounds(problem), np.zeros(3), 10.0) is None


def test_how_far_it_looks_is_no_demand() -> None:
    """A point that is far from what is asked for names no bound that it does not reach."""
    problem = _sum(9.0, (9.0, 9.0, 0.2))
    conflict = conflict_at(problem, _bounds(problem), np.zeros(3), 10.0)
    assert conflict is not None and conflict.demands == () and conflict.violation == pytest.approx(7.0)


def test_without_time_nothing_is_found() -> None:
    """A limit that is over gives no answer instead of a wrong one."""
    problem = _sum(3.0, (1.0, 1.5, 0.2))
    assert conflict_at(problem, _bounds(problem), np.zeros(3), 0.0) is None
