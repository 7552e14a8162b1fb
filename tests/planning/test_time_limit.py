"""A time limit is the total: after it nothing is searched, refined or certified, and a plan is there all the same."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from fesd_robot.errors import TaskError
from fesd_robot.mpcc import NlpReport
from fesd_robot.planning import planner
from fesd_robot.plans import Plan, read_plan, report, write_plan
from fesd_robot.running import Activity, Deadline, OutOfTime, held_to
from fesd_robot.task import Task, load_task

MARGIN = 1.0
"""s by which an NLP may end after the limit: one iteration of it, on a busy machine."""


def _planned(task: Task, limit: float) -> tuple[Plan, float, list[float], list[Activity]]:
    """Return a plan, how long it took, when its NLPs ended, and the activities that began after the limit."""
    begin, ends, late = time.perf_counter(), list[float](), list[Activity]()

    def report_of(nlp: NlpReport) -> None:
        ends.append(time.perf_counter() - begin)

    def activity(which: Activity) -> None:
        if time.perf_counter() - begin > limit:
            late.append(which)

    with held_to(Deadline(limit)):
        plan = planner.plan(task, progress=report_of, on_activity=activity)
    return plan, time.perf_counter() - begin, ends, late


@pytest.mark.parametrize("grid", ["phases", "uniform"])
@pytest.mark.parametrize("limit", [0.6, 1.5])
def test_nothing_goes_on_after_the_limit(grid: str, limit: float) -> None:
    """A jump that takes several seconds ends soon after less, on both grids, and its plan can be written."""
    task = load_task("hopper_one_jump", [f"method.grid={grid}"])
    try:
        plan, seconds, ends, late = _planned(task, limit)
    except TaskError as error:
        assert "the time limit came while the equations were built" in str(error)
        return
    assert not plan.status.solved and plan.status.stationarity == "unknown"
    assert all(end <= limit + MARGIN for end in ends)
    assert late in ([], [Activity.REFINING], [Activity.CERTIFYING])
    assert seconds <= limit + 2.0 + MARGIN


def test_a_limit_before_any_motion_gives_the_guess(tmp_path: Path, load_short: Callable[..., Task]) -> None:
    """The plan says the time limit, is not driven again, and can be written, read and reported."""
    task = load_short()
    formulate = planner.formulate

    def late(task: Task) -> object:
        motion = formulate(task)
        held = planner.held_deadline()
        assert held is not None
        time.sleep(max(held.left, 0.0))
        return motion

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(planner, "formulate", late)
        plan, _, ends, _ = _planned(task, 3.0)
    assert not ends and plan.status.nlp == "time limit" and plan.replay is None
    assert "time limit" in plan.status.message and "solver.time_limit" in plan.status.message
    assert plan.warnings == ["Whether bodies overlap is not known: the time limit came before that was looked at."]
    write_plan(plan, tmp_path / "run")
    assert read_plan(tmp_path / "run").status == plan.status and "time limit" in report(plan)


def test_a_motion_that_was_not_driven_again_is_not_called_solved(
    monkeypatch: pytest.MonkeyPatch, load_short: Callable[..., Task]
) -> None:
    """Its audit is not complete; the message says so."""
    monkeypatch.setattr(planner, "_replay_of", lambda solved, run: None)
    plan = planner.plan(load_short("solver.retries=0"))
    assert not plan.status.solved and not plan.status.audit_passed
    assert plan.status.message == planner.NOT_REPLAYED


def test_a_limit_in_the_middle_of_the_equations_is_a_sentence(
    monkeypatch: pytest.MonkeyPatch, load_short: Callable[..., Task]
) -> None:
    """It names the key, and what would be valid."""

    def endless(task: Task) -> object:
        raise OutOfTime("the time limit is over")

    monkeypatch.setattr(planner, "formulate", endless)
    with pytest.raises(TaskError, match=r"solver.time_limit: the time limit came .* expected a longer one"):
        planner.plan(load_short("solver.time_limit=1"))


def test_the_search_leaves_time_for_refinement() -> None:
    """With a limit that suffices for a motion, but not for all cheaper ones, the plan is refined and audited."""
    task = load_task("hopper_one_jump", ["solver.effort=best", "solver.processes=1"])
    plan, seconds, _, _ = _planned(task, 60.0)
    assert plan.status.solved, plan.status.message
    assert seconds <= 66.0
