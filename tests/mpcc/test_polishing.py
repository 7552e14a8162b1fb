"""The finish: products that are zero to round-off, on the structure that a relaxed point means."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from fesd_robot.mpcc import BranchNlp, HomotopyOptions, PairPolisher, solve
from fesd_robot.mpcc.polishing import EXACT, Held

from .known import KNOWN, Known

CORNERS = {"no_multipliers", "falling_into_the_corner", "b_not_s_stationary"}
"""Whose relaxed points tell late, or never, which side is zero."""

SOLVABLE = [known for known in KNOWN if known.solutions]


@pytest.mark.parametrize("known", SOLVABLE, ids=lambda known: known.name)
def test_small_problems_end_exactly(known: Known) -> None:
    """Every small problem ends in one of its solutions, most with products of zero before sigma is at its end."""
    problem = known.problem
    found = solve(problem, HomotopyOptions(sigma_factor=0.1), polisher=PairPolisher(problem))
    assert found.solved, found.status
    assert found.residuals.complementarity <= (EXACT if found.exact else 1e-8)
    if known.name not in CORNERS:
        assert found.exact and min(report.sigma for report in found.reports if report.sigma) > 1e-8
    assert known.error(found.w) <= known.distance


@pytest.mark.parametrize("known", SOLVABLE, ids=lambda known: known.name)
def test_a_sketch_follows_sigma(known: Known) -> None:
    """Products of every NLP of a sketch are at most twice its sigma, also below IPOPT's tolerance while loose."""
    options = HomotopyOptions(sigma_factor=0.1, velocity_level_ratio=1.0)
    found = solve(known.problem, options, polisher=PairPolisher(known.problem))
    sketches = [report for report in found.reports if report.sigma]
    assert min(report.sigma for report in sketches) < 1e-2
    assert max(report.residuals.complementarity / report.sigma for report in sketches) <= 2


def test_nothing_finishes_an_infeasible_problem() -> None:
    """A problem without a solution is not called solved, with the finish as without it."""
    (known,) = [known for known in KNOWN if not known.solutions]
    found = solve(known.problem, HomotopyOptions(sigma_factor=0.1), polisher=PairPolisher(known.problem))
    assert not found.solved and not found.exact


class Misread(PairPolisher):
    """Reads the wrong side of every pair."""

    def readings(self, w: np.ndarray) -> Iterator[np.ndarray]:
        yield ~next(super().readings(w))

    def revised(self, structure: np.ndarray, w: np.ndarray) -> np.ndarray | None:
        return None


def test_a_structure_that_costs_more_is_refused() -> None:
    """A misread structure whose exact end costs more than the relaxed point is not taken; the homotopy goes on."""
    (known,) = [known for known in KNOWN if known.name == "near_miss"]
    found = solve(known.problem, HomotopyOptions(sigma_factor=0.1), polisher=Misread(known.problem))
    plain = solve(known.problem, HomotopyOptions(sigma_factor=0.1))
    assert found.solved and not found.exact
    np.testing.assert_allclose(found.w, plain.w, atol=1e-6)


def test_the_finish_can_be_switched_off() -> None:
    """Without it the homotopy is the one it was: the same NLPs, to the last bit."""
    problem = SOLVABLE[0].problem
    plain = solve(problem, HomotopyOptions())
    off = solve(problem, HomotopyOptions(finish=False), polisher=PairPolisher(problem))
    assert [r.iterations for r in off.reports] == [r.iterations for r in plain.reports]
    np.testing.assert_array_equal(off.w, plain.w)


def test_time_and_stop_are_obeyed() -> None:
    """No NLP of the finish starts when the time is over, and a stop ends it without an exact point."""
    problem = SOLVABLE[0].problem
    smooth, reported = BranchNlp.of(PairPolisher(problem), "never"), []
    late = smooth.solve(
        problem, problem.start, options={}, feasibility=1e-8, remaining=lambda: 0.0, report=reported.append
    )
    assert late is None and reported == []
    stopped = smooth.solve(
        problem,
        problem.start + 3.0,
        options={},
        feasibility=1e-8,
        remaining=lambda: None,
        report=reported.append,
        stop=lambda iteration, objective: True,
    )
    assert stopped is None and [report.status for report in reported] == ["interrupted"]


def test_bounds_hold_the_sides() -> None:
    """Of a two-sided pair one side is fixed, the other not negative; of a one-sided one G is free or at most zero."""
    two, one = (next(k for k in KNOWN if k.name == name).problem for name in ("near_miss", "g_negative"))
    for problem, free in ((two, 0.0), (one, -np.inf)):
        for G_zero in (True, False):
            held: Held = PairPolisher(problem).held(np.array([G_zero]))
            assert held.g_lower[-2:].tolist() == [free, 0.0]
            assert held.g_upper[-2:].tolist() == ([0.0, np.inf] if G_zero else [np.inf, 0.0])
