"""Refinement of a real motion from two stages on."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fesd_robot.adapters import homotopy_options
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import solve
from fesd_robot.ocp import formulate
from fesd_robot.refine import SPARE, refined
from fesd_robot.repair import Repair
from fesd_robot.solved_motion import SolvedMotion
from fesd_robot.strategies.deadline import Deadline
from fesd_robot.task import load_task

TASKS = Path(__file__).parents[1] / "tasks"


def test_a_motion_that_no_finer_grid_has_leads_to_one_that_is_true() -> None:
    """The biped's step from two stages is none: it ends with every entry of the audit below a tenth of its limit."""
    task = load_task(TASKS / "biped_step.yaml")
    motion, options = formulate(task), homotopy_options(task)
    transcription = Transcription(motion.ocp, motion.fesd)
    repair = Repair(transcription, options, Deadline(), None, None)
    solution = solve(transcription.problem, options, polisher=BranchTranscription(transcription), otherwise=repair)
    before = SolvedMotion.of(motion, *repair.repaired(BranchTranscription(transcription), solution))
    assert before.solution.exact and before.audit.violations
    after = refined(before, options, 1e-7, Deadline(), None, None)
    assert after.audit.worst[0] <= SPARE and after.local_errors.max() <= 1e-7
    assert after.rounds > 0 and after.stages > before.stages


@pytest.mark.parametrize(("errors", "none"), [([0.2, 1e-9], True), ([0.09, np.inf], False)])
def test_what_is_no_motion_is_not_refined(errors: list[float], none: bool) -> None:
    """An element that errs by a tenth of its states is none; one whose error cannot be estimated may be."""
    coarse = SimpleNamespace(solution=SimpleNamespace(exact=True), local_errors=np.array(errors))
    if none:
        assert refined(cast(Any, coarse), cast(Any, None), 1e-7, Deadline(), None, None) is coarse
    else:
        with pytest.raises(AttributeError, match="rounds"):  # it goes on
            refined(cast(Any, coarse), cast(Any, None), 1e-7, Deadline(), None, None)
