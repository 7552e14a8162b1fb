"""A task that is not solved is tried with fallback settings, each reported, and the first solved plan is kept."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fesd_robot.planning import planner
from fesd_robot.planning.fallbacks import FALLBACKS, SOFT_GOAL, has_hard_goal, with_overrides
from fesd_robot.plans import Plan, read_plan, write_plan
from fesd_robot.plans.report_text import report
from fesd_robot.running import held_deadline
from fesd_robot.task import Task


def test_fallbacks_change_settings_only(short_task: Task) -> None:
    """Each fallback differs from the task in a key of its solver or method, and keeps what is asked for."""
    assert len(FALLBACKS) == 8
    for fallback in FALLBACKS:
        overrides = fallback(short_task)
        other = with_overrides(short_task, overrides)
        assert other != short_task and other.error("solver", "").file == short_task.error("solver", "").file
        for name in set(Task.model_fields) - {"solver", "method"}:
            assert getattr(other, name) == getattr(short_task, name)
        assert other.solver.tolerance == short_task.solver.tolerance
        for key, value in overrides.items():
            section, last = key.split(".")
            assert getattr(getattr(other, section), last) == value != getattr(getattr(short_task, section), last)


class Attempts:
    """Stands in for the planner's single attempt: outcomes in order, and the tasks that were tried."""

    def __init__(self, example: Plan, outcomes: list[str]) -> None:
        self.example, self.outcomes = example, outcomes
        self.tasks: list[Task] = []
        self.seconds: list[float] = []

    def __call__(self, task: Task, **_: Any) -> Plan:
        outcome = self.outcomes[len(self.tasks)]
        self.tasks.append(task)
        deadline = held_deadline()
        assert deadline is not None
        self.seconds.append(deadline.left)
        status = self.example.status.model_copy(
            update={"solved": outcome == "solved", "nlp": outcome, "message": f"{outcome} {len(self.tasks)}"}
        )
        return self.example.model_copy(update={"status": status})


def _planned(
    monkeypatch: pytest.MonkeyPatch, task: Task, example: Plan, outcomes: list[str], **solver: Any
) -> tuple[Plan, Attempts, list[dict[str, Any]]]:
    attempts, reported = Attempts(example, outcomes), list[dict[str, Any]]()
    monkeypatch.setattr(planner, "attempt", attempts)
    monkeypatch.setattr(planner, "suggestions", lambda _: iter(()))
    task = with_overrides(task, {f"solver.{key}": value for key, value in solver.items()})
    return planner.plan(task, retrying=lambda changes, _: reported.append(dict(changes))), attempts, reported


def test_a_solved_task_is_tried_once(monkeypatch: pytest.MonkeyPatch, short_task: Task, short_plan: Plan) -> None:
    """Nothing is tried after success."""
    planned, attempts, reported = _planned(monkeypatch, short_task, short_plan, ["solved"])
    assert planned.status.solved and attempts.tasks == [short_task] and reported == []
    assert [(one.changes, one.solved) for one in planned.statistics.attempts] == [({}, True)]


def test_the_first_solved_fallback_is_kept(monkeypatch: pytest.MonkeyPatch, short_task: Task, short_plan: Plan) -> None:
    """Fallbacks come in the order of their table and are reported before they are tried."""
    planned, attempts, reported = _planned(
        monkeypatch, short_task, short_plan, ["converged", "infeasible", "solved"], retries=5
    )
    assert planned.status.message == "solved 3" and len(attempts.tasks) == 3
    assert reported == [FALLBACKS[0](short_task), FALLBACKS[1](short_task)]
    assert [one.message for one in planned.statistics.attempts] == ["converged 1", "infeasible 2", "solved 3"]
    assert [one.kept for one in planned.statistics.attempts] == [False, False, True]
    assert [one.changes for one in planned.statistics.attempts] == [
        {},
        FALLBACKS[0](short_task),
        FALLBACKS[1](short_task),
    ]


@pytest.mark.parametrize("retries", [0, 1, 3])
def test_without_success_the_first_attempt_is_kept(
    monkeypatch: pytest.MonkeyPatch, short_task: Task, short_plan: Plan, retries: int
) -> None:
    """As many fallbacks as the task allows, then the plan of the task as written."""
    planned, attempts, _ = _planned(monkeypatch, short_task, short_plan, ["infeasible"] * 6, retries=retries)
    assert len(attempts.tasks) == 1 + retries
    assert not planned.status.solved and planned.status.message == "infeasible 1"
    assert [one.kept for one in planned.statistics.attempts] == [True] + retries * [False]


