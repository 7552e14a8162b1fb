"""The homotopy on small problems whose solutions are known, and how it ends when it does not get there."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot.complementarity import Level
from fesd_robot.errors import SolverError
from fesd_robot.mpcc import HomotopyOptions, Mpcc, NlpReport, Run, solve
from fesd_robot.mpcc.assembly import assemble
from fesd_robot.mpcc.relaxations import Relaxation, scholtes
from fesd_robot.running.deadline import Deadline

from .known import KNOWN, X, Y, mpcc, vanishing

TOLERANCE = 1e-8
OPTIONS = HomotopyOptions(tolerance=TOLERANCE, sigma_start=1.0, sigma_factor=0.1, velocity_level_ratio=100.0)
BY_NAME = {known.name: known.problem for known in KNOWN}
NEAR_MISS = BY_NAME["near_miss"]

REACHED = {
    "near_miss": ([0, 2], 1e-8),
    "equality": ([2, 0], 1e-8),
    "corner": ([0, 0], 1e-8),
    "no_strict_complementarity": ([0, 0], 1e-4),
    "falling_into_the_corner": ([0, 0], 1.01e-4),
    "moved_pair": ([0.5, 0.5], 1e-7),
    "no_multipliers": ([0, 0, 0], 5e-4),
    "b_not_s_stationary": ([0, 0, 0], 2.01e-4),
    "redundant_pair": ([0, 2], 1e-8),
}
"""Which solution the default homotopy finds, and how far from it a product of `TOLERANCE` may leave the point."""


@pytest.mark.parametrize("name", REACHED)
def test_known_solutions_are_found(name: str) -> None:
    """The returned point is the known solution as far as the tolerance determines it, and its residuals say so."""
    problem, (expected, distance) = BY_NAME[name], REACHED[name]
    solution = solve(problem, Run(OPTIONS))
    assert solution.solved and solution.feasible and solution.status == "converged"
    assert np.abs(solution.w - expected).max() <= distance
    assert solution.residuals == problem.residuals(solution.w)
    assert solution.residuals.complementarity <= 1.01 * TOLERANCE
    assert solution.residuals.constraint_violation <= 1e-8
    sigmas = replace(OPTIONS, velocity_level_ratio=1.0).sigmas()  # no pair of these problems is of the velocity level
    assert [report.status for report in solution.reports] == ["converged"] * len(sigmas)
    assert [(report.sigma, report.velocity_level_sigma) for report in solution.reports] == sigmas
    assert solution.iterations == sum(report.iterations for report in solution.reports) > 0


def test_distance_shrinks_with_the_tolerance() -> None:
    """On min (x-1)² + (y-2)² the error of x is tolerance / 2, at every tolerance asked for."""
    problem = NEAR_MISS
    for tolerance in (1e-3, 1e-5, 1e-7):
        solution = solve(problem, Run(HomotopyOptions(tolerance=tolerance, sigma_factor=0.1)))
        assert solution.solved
        assert solution.w[0] == pytest.approx(tolerance / 2, rel=0.1)


@pytest.mark.parametrize("level", ["position", "velocity"])
@pytest.mark.parametrize(
    ("f", "solution"),
    [
        ((X + 1) ** 2 + (Y - 1) ** 2, [-1, 1]),
        ((X - 1) ** 2 + (Y - 2) ** 2, [0, 2]),
        ((X - 2) ** 2 + (Y + 1) ** 2, [2, 0]),
    ],
    ids=["G negative", "G blocked", "H blocked"],
)
def test_vanishing_constraints(f: ca.SX, solution: list[float], level: Level) -> None:
    """A vanishing constraint leaves G < 0 < H alone and still excludes G H > 0, whatever its level."""
    end = solve(vanishing(mpcc(f, X, Y, [0.5, 0.5]), level), Run(OPTIONS))
    assert end.solved
    assert end.w == pytest.approx(solution, abs=2e-8)


def test_an_infeasible_problem_is_not_solved() -> None:
    """x, y >= 1 excludes x ⊥ y: the status says infeasible, and the returned point is one that was seen."""
    problem = BY_NAME["infeasible"]
    solution = solve(problem, Run(OPTIONS))
    assert not solution.solved
    assert solution.status == "infeasible"
    assert solution.reports[-1].status == "infeasible" and len(solution.reports) < len(OPTIONS.sigmas())
    assert np.isfinite(solution.w).all()
    assert solution.residuals == problem.residuals(solution.w)
    assert solution.residuals.complementarity >= 1 - 1e-6


def _contradiction(start: list[float]) -> Mpcc:
    """x + y = 1 and x + y = 3."""
    return mpcc(X**2 + Y**2, X, Y, start, g=ca.vertcat(X + Y - 1, X + Y - 3))


def test_contradicting_equalities_are_not_solved() -> None:
    """What no point satisfies is tried at the first sigma only, and ends with the violation and the row it is in."""
    solution = solve(_contradiction([1, 1]), Run(OPTIONS))
    assert (solution.solved, solution.feasible, solution.status) == (False, False, "infeasible")
    assert {report.sigma for report in solution.reports} == {1.0}
    assert solution.residuals.constraint_violation >= 1 - 1e-6
    assert solution.residuals.worst_constraint is not None
    assert solution.residuals.worst_constraint.kind in ("g[0]", "g[1]")


def test_a_failed_first_nlp_returns_the_better_point() -> None:
    """The point that is returned is no worse than the start if an NLP came nearer before it failed."""
    problem = _contradiction([5, 5])
    solution = solve(problem, Run(OPTIONS))
    best = min(report.residuals.constraint_violation for report in solution.reports)
    assert best < 1.5 < problem.residuals(problem.start).constraint_violation
    assert solution.residuals.constraint_violation <= 1.5


def test_the_iteration_limit_is_a_status() -> None:
    """An NLP that runs out of iterations ends the homotopy with its point and status."""
    solution = solve(NEAR_MISS, Run(HomotopyOptions(max_iterations=2)))
    assert (solution.solved, solution.status, len(solution.reports)) == (False, "iteration limit", 1)
    assert solution.iterations == 2
    assert np.isfinite(solution.w).all()


def test_the_time_limit_is_obeyed() -> None:
    """A homotopy whose iterations take 50 ms each stops within its limit of 0.3 s and one iteration."""

    def slow(iteration: int, objective: float) -> bool:
        time.sleep(0.05)
        return False

    solution = solve(NEAR_MISS, Run(deadline=Deadline(0.3), stop=slow))
    assert (solution.solved, solution.status) == (False, "time limit")
    assert 0.25 <= solution.solve_seconds <= 1.0
    assert np.isfinite(solution.w).all()


def test_no_time_at_all_returns_the_start() -> None:
    """With no time left not even the first NLP runs."""
    problem = BY_NAME["equality"]
    solution = solve(problem, Run(deadline=Deadline(1e-9)))
    assert (solution.solved, solution.status, solution.reports) == (False, "time limit", [])
    assert solution.w.tolist() == problem.start.tolist()


@pytest.mark.parametrize("calls", [1, 5, 30])
def test_stop_ends_with_a_point(calls: int) -> None:
    """When `stop` says so, in the first NLP or later, the solve ends interrupted with a finite point of small error."""
    seen: list[tuple[int, float]] = []

    def stop(iteration: int, objective: float) -> bool:
        seen.append((iteration, objective))
        return len(seen) >= calls

    solution = solve(NEAR_MISS, Run(OPTIONS, stop=stop))
    assert len(seen) == calls
    assert (solution.solved, solution.status) == (False, "interrupted")
    assert solution.reports[-1].status == "interrupted"
    assert np.isfinite(solution.w).all()
    if calls == 30:
        assert len(solution.reports) > 1
        assert solution.residuals.constraint_violation <= 1e-8
        assert solution.residuals.complementarity <= solution.reports[0].residuals.complementarity


def test_progress_sees_every_nlp() -> None:
    """`progress` gets the reports that the solution keeps, in order, each with residuals of its own point."""
    reported: list[NlpReport] = []
    solution = solve(NEAR_MISS, Run(OPTIONS, report=reported.append))
    assert reported == solution.reports
    products = [report.residuals.complementarity for report in reported]
    assert products == sorted(products, reverse=True)
    assert reported[-1].residuals == solution.residuals


def test_an_assembled_problem_can_be_reused() -> None:
    """The same blocks with other bounds and start need no new derivatives."""
    problem = NEAR_MISS
    nlp = assemble(problem, scholtes)
    moved = Mpcc(lower=np.array([0.5, -np.inf]), upper=problem.upper, start=np.array([2.0, 0.0]), blocks=problem.blocks)
    assert solve(problem, Run(OPTIONS), nlp=nlp).w == pytest.approx([0, 2], abs=1e-7)
    assert solve(moved, Run(OPTIONS), nlp=nlp).w == pytest.approx([1, 0], abs=1e-7)


def test_another_relaxation_can_be_given() -> None:
    """Any smooth row that holds the pair as sigma vanishes leads to the same solution."""

    def smoothed_minimum(G: ca.SX, H: ca.SX, sigma: ca.SX) -> ca.SX:
        return G + H - ca.sqrt((G - H) ** 2 + 4 * sigma)

    solution = solve(NEAR_MISS, Run(OPTIONS), relaxation=Relaxation("smoothed minimum", smoothed_minimum))
    assert solution.solved
    assert solution.w == pytest.approx([0, 2], abs=1e-7)


@pytest.mark.parametrize("options", [{"linear_solver": "abacus"}, {"ipopt": {"no_such_option": 1}}], ids=str)
def test_a_solver_that_cannot_run_is_an_error(options: dict[str, Any]) -> None:
    """What IPOPT cannot start with is an exception, not a status."""
    with pytest.raises(SolverError, match="IPOPT could not be run"):
        solve(NEAR_MISS, Run(HomotopyOptions(**options)))


@pytest.mark.parametrize("tolerance", [1e-3, 1e-8, 1.0])
@pytest.mark.parametrize("factor", [0.1, 0.35, 0.9])
@pytest.mark.parametrize("ratio", [1.0, 100.0, 3000.0])
def test_sigmas_end_at_the_tolerance(tolerance: float, factor: float, ratio: float) -> None:
    """Both levels start at their sigma, never grow, keep their order, and end at the tolerance."""
    options = HomotopyOptions(tolerance=tolerance, sigma_start=1.0, sigma_factor=factor, velocity_level_ratio=ratio)
    sigmas = np.array(options.sigmas())
    assert sigmas[0].tolist() == [1.0, ratio]
    assert sigmas[-1].tolist() == pytest.approx([tolerance, tolerance], rel=1e-12)
    assert (np.diff(sigmas, axis=0) <= 0).all()
    assert (np.diff(sigmas.sum(axis=1)) < 0).all()
    assert (sigmas[:, 1] >= sigmas[:, 0]).all() and (sigmas >= tolerance).all()
    assert (sigmas[1:] >= factor**2 * sigmas[:-1] * (1 - 1e-12)).all()
