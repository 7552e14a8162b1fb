"""A task that is not solved is tried with small changes of what it asks for, and its message says which one helps."""

from __future__ import annotations

from pathlib import Path

import pytest

from fesd_robot.ocp import formulate
from fesd_robot.planning import planner
from fesd_robot.planning.suggestions import HIGHER_LIMITS, MORE_TIME, suggestions
from fesd_robot.plans import Plan
from fesd_robot.task import Task, load_task

from .test_fallbacks import Attempts

TASKS = Path(__file__).parents[2] / "tasks"
JUMP = TASKS / "hopper_one_jump.yaml"


def test_more_time_keeps_waypoints_at_the_ends_of_intervals() -> None:
    """The longer task can be formulated; its waypoints keep their part of the duration."""
    task = load_task(TASKS / "solo12_jump.yaml")
    changes, longer = next(suggestions(task))
    assert changes == {"horizon.duration": 0.75} and longer.horizon.duration == MORE_TIME * task.horizon.duration
    for before, after in zip(task.waypoints, longer.waypoints, strict=True):
        assert before.time is not None and after.time == MORE_TIME * before.time
    formulate(longer)


@pytest.mark.parametrize(("name", "section"), [("hopper_one_jump", "robot"), ("solo12_jump", "limits")])
def test_limits_are_raised_where_the_task_has_them(name: str, section: str) -> None:
    """Of actuators or of joints; nothing else changes."""
    task = load_task(TASKS / f"{name}.yaml")
    _, (changes, stronger) = suggestions(task)
    assert changes == {"limits of controls in the task": "1.5 times as high"}
    assert [key for key in Task.model_fields if getattr(stronger, key) != getattr(task, key)] == [section]
    before, after = formulate(task).actuation, formulate(stronger).actuation
    assert after.upper == pytest.approx(HIGHER_LIMITS * before.upper)
    assert after.lower == pytest.approx(HIGHER_LIMITS * before.lower)


def test_limits_of_the_model_and_a_free_duration_stay() -> None:
    """What the planner chooses, or the model says, is no demand of the task."""
    task = load_task(TASKS / "wheel_hills.yaml", ["horizon.duration={lower: 1, upper: 3}"])
    assert list(suggestions(task)) == []


def test_an_actuator_may_leave_its_limits_to_the_model() -> None:
    """Those limits stay; the one that the task gives is raised, and where it gives none only more time is tried."""
    wheel = "robot.actuators.reaction_torque={type: joint, joint: root_pitch%s}"
    leg = "robot.actuators.leg_force={type: joint, joint: leg}"
    assert [list(each) for each, _ in suggestions(load_task(JUMP, [wheel % "", leg]))] == [["horizon.duration"]]
    _, (_, stronger) = suggestions(load_task(JUMP, [wheel % ", upper: 80", leg]))
    assert {name: (one.lower, one.upper) for name, one in (stronger.robot.actuators or {}).items()} == {
        "reaction_torque": (None, HIGHER_LIMITS * 80),
        "leg_force": (None, None),
    }
    formulate(stronger)


@pytest.mark.parametrize(
    ("outcomes", "said"),
    [
        (["infeasible", "infeasible", "solved"], "horizon.duration = 1.25"),
        (["infeasible", "infeasible", "infeasible", "solved"], "limits of controls in the task = 1.5 times as high"),
        (["infeasible"] * 4, ""),
        (["infeasible", "infeasible", "interrupted", "solved"], ""),
    ],
)
def test_the_message_says_what_was_tried_and_helps(
    monkeypatch: pytest.MonkeyPatch, short_plan: Plan, outcomes: list[str], said: str
) -> None:
    """After a retry without success the changes are tried one after the other; the plan stays that of the task."""
    attempts = Attempts(short_plan, outcomes)
    monkeypatch.setattr(planner, "attempt", attempts)
    monkeypatch.setattr(planner, "has_hard_goal", lambda _: False)
    task = load_task(TASKS / "hopper_one_jump.yaml", ["solver.retries=1", "method.grid=uniform"])
    reported: list[list[str]] = []
    planned = planner.plan(task, retrying=lambda changes, _: reported.append(list(changes)))
    assert reported[1:] == [["horizon.duration"], ["limits of controls in the task"]][: len(attempts.tasks) - 2]
    expected = f"infeasible 1 Tried, and solved: the same task with {said}." if said else "infeasible 1"
    assert planned.status.message == expected and not planned.status.solved
    assert len(planned.statistics.attempts) == 2
    assert [one.solver.effort for one in attempts.tasks[2:]] == ["quick"] * len(attempts.tasks[2:])
