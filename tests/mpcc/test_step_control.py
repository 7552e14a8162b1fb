"""The loose homotopy after an NLP that is lost: a shorter step from the one before."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fesd_robot.mpcc import HomotopyOptions, Mpcc, MpccSolution, NlpStatus, PairPolisher, Run, homotopy, solve
from fesd_robot.mpcc.homotopy import LOST_IN_A_ROW, LOST_VIOLATION, SHORTEST_STEP
from fesd_robot.mpcc.relaxed_settings import NEAR_BARRIER
from fesd_robot.nlp import Nlp, NlpNumbers, NlpPoint, NlpResult, NlpSettings, prepared
from fesd_robot.running import SearchEffort

from .known import X, Y, mpcc

PROBLEM = mpcc((X - 2) ** 2 + (Y - 1) ** 2, X, Y, [1, 1], g=X + Y - 2)
OPTIONS = HomotopyOptions(sigma_start=1.0, sigma_factor=0.1)


class Solver:
    """IPOPT, except that it loses its way in a loose NLP where sigma has shrunk by more than a factor.

    Attributes:
        calls: sigma of the position level, point of the start, and whether it was lost, of every loose NLP.
        barriers: IPOPT's first barrier parameter, if it is told one, of every loose NLP.
    """

    def __init__(self, smallest: float, iterations: int = OPTIONS.loose_iterations) -> None:
        self.smallest, self.iterations = smallest, iterations
        self.calls: list[tuple[float, NlpPoint, bool]] = []
        self.barriers: list[float | None] = []
        self._reached = np.inf

    def __call__(self, nlp: Nlp, settings: NlpSettings) -> Any:
        """As `prepared`."""
        return SimpleNamespace(solve=partial(self.solve, prepared(nlp, settings), settings))

    def solve(
        self, solver: Any, settings: NlpSettings, numbers: NlpNumbers, start: NlpPoint, **given: Any
    ) -> NlpResult:
        """As `Prepared.solve`."""
        sigma, result = numbers.p[0], solver.solve(numbers, start, **given)
        if not sigma or settings.iterations != OPTIONS.loose_iterations:
            return result
        lost = bool(self.calls) and sigma < self.smallest * self._reached
        self.calls.append((sigma, start, lost))
        self.barriers.append(settings.start.barrier if settings.start.multipliers else None)
        if lost:
            far = replace(result.point, x=result.point.x + 1.0)
            return replace(result, status=NlpStatus.ITERATION_LIMIT, point=far, iterations=self.iterations)
        self._reached = sigma
        return result


def _solved(
    monkeypatch: pytest.MonkeyPatch, solver: Solver, problem: Mpcc = PROBLEM, readable: float = 0.0
) -> MpccSolution:
    monkeypatch.setattr(homotopy, "prepared", solver)
    return solve(problem, Run(replace(OPTIONS, readable_at=readable)), polisher=PairPolisher(problem))


def test_a_lost_nlp_is_repeated_with_a_shorter_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """A solver that follows sigma down to a fifth only gets there by half steps, each from the last good point."""
    solver = Solver(smallest=0.2)
    solution = _solved(monkeypatch, solver)
    assert solution.solved and solution.exact and solution.w == pytest.approx([2, 0], abs=1e-8)
    lost = [k for k, call in enumerate(solver.calls) if call[2]]
    assert lost and lost[0] == 1 and [call[0] for call in solver.calls[:2]] == pytest.approx([1.0, 0.1])
    for k in lost:
        (_, start, _), (sigma, again, _) = solver.calls[k], solver.calls[k + 1]
        reached = max(call[0] for call in solver.calls[:k] if not call[2] and call[1] is not start)
        assert again is start and solver.calls[k][0] < sigma < reached
    assert solver.calls[2][0] == pytest.approx(np.sqrt(0.1))


def test_steps_grow_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """After an NLP of few iterations the step is doubled, never beyond the schedule's."""
    solver = Solver(smallest=0.2)
    _solved(monkeypatch, solver)
    assert solver.calls[3][0] == pytest.approx(0.1 * solver.calls[2][0]), "a whole step again after half a step"
    good = [call[0] for call in solver.calls if not call[2]]
    assert all(0.0099 <= after / before < 1 for before, after in pairwise(good))
    plain = Solver(smallest=0.0)
    assert _solved(monkeypatch, plain).exact
    assert [call[0] for call in plain.calls] == pytest.approx([sigma for sigma, _ in _plain_sigmas(len(plain.calls))])


def test_a_shortened_step_goes_on_from_multipliers(monkeypatch: pytest.MonkeyPatch) -> None:
    """After half a step an NLP begins with multipliers, at the barrier parameter of one that is near; else at none."""
    solver = Solver(smallest=0.2)
    _solved(monkeypatch, solver)
    assert solver.barriers[:3] == [None, None, NEAR_BARRIER], "the first, a whole step, half a step"
    assert np.abs(solver.calls[2][1].lam_g).max() > 0
    assert solver.barriers[3] is None, "a whole step again"


def _plain_sigmas(count: int) -> list[tuple[float, float]]:
    return replace(OPTIONS, velocity_level_ratio=1.0).sigmas()[:count]


