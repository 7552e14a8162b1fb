"""Time limits: when they begin, and what they end."""

from __future__ import annotations

import math
import threading

import pytest

from fesd_robot.running import Deadline, OutOfTime, check_time, held_deadline, held_to, seconds_to_wait


def test_seconds_that_have_passed_count() -> None:
    """A limit of ten seconds of which four are over leaves six."""
    deadline = Deadline(10.0, spent=4.0)
    assert deadline.left == pytest.approx(6.0, abs=0.5) and deadline.spent == pytest.approx(4.0, abs=0.5)


@pytest.mark.parametrize(("limit", "spent", "seconds"), [(10.0, 4.0, 7.0), (10.0, 99.0, 1.0), (100.0, 120.0, 5.0)])
def test_grace_is_a_second_or_a_twentieth(limit: float, spent: float, seconds: float) -> None:
    """It begins at the limit, or where that is over, now."""
    assert Deadline(limit, spent=spent).with_grace.left == pytest.approx(seconds, abs=0.5)


@pytest.mark.parametrize(("limit", "left"), [(10.0, 5.5), (100.0, 95.0), (1.0, -3.05)])
def test_a_command_keeps_time_to_write(limit: float, left: float) -> None:
    """A twentieth of its limit, at most a second; what passed before counts."""
    assert Deadline.of_command(limit, spent=4.0).left == pytest.approx(left, abs=0.5)
    assert Deadline.of_command(None, spent=4.0).remaining() is None


def test_without_a_limit_nothing_ends() -> None:
    """Neither in a block that is held to none, nor outside of any."""
    check_time()
    with held_to(Deadline()):
        check_time()
        assert Deadline().with_grace.remaining() is None
        assert math.isinf(seconds_to_wait()) and seconds_to_wait(3.0) == 3.0


def test_long_work_ends_in_its_block_alone() -> None:
    """The innermost block counts, and other threads are not held to it."""
    ended: list[bool] = []

    def elsewhere() -> None:
        check_time()
        ended.append(True)

    with held_to(Deadline(0.0)):
        with pytest.raises(OutOfTime):
            check_time()
        assert seconds_to_wait(3.0) == 0.0
        with held_to(Deadline()):
            check_time()
        thread = threading.Thread(target=elsewhere)
        thread.start()
        thread.join()
        assert ended == [True] and held_deadline() is not None
    assert held_deadline() is None
