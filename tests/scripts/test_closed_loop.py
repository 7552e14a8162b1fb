"""What runs of the closed-loop table are pushed by, and what the page says of them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fesd_robot.contact import ContactMode
from scripts.results.closed_loop import ROWS, Row, around_take_off, page, plan_of, push_of


def loop(in_space: bool) -> Any:
    """Stands for a plan of 1 s that stands until 0.4 s and flies until 0.8 s."""
    time = np.linspace(0.0, 1.0, 101)
    modes = [ContactMode.FLIGHT if 0.4 <= t < 0.8 else ContactMode.STICK for t in time]
    plan = SimpleNamespace(contacts={"foot": SimpleNamespace(mode=modes)}, trajectory=SimpleNamespace(time=time))
    return SimpleNamespace(plan=plan, motion=SimpleNamespace(in_space=in_space), duration=1.0)


@pytest.mark.parametrize("in_space", [False, True])
def test_pushes_are_of_one_size(in_space: bool) -> None:
    """Each has a direction of its own, in the plane of the robot, the same every time; a row without has none."""
    row, own = Row("task", 0.3), loop(in_space)
    pushes = [push_of(row, own, number) for number in range(20)]
    assert pushes == [push_of(row, own, number) for number in range(20)]
    sizes, times = [np.linalg.norm(each.velocity) for each in pushes if each], [each.time for each in pushes if each]
    assert sizes == pytest.approx([0.3] * 20, abs=1e-5)
    assert min(times) >= 0.0 and max(times) <= 0.9 and len(set(times)) == 20
    assert any(each.velocity[1] for each in pushes if each) is in_space
    assert push_of(Row("task"), own, 0) is None


def test_before_and_after_take_off() -> None:
    """Even runs are pushed while the robot stands, odd ones while it flies."""
    times = [around_take_off(loop(True), number, np.random.default_rng(number)) for number in range(20)]
    assert all(0.0 <= each <= 0.4 for each in times[::2]) and all(0.4 <= each <= 0.8 for each in times[1::2])


def test_the_page() -> None:
    """A line for every row: how many arrive, ends, times in ms, shares."""
    runs = [{key: {"arrived": end < 0.05, "end": end} for key, end in (("lqr", 2.0), ("replan", end))}
            for end in (0.001, 0.003, 0.3)]  # fmt: skip
    row = {
        "row": "five-jumps", "task": "hopper_five_jumps", "different": ROWS["five-jumps-all"].in_words, "runs": runs,
        "period": 0.01, "feedback_seconds": [0.001, 0.002], "prepare_seconds": [0.003, 0.004], "exact_at_once": 0.5,
        "kept": 0.995, "machine": "a machine, 2 cores", "program": "abc",
    }  # fmt: skip
    text = page([row])
    assert "Machine 1: a machine, 2 cores.\n" in text
    assert text.splitlines()[-1] == (
        "| five-jumps | hopper_five_jumps | pushed by 0.3 m/s, mass +10 %, friction -20 % | 0 of 3 | 2 of 3 "
        "| 2000 / 2000 | 3 / 300 | 10 | 1.00 / 2.00 | 3.00 / 4.00 | 50.0 % | 99.5 % | 1 | abc |"
    )


def test_a_plan_that_is_not_there(tmp_path: Any) -> None:
    """Folders are looked into, and below them."""
    assert plan_of("hopper_one_jump", [tmp_path]) is None
