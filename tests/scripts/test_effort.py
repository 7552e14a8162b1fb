"""What each effort costs and saves, over tasks."""

from __future__ import annotations

from typing import Any

from fesd_robot import load_task, plan
from fesd_robot.sweeps.planned import values_of
from scripts.results.effort import EFFORTS, HEADER, measure, page_of

DEAR, WRONG = (3.0, 100, 30.0, ""), (0.5, 10, 1.0, "foot flies 0 times")


def rows(task: str, *efforts: tuple[float, int, float, str]) -> list[dict[str, Any]]:
    """Return the rows of a task, of which each effort has a cost, iterations, seconds, and what is wrong."""
    names = ("cost", "iterations", "seconds", "wrong")
    known = {"task": task, "verdict": "solved", "program": "abc", "made": ""}
    return [
        {**known, "solver.effort": effort, **dict(zip(names, values, strict=True))}
        for effort, values in zip(EFFORTS, efforts, strict=True)
    ]


def test_a_motion_that_is_another_saves_nothing() -> None:
    """Costs and savings are ratios to the default, of motions that do what their tasks say on both sides."""
    first = rows("ball_bat", (2.0, 400, 60.0, ""), DEAR, WRONG)
    text = page_of([*first, *rows("block_push", (2.0, 300, 60.0, ""), DEAR, DEAR)])
    lines = {line.split(" | ")[0].strip("| "): line.split(" | ")[1:] for line in text.splitlines() if " | " in line}
    assert lines["balanced"] == ["2 of 2", "0 %", "0 %", "1", "1 |"]
    assert lines["quick"] == ["2 of 2", "50 %", "50 %", "3.5", "2 |"]
    assert lines["best"] == ["1 of 2", "50 %", "50 %", "3", "2 |"]
    assert "0.5 ✗ | 10 | 1" in text and "abc, older" in text


def test_a_plan_says_what_it_took() -> None:
    """A ball bat with little effort does what its task says, with the iterations of all its attempts."""
    made = plan(load_task("tasks/ball_bat.yaml", ["solver.effort=quick"]))
    assert measure(made) == {"wrong": ""}
    assert 0 < values_of(made)["iterations"] < 1000
    assert len(HEADER) == 2 + 3 * len(EFFORTS)
