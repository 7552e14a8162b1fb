"""What each effort costs and saves, over tasks."""

from __future__ import annotations

from scripts.results.effort import EFFORTS, HEADER, Spent, page_of, spent

DEAR, WRONG = Spent(3.0, 100, 30.0), Spent(0.5, 10, 1.0, "foot flies 0 times")


def rows(*tasks: list[Spent]) -> list[list[str]]:
    """Return the rows of tasks, of which each has one `Spent` an effort."""
    return [["task", *[cell for one in task for cell in one.cells()], "abc"] for task in tasks]


def test_a_motion_that_is_another_saves_nothing() -> None:
    """Costs and savings are ratios to the default, of motions that do what their tasks say on both sides."""
    text = page_of(rows([Spent(2.0, 400, 60.0), DEAR, WRONG], [Spent(2.0, 300, 60.0), DEAR, DEAR]), 1)
    lines = {line.split(" | ")[0].strip("| "): line.split(" | ")[2:] for line in text.splitlines() if " | " in line}
    assert lines["balanced"] == ["2 of 2", "0 %", "0 %", "1", "1 |"]
    assert lines["quick"] == ["2 of 2", "50 %", "50 %", "3.5", "2 |"]
    assert lines["best"] == ["1 of 2", "50 %", "50 %", "3", "2 |"]
    assert "0.5 ✗ | 10 | 1" in text


def test_a_plan_says_what_it_took() -> None:
    """A ball bat with little effort does what its task says, with the iterations of all its attempts."""
    found = spent("ball_bat", "quick")
    assert found.wrong == "" and 0 < found.iterations < 1000 and found.seconds > 0
    assert len(HEADER) == 2 + 3 * len(EFFORTS)