def test_after_all_fallbacks_a_motion_near_the_goal_is_looked_for(
    monkeypatch: pytest.MonkeyPatch, short_task: Task, short_plan: Plan
) -> None:
    """The last attempt is for a soft goal; what only misses the goal is kept before the task as written."""
    firm = with_overrides(short_task, {"goal.soft": False})
    outcomes = ["infeasible", "infeasible", "converged"]
    missing = short_plan.model_copy(
        update={"audit": short_plan.audit.model_copy(update={"violations": ["max_goal_violation"]})}
    )
    planned, attempts, reported = _planned(monkeypatch, firm, missing, outcomes, retries=1)
    assert [task.goal.soft for task in attempts.tasks] == [False, False, True]
    assert reported == [FALLBACKS[0](firm), SOFT_GOAL]
    assert planned.status.message == "converged 3" and not planned.status.solved
    assert [one.kept for one in planned.statistics.attempts] == [False, False, True]
    coarse = missing.model_copy(
        update={"audit": missing.audit.model_copy(update={"violations": ["min_gap", "max_goal_violation"]})}
    )
    assert _planned(monkeypatch, firm, coarse, outcomes, retries=1)[0].status.message == "infeasible 1"
    assert len(_planned(monkeypatch, firm, missing, ["infeasible"], retries=0)[1].tasks) == 1, (
        "no retries, no soft goal"
    )


@pytest.mark.parametrize(
    ("goal", "hard_goal"),
    [
        ("{configuration: {root_x: 0.1}}", True),
        ("{velocity: {root_x: 0.1}}", True),
        ("{frames: {foot: {position: {x: 0.1}}}}", True),
        ("{configuration: {root_x: 0.1}, soft: true}", False),
        ("{periodic: {stride: {root_x: 0.1}}}", False),
        ("{}", False),
    ],
)
def test_goals_that_can_be_missed(load_short: Callable[..., Task], goal: str, hard_goal: bool) -> None:
    """A soft goal, a period and no goal at all are no reason for a last attempt."""
    assert has_hard_goal(load_short(f"goal={goal}", "costs={}")) == hard_goal


@pytest.mark.parametrize("end", ["interrupted", "time limit"])
def test_an_interrupt_and_the_time_limit_end_all_attempts(
    monkeypatch: pytest.MonkeyPatch, short_task: Task, short_plan: Plan, end: str
) -> None:
    """Neither is a reason to try again."""
    _, attempts, _ = _planned(monkeypatch, short_task, short_plan, ["infeasible", end, "solved"])
    assert len(attempts.tasks) == 2


def test_the_time_limit_is_for_all_attempts(
    monkeypatch: pytest.MonkeyPatch, short_task: Task, short_plan: Plan
) -> None:
    """What earlier attempts took is gone, and the limit is no change that an attempt is named by."""
    planned, attempts, reported = _planned(
        monkeypatch, short_task, short_plan, ["infeasible", "solved"], time_limit=50.0
    )
    assert 49 < attempts.seconds[1] < attempts.seconds[0] <= 50
    assert [one.solver.time_limit for one in attempts.tasks] == [50.0, 50.0]
    assert reported == [FALLBACKS[0](short_task)]
    assert planned.task["solver"]["time_limit"] == short_plan.task["solver"]["time_limit"]


def test_no_attempt_begins_after_the_time_limit(
    monkeypatch: pytest.MonkeyPatch, short_task: Task, short_plan: Plan
) -> None:
    """The first is made, however short the time; equations of another are not even built when it is over."""
    _, attempts, reported = _planned(monkeypatch, short_task, short_plan, ["infeasible", "solved"], time_limit=1e-9)
    assert len(attempts.tasks) == 1 and reported == []


def test_attempts_are_written_down(
    monkeypatch: pytest.MonkeyPatch, short_task: Task, short_plan: Plan, tmp_path: Path
) -> None:
    """They survive the file and stand in the report; a single attempt takes no room there."""
    planned, _, _ = _planned(monkeypatch, short_task, short_plan, ["infeasible", "solved"])
    write_plan(planned, tmp_path / "run")
    assert read_plan(tmp_path / "run").statistics.attempts == planned.statistics.attempts
    text = report(planned)
    assert "### Attempts" in text and "method.stages = 3" in text and "infeasible 1" in text
    assert "### Attempts" not in report(short_plan)
