"""A task that is not solved is tried with fallback settings, each reported, the cheapest solved attempt kept."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fesd_robot import planner
from fesd_robot.plans import Plan, read_plan, write_plan
from fesd_robot.plans.report import report
from fesd_robot.strategies.fallbacks import FALLBACKS, with_overrides
from fesd_robot.task import Task, load_task

TASK = Path(__file__).parents[2] / "tasks" / "hopper_one_jump.yaml"


@pytest.fixture(scope="module")
def task() -> Task:
    return load_task(TASK)


def test_fallbacks_change_settings_only(task: Task) -> None:
    """Every fallback differs from the task in a key of its solver or method, and keeps what is asked for."""
    assert len(FALLBACKS) == 7
    for fallback in FALLBACKS:
        changes = fallback(task)
        other = with_overrides(task, changes)
        assert other != task and other.source_path == task.source_path
        for name in set(Task.model_fields) - {"solver", "method"}:
            assert getattr(other, name) == getattr(task, name)
        assert other.solver.tolerance == task.solver.tolerance
        for key, value in changes.items():
            section, last = key.split(".")
            assert getattr(getattr(other, section), last) == value != getattr(getattr(task, section), last)


class Attempts:
    """Stands in for a single attempt of the planner: outcomes in order, and the tasks that were tried."""

    def __init__(self, example: Plan, outcomes: list[str]) -> None:
        self.example, self.outcomes = example, outcomes
        self.tasks: list[Task] = []

    def __call__(self, task: Task, **_: Any) -> Plan:
        outcome = self.outcomes[len(self.tasks)]
        self.tasks.append(task)
        status = self.example.status.model_copy(
            update={"solved": outcome == "solved", "nlp": outcome, "message": f"{outcome} {len(self.tasks)}"}
        )
        return self.example.model_copy(update={"status": status})


def _planned(
    monkeypatch: pytest.MonkeyPatch, task: Task, example: Plan, outcomes: list[str], **solver: Any
) -> tuple[Plan, Attempts, list[dict[str, Any]]]:
    attempts, reported = Attempts(example, outcomes), list[dict[str, Any]]()
    monkeypatch.setattr(planner, "attempt", attempts)
    task = with_overrides(task, {f"solver.{key}": value for key, value in solver.items()})
    return planner.plan(task, retrying=lambda changes, _: reported.append(dict(changes))), attempts, reported


def test_a_solved_task_is_tried_once(monkeypatch: pytest.MonkeyPatch, task: Task, plan: Plan) -> None:
    """Nothing is tried after success."""
    found, attempts, reported = _planned(monkeypatch, task, plan, ["solved"])
    assert found.status.solved and attempts.tasks == [task] and reported == []
    assert [(one.changes, one.solved) for one in found.statistics.attempts] == [({}, True)]


def test_the_first_fallback_that_solves_is_kept(monkeypatch: pytest.MonkeyPatch, task: Task, plan: Plan) -> None:
    """Fallback settings come in their order and are reported before they are tried."""
    found, attempts, reported = _planned(monkeypatch, task, plan, ["converged", "infeasible", "solved"], retries=5)
    assert found.status.message == "solved 3" and len(attempts.tasks) == 3
    assert reported == [FALLBACKS[0](task), FALLBACKS[1](task)]
    assert [one.message for one in found.statistics.attempts] == ["converged 1", "infeasible 2", "solved 3"]
    assert [one.changes for one in found.statistics.attempts] == [{}, FALLBACKS[0](task), FALLBACKS[1](task)]


@pytest.mark.parametrize("retries", [0, 1, 3])
def test_without_success_the_first_attempt_is_kept(
    monkeypatch: pytest.MonkeyPatch, task: Task, plan: Plan, retries: int
) -> None:
    """As many fallback settings as the task allows, then the plan of the task as written."""
    found, attempts, _ = _planned(monkeypatch, task, plan, ["infeasible"] * 6, retries=retries)
    assert len(attempts.tasks) == 1 + retries
    assert not found.status.solved and found.status.message == "infeasible 1"
    assert len(found.statistics.attempts) == 1 + retries


@pytest.mark.parametrize("end", ["interrupted", "time limit"])
def test_an_interrupt_and_the_time_limit_end_all_attempts(
    monkeypatch: pytest.MonkeyPatch, task: Task, plan: Plan, end: str
) -> None:
    """Neither is a reason to try again."""
    _, attempts, _ = _planned(monkeypatch, task, plan, ["infeasible", end, "solved"])
    assert len(attempts.tasks) == 2


def test_the_time_limit_is_for_all_attempts(monkeypatch: pytest.MonkeyPatch, task: Task, plan: Plan) -> None:
    """What earlier attempts took is gone, and the limit is no change that an attempt is named by."""
    found, attempts, reported = _planned(monkeypatch, task, plan, ["infeasible", "solved"], time_limit=50.0)
    limits = [one.solver.time_limit for one in attempts.tasks]
    assert limits[0] and limits[1] and 49 < limits[1] < limits[0] <= 50
    assert reported == [FALLBACKS[0](task)]
    assert found.task["solver"]["time_limit"] == plan.task["solver"]["time_limit"]


def test_attempts_are_written_down(monkeypatch: pytest.MonkeyPatch, task: Task, plan: Plan, tmp_path: Path) -> None:
    """They survive the file and stand in the report; a single attempt takes no room there."""
    found, _, _ = _planned(monkeypatch, task, plan, ["infeasible", "solved"])
    write_plan(found, tmp_path / "run")
    assert read_plan(tmp_path / "run").statistics.attempts == found.statistics.attempts
    text = report(found)
    assert "### Attempts" in text and "solver.loose_iterations = 66" in text and "infeasible 1" in text
    assert "### Attempts" not in report(plan)
