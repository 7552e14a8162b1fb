"""A solution carried over to more stages of every element."""

from __future__ import annotations

import numpy as np
import pytest

from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd import (
    FesdOptions,
    Scheme,
    Transcription,
    initial_value_problem,
    make_tableau,
    with_stages,
)
from fesd_robot.fesd.polishing import BranchMotion, BranchTranscription
from fesd_robot.mpcc import HomotopyOptions, MpccSolution, Run, continue_on_branch, solve
from fesd_robot.running.deadline import Deadline

from .systems import leaving, scalar

OPTIONS = HomotopyOptions(tolerance=1e-6)
REFINED = [("radau_iia", 3), ("radau_iia", 4), ("gauss_legendre", 3)]
SWITCH = np.sqrt(2) - 1
"""When x' = t - sign(x) reaches zero from -1/2 along a parabola; it slides from there on."""


def solved(
    scheme: Scheme, stages: int, system: ComplementaritySystem, initial: list[float]
) -> tuple[Transcription, MpccSolution]:
    """Solve an initial value problem over 0.9 s exactly with three elements."""
    options = FesdOptions(tableau=make_tableau(scheme, stages), elements=3)
    transcription = Transcription(initial_value_problem(system, initial, 0.9), options)
    solution = solve(transcription.problem, Run(OPTIONS), polisher=BranchTranscription(transcription))
    assert solution.exact
    return transcription, solution


def staged(transcription: Transcription, solution: MpccSolution, stages: int) -> BranchMotion:
    """Return a solution with other stages."""
    return with_stages(BranchMotion.of_solution(BranchTranscription(transcription), solution), stages)


@pytest.mark.parametrize(("scheme", "stages"), REFINED)
def test_a_solution_of_lines_is_one_of_more_stages(scheme: Scheme, stages: int) -> None:
    """Where states and multipliers are lines, the interpolated point is an exact solution of the refined problem."""
    transcription, solution = solved(scheme, 2, scalar("crossing"), [-1.0])
    motion = staged(transcription, solution, stages)
    refined, w = motion.transcription, motion.w
    tableau = refined.options.tableau
    assert (tableau.scheme, tableau.stages, refined.ocp) == (scheme, stages, transcription.ocp)
    residuals = refined.problem.residuals(w)
    assert residuals.constraint_violation <= 1e-9 and residuals.complementarity <= 1e-12
    assert refined.cost_terms(w) == pytest.approx(transcription.cost_terms(solution.w), abs=1e-12)
    before, after = transcription.unpack(solution.w), refined.unpack(w)
    assert [one.step for one in after] == [one.step for one in before]
    for element in after:
        times = element.start + element.step * tableau.c
        expected = np.where(times < 1 / 3, 3 * times - 1, times - 1 / 3)
        np.testing.assert_allclose(element.x[:stages, 0], expected, atol=1e-9)


@pytest.mark.parametrize(("scheme", "stages"), REFINED)
def test_states_follow_their_parabola(scheme: Scheme, stages: int) -> None:
    """What two stages integrate exactly is the exact state at every stage of more, and at the ends of elements."""
    transcription, solution = solved(scheme, 2, leaving(), [-0.5, 0.0])
    motion = staged(transcription, solution, stages)
    refined, w = motion.transcription, motion.w
    for element in refined.unpack(w):
        times = np.append(element.start + element.step * refined.options.tableau.c, element.end)
        exact = np.where(times < SWITCH, 0.5 * (times + 1) ** 2 - 1, 0.0)
        states = np.vstack([element.x[:stages], element.x[-1:]])
        np.testing.assert_allclose(states, np.column_stack([exact, times]), atol=1e-9)


def test_the_same_stages_change_nothing() -> None:
    """With the stages that it has, a point is the point it was, to round-off."""
    schemes: list[Scheme] = ["radau_iia", "gauss_legendre"]
    for scheme in schemes:
        transcription, solution = solved(scheme, 2, leaving(), [-0.5, 0.0])
        np.testing.assert_allclose(staged(transcription, solution, 2).w, solution.w, atol=1e-12)


def test_a_coarse_solution_is_continued_on_its_branch() -> None:
    """From one stage, whose parabola is none, the branch leads to the exact switch of two; earlier NLPs stay listed."""
    transcription, coarse = solved("radau_iia", 1, leaving(), [-0.5, 0.0])
    assert coarse.branch is not None and coarse.status == "converged"
    assert min(abs(element.end - SWITCH) for element in transcription.unpack(coarse.w)) > 1e-3
    start = staged(transcription, coarse, 2)
    refined = start.transcription
    fine = continue_on_branch(refined.problem, start.polisher, start, coarse, Run(OPTIONS))
    assert fine is not None and fine.exact and fine.residuals.complementarity <= 1e-12
    assert min(abs(element.end - SWITCH) for element in refined.unpack(fine.w)) <= 1e-9
    assert fine.reports[: len(coarse.reports)] == coarse.reports and len(fine.reports) > len(coarse.reports)
    assert fine.solve_seconds > coarse.solve_seconds


def test_no_time_is_no_refinement() -> None:
    """Without a second left nothing is continued."""
    transcription, coarse = solved("radau_iia", 1, leaving(), [-0.5, 0.0])
    start, nothing = staged(transcription, coarse, 2), Run(OPTIONS, Deadline(0.0))
    assert continue_on_branch(start.transcription.problem, start.polisher, start, coarse, nothing) is None
