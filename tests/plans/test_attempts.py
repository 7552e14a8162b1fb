"""Which of several attempts a plan is of, and that everything that tells of it says the same."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fesd_robot.cli.summary import summary
from fesd_robot.planning import planner
from fesd_robot.plans import Plan, read_plan, report, write_plan
from fesd_robot.plans.plan import Attempt
from fesd_robot.task import Task, load_task

TASK = Path(__file__).parents[2] / "tasks" / "published_hopper_one_jump.yaml"


def attempt(seed: int, solved: bool, objective: float, kept: bool = False) -> Attempt:
    return Attempt(
        changes={"solver.seed": seed},
        kept=kept,
        solved=solved,
        objective=objective,
        iterations=10,
        seconds=1.0,
        message="",
    )


def of_attempts(plan: Plan, *attempts: Attempt) -> Plan:
    return plan.model_copy(update={"statistics": plan.statistics.model_copy(update={"attempts": list(attempts)})})


def test_the_planner_marks_the_solved_attempt(plan: Plan, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The second attempt is solved: it is the plan, and summary and report name it, not the cheaper one before."""
    costs = {2: 1.0, 3: 2.0}

    def attempted(task: Task, **_: Any) -> Plan:
        stages = task.method.stages
        status = plan.status.model_copy(
            update={"solved": stages == 3, "nlp": "infeasible", "message": f"{stages} stages"}
        )
        statistics = plan.statistics.model_copy(update={"objective": costs[stages]})
        return plan.model_copy(update={"status": status, "statistics": statistics})

    monkeypatch.setattr(planner, "attempt", attempted)
    result = planner.plan(load_task(TASK))
    assert result.status.message == "3 stages"
    assert [one.kept for one in result.statistics.attempts] == [False, True]
    again = read_plan(write_plan(result, tmp_path / "run"))
    assert again.statistics.kept_attempt == again.statistics.attempts[1]
    (line,) = [one for one in summary(again, tmp_path / "run", tmp_path / "run") if "attempts" in one]
    assert line.startswith("2 attempts in ") and line.endswith(": solved with method.stages = 3")
    rows = [line.split(" | ") for line in report(again).splitlines() if line.startswith(("| as written", "| method."))]
    assert [row[2] for row in rows] == ["no", "yes"]


def test_plans_that_do_not_say_it_are_of_the_cheapest(plan: Plan) -> None:
    """Where no attempt is marked the rule of old plans holds: the cheapest solved one, else the first."""
    dear, cheap, failed = attempt(0, True, 3.0), attempt(1, True, 2.0), attempt(2, False, 1.0)
    assert of_attempts(plan, dear, cheap, failed).statistics.kept_attempt == cheap
    assert of_attempts(plan, failed, attempt(3, False, 0.5)).statistics.kept_attempt == failed
    assert of_attempts(plan).statistics.kept_attempt is None


def test_an_attempt_that_is_marked_is_taken(plan: Plan, tmp_path: Path) -> None:
    """What the planner marked decides, whatever it cost; unsolved attempts are named as such."""
    failed = attempt(2, False, 1.0, kept=True)
    unsolved = of_attempts(plan, attempt(0, False, 0.5), failed)
    assert unsolved.statistics.kept_attempt is failed
    (line,) = [line for line in summary(unsolved, tmp_path, tmp_path) if "attempts" in line]
    assert line.endswith("none solved, kept is that with solver.seed = 2")
