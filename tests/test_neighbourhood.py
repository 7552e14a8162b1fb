"""The neighbourhood of a real motion: what its ends are worth, with all elements in use."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.adapters import homotopy_options
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import BranchPoint, PolishingReport, solve
from fesd_robot.neighbourhood import Neighbourhood
from fesd_robot.ocp import formulate
from fesd_robot.strategies.deadline import Deadline
from fesd_robot.task import load_task

TASKS = Path(__file__).parents[1] / "tasks"

Motion = tuple[Neighbourhood, PolishingReport]


@pytest.fixture(scope="module")
def motion() -> Motion:
    """A block that slides, waits and is pushed on, with room in every interval, and its exact end there."""
    task = load_task(TASKS / "block_push.yaml")
    options, (ocp, fesd) = homotopy_options(task), ((own := formulate(task)).ocp, own.fesd)
    transcription = Transcription(ocp, fesd)
    solution = solve(transcription.problem, options, polisher=BranchTranscription(transcription))
    assert solution.branch is not None
    around = Neighbourhood.of(transcription, solution.w, solution.branch, options, Deadline(), None)
    end = around.filled(around.solver.exact(around.start))
    assert end is not None
    return around, end


def _lengths(around: Neighbourhood, end: PolishingReport) -> np.ndarray:
    """Return the lengths of the elements relative to equal parts of their intervals."""
    elements, ocp = around.transcription.unpack(end.w), around.transcription.ocp
    counts = np.repeat(around.transcription.elements, around.transcription.elements)
    return np.array([element.step for element in elements]) * counts * ocp.intervals / ocp.duration


def test_an_element_at_its_least_length_is_put_to_use_whether_its_branch_says_so_or_not(motion: Motion) -> None:
    """A motion that ends with an element of no length costs what it does with all of them in use, also where the
    branch does not say that this element has none: what fewer elements gain by their errors is no gain."""
    around, end = motion
    interval = next(k for k, own in enumerate(_by_interval(around, end)) if len(set(own)) == 1)
    first = sum(around.transcription.elements[:interval])
    without = tuple(e in (first, first + 1) for e in range(len(end.branch.without_length)))
    shrunk = around.solver.exact(BranchPoint(end.w, replace(end.branch, without_length=without)))
    assert shrunk is not None and _lengths(around, shrunk).min() < 1e-9
    unsaid = replace(shrunk, branch=replace(shrunk.branch, without_length=(False,) * len(without)))
    for one in (shrunk, unsaid):
        whole = around.filled(one)
        assert whole is not None and _lengths(around, whole).min() > 1e-3
        assert whole.residuals.objective == pytest.approx(end.residuals.objective, rel=1e-6)


def _by_interval(around: Neighbourhood, end: PolishingReport) -> list[list[object]]:
    """Return the factors of the elements of every interval."""
    bounds = np.cumsum([0, *around.transcription.elements])
    return [list(end.branch.factors[a:b]) for a, b in pairwise(bounds)]