@pytest.mark.parametrize("iterations", [1, OPTIONS.loose_iterations])
def test_a_solver_that_is_always_lost_comes_to_an_end(monkeypatch: pytest.MonkeyPatch, iterations: int) -> None:
    """Steps get no shorter than an eighth and no more than twelve NLPs are repeated; then the homotopy goes on."""
    solver = Solver(smallest=1.0, iterations=iterations)
    _solved(monkeypatch, solver)
    sigmas = [call[0] for call in solver.calls]
    repeated = sum(after > before for before, after in pairwise(sigmas))
    assert 3 <= repeated <= SearchEffort.lost_nlps
    assert sigmas[3] == pytest.approx(0.1 ** (2 * SHORTEST_STEP)) and sigmas[4] == pytest.approx(0.1**SHORTEST_STEP)
    assert sigmas[-1] <= OPTIONS.polish_at and len(sigmas) <= SearchEffort.lost_nlps + 60


def test_where_nlps_are_lost_the_branch_is_read_from_the_point_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two lost NLPs in a row at a readable sigma are enough, and its branch leads to the exact point; above it not."""
    solver = Solver(smallest=1.0)
    solution = _solved(monkeypatch, solver, readable=1.0)
    assert solution.exact and solution.w == pytest.approx([2, 0], abs=1e-8)
    assert [lost for *_, lost in solver.calls] == [False] + [True] * LOST_IN_A_ROW
    patient = Solver(smallest=1.0)
    assert _solved(monkeypatch, patient, readable=0.5 * OPTIONS.sigma_start).exact
    assert len(patient.calls) > len(solver.calls)


def test_a_readable_homotopy_that_is_always_lost_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the branch that is read leads nowhere and steps have become shortest, sigma falls by whole steps."""
    solver = Solver(smallest=1.0)
    monkeypatch.setattr(homotopy.BranchNlp, "solve", lambda *_, **__: None)
    solution = _solved(monkeypatch, solver, readable=1.0)
    sigmas = [call[0] for call in solver.calls]
    assert sum(after > before for before, after in pairwise(sigmas)) == 3, "half, quarter, eighth of a step"
    assert max(after / before for before, after in pairwise(sigmas[4:])) <= OPTIONS.sigma_factor * (1 + 1e-9)
    assert not solution.exact and min(sigmas) <= OPTIONS.polish_at


def test_a_start_that_is_lost_is_not_repeated(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before the first NLP there is nothing to go back to: it is taken as it is."""
    assert PROBLEM.residuals(PROBLEM.start).constraint_violation < LOST_VIOLATION

    class Lost(Solver):
        def solve(self, solver: Any, settings: NlpSettings, numbers: NlpNumbers, *rest: Any, **given: Any) -> NlpResult:
            result = super().solve(solver, settings, numbers, *rest, **given)
            if len(self.calls) > 1 or not numbers.p[0]:
                return result
            far = replace(result.point, x=result.point.x + 1.0)
            return replace(result, status=NlpStatus.ITERATION_LIMIT, point=far)

    solver = Lost(smallest=0.0)
    solution = _solved(monkeypatch, solver)
    assert solution.exact and [call[0] for call in solver.calls[:2]] == pytest.approx([1.0, 0.1])


def test_an_interrupt_is_no_lost_nlp(monkeypatch: pytest.MonkeyPatch) -> None:
    """A user who stops in the second NLP, far from its constraints, gets no third one."""

    class Interrupted(Solver):
        def solve(self, *rest: Any, **given: Any) -> NlpResult:
            result = super().solve(*rest, **given)
            return replace(result, status=NlpStatus.INTERRUPTED) if self.calls[-1][2] else result

    solver = Interrupted(smallest=0.2)
    solution = _solved(monkeypatch, solver)
    assert (solution.solved, solution.status, len(solver.calls)) == (False, "interrupted", 2)


@pytest.mark.parametrize("gain", [0.1, 100.0])
def test_a_cost_that_is_exploited_gives_way(gain: float) -> None:
    """One and the distance from (1, 0) minus gain x y, which is zero where one of both is: if products that are only
    relaxed make it negative, the first NLP is solved again with what stands in its place, else nothing changes."""
    distance = 1 + (X - 1) ** 2 + Y**2
    problem = mpcc(distance - gain * X * Y, X, Y, [0.5, 0.5])
    (block,) = problem.blocks
    problem = replace(problem, blocks=[replace(block, equations=replace(block.equations, if_exploited=gain * X * Y))])
    end = solve(problem, Run(OPTIONS), polisher=PairPolisher(problem))
    exploited = end.reports[0].residuals.objective < 0
    assert exploited is (gain > 1)
    assert (end.reports[1].sigma == end.reports[0].sigma) is exploited
    assert end.solved and end.w == pytest.approx([1, 0], abs=1e-7)


@pytest.mark.parametrize("has_other", [True, False])
def test_a_lost_nlp_with_a_cost_that_is_exploited_gives_way(monkeypatch: pytest.MonkeyPatch, has_other: bool) -> None:
    """An NLP that is lost with a negative cost is solved again with what stands in its place, once, or steps halve."""
    problem = mpcc(1 + (X - 1) ** 2 + Y**2 - 1.5 * X * Y, X, Y, [0.5, 0.5], g=X + Y - 1)
    (block,) = problem.blocks
    if has_other:
        problem = replace(
            problem, blocks=[replace(block, equations=replace(block.equations, if_exploited=1.5 * X * Y))]
        )
    solver = Solver(smallest=0.2)
    solution = _solved(monkeypatch, solver, problem)
    costs = [report.residuals.objective for report in solution.reports]
    assert costs[0] > 0 > costs[1] and solver.calls[1][2], "the first is not lost, the second is, below zero"
    sigmas = [call[0] for call in solver.calls[:4]]
    assert sigmas == pytest.approx(
        [1.0, 0.1, 0.1, np.sqrt(0.1)] if has_other else [1.0, 0.1, np.sqrt(0.1), *sigmas[3:]]
    )
    assert solution.exact and solution.w == pytest.approx([1, 0], abs=1e-7)
