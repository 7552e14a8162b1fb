"""The neighbourhood of a real motion: what its ends are worth, with all elements in use."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.adapters import homotopy_options
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.neighbours import intervals_of
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
    own = formulate(task := load_task(TASKS / "block_push.yaml", ["method.grid=uniform"]))
    options, transcription = homotopy_options(task), Transcription(own.ocp, own.fesd)
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
    intervals = intervals_of(around.transcription.elements)
    in_one_mode = next(own for own in intervals if len({end.branch.factors[e] for e in own}) == 1)
    without = tuple(e in in_one_mode[:2] for e in range(len(end.branch.without_length)))
    shrunk = around.solver.exact(BranchPoint(end.w, replace(end.branch, without_length=without)))
    assert shrunk is not None and _lengths(around, shrunk).min() < 1e-9
    unsaid = replace(shrunk, branch=replace(shrunk.branch, without_length=(False,) * len(without)))
    for one in (shrunk, unsaid):
        whole = around.filled(one)
        assert whole is not None and _lengths(around, whole).min() > 1e-3
        assert whole.residuals.objective == pytest.approx(end.residuals.objective, rel=1e-6)
