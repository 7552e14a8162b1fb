"""What of a motion in the plane becomes a start in space."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fesd_robot import sagittal_start
from fesd_robot.mpcc import BranchPoint, BranchSolver
from fesd_robot.strategies.deadline import Deadline


@pytest.mark.parametrize("leads", ["refined", "before", ""])
def test_the_refined_motion_is_lifted_first(leads: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where it leads to no motion in space, the one before its refinement is lifted, which it is not otherwise."""
    lifted: list[str] = []

    def found(lift: Any, *_: Any) -> str | None:
        lifted.append(lift.planar)
        return "a motion" if lift.planar == leads else None

    monkeypatch.setattr(sagittal_start, "sagittal_twin", lambda motion: SimpleNamespace(task="a task"))
    monkeypatch.setattr(sagittal_start, "_lifted", found)
    nothing: Any = None

    def planned(task: Any) -> Any:
        assert task == "a task"
        return ["refined", "before"]

    start = sagittal_start.sagittal_start(nothing, planned, nothing, nothing, None, None)
    assert start == ("a motion" if leads else None)
    assert lifted == (["refined"] if leads == "refined" else ["refined", "before"])


def test_nothing_is_lifted_when_the_time_is_over(monkeypatch: pytest.MonkeyPatch) -> None:
    """The functions of the NLP in space, which take minutes to compile, are not made then."""
    nothing: Any = None
    lift: Any = SimpleNamespace(
        planar=SimpleNamespace(solution=SimpleNamespace(exact=True)),
        transcription=SimpleNamespace(problem=None),
        point=lambda: BranchPoint(np.zeros(0), nothing),
    )
    monkeypatch.setattr(sagittal_start, "BranchTranscription", lambda transcription: None)
    monkeypatch.setattr(BranchSolver, "_linear_solver", {})
    assert sagittal_start._lifted(lift, nothing, Deadline(0.0), None, None) is None
    with pytest.raises(AttributeError):
        sagittal_start._lifted(lift, nothing, Deadline(None), None, None)
