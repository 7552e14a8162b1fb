"""A solution carried over to more stages of every element."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fesd_robot.fesd import (
    FesdOptions,
    Scheme,
    Transcription,
    initial_value_problem,
    make_tableau,
    with_stages,
)
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import HomotopyOptions, MpccSolution, continue_on_branch, solve

from .systems import leaving

DURATION = 0.9
OPTIONS = HomotopyOptions(tolerance=1e-6)
REFINED = [("radau_iia", 3), ("radau_iia", 4), ("gauss_legendre", 3)]


def solved(scheme: Scheme, stages: int) -> tuple[Transcription, MpccSolution]:
    """x' = t - sign(x) from -1/2: a parabola until it reaches zero at sqrt 2 - 1, where it slides."""
    options = FesdOptions(tableau=make_tableau(scheme, stages), elements=3)
    transcription = Transcription(initial_value_problem(leaving(), [-0.5, 0.0], DURATION), options)
    solution = solve(transcription.problem, OPTIONS, polisher=BranchTranscription(transcription))
    assert solution.exact
    return transcription, solution


@pytest.mark.parametrize(("scheme", "stages"), REFINED)
def test_a_parabola_is_reproduced(scheme: Scheme, stages: int) -> None:
    """What two stages integrate exactly is, interpolated, the exact solution of the problem with more stages, too."""
    transcription, solution = solved(scheme, 2)
    refined, w = with_stages(transcription, solution.w, stages)
    assert refined.options == replace(transcription.options, tableau=make_tableau(scheme, stages))
    residuals = refined.problem.residuals(w)
    assert residuals.constraint_violation <= 1e-9 and residuals.complementarity <= 1e-12
    assert refined.cost_terms(w) == pytest.approx(transcription.cost_terms(solution.w), abs=1e-12)
    before, after = transcription.unpack(solution.w), refined.unpack(w)
    assert [one.step for one in after] == [one.step for one in before]
    for element in after:
        times = element.start + element.step * refined.options.tableau.c
        expected = np.where(times < np.sqrt(2) - 1, 0.5 * (times + 1) ** 2 - 1, 0.0)
        np.testing.assert_allclose(element.x[:stages], np.column_stack([expected, times]), atol=1e-9)
        assert element.x[-1][1] == pytest.approx(element.end, abs=1e-9)


def test_the_same_stages_change_nothing() -> None:
    """With the stages that it has, a point is the point it was, to round-off."""
    for scheme in ("radau_iia", "gauss_legendre"):
        transcription, solution = solved(scheme, 2)  # type: ignore[arg-type]
        _, w = with_stages(transcription, solution.w, 2)
        np.testing.assert_allclose(w, solution.w, atol=1e-12)


def test_a_coarse_solution_is_continued_on_its_branch() -> None:
    """From one stage, whose parabola is none, the branch leads to the exact switch of two; earlier NLPs stay listed."""
    transcription, coarse = solved("radau_iia", 1)
    switch = np.sqrt(2) - 1
    assert coarse.branch is not None and coarse.status == "converged"
    assert min(abs(element.end - switch) for element in transcription.unpack(coarse.w)) > 1e-3
    refined, w = with_stages(transcription, coarse.w, 2)
    fine = continue_on_branch(
        refined.problem,
        BranchTranscription(refined),
        (w, coarse.branch),
        coarse,
        OPTIONS,
        seconds_left=lambda: None,
    )
    assert fine is not None and fine.exact and fine.residuals.complementarity <= 1e-12
    assert min(abs(element.end - switch) for element in refined.unpack(fine.w)) <= 1e-9
    assert fine.reports[: len(coarse.reports)] == coarse.reports and len(fine.reports) > len(coarse.reports)
    assert fine.solve_seconds > coarse.solve_seconds


def test_no_time_is_no_refinement() -> None:
    """Without a second left nothing is continued."""
    transcription, coarse = solved("radau_iia", 1)
    refined, w = with_stages(transcription, coarse.w, 2)
    assert coarse.branch is not None
    start = (w, coarse.branch)
    polisher = BranchTranscription(refined)
    assert continue_on_branch(refined.problem, polisher, start, coarse, OPTIONS, seconds_left=lambda: 0.0) is None
