"""A value that another process works out."""

from __future__ import annotations

import os
import time

from fesd_robot.errors import SolverError
from fesd_robot.running.background import InBackground

LONG = 20.0
"""s, more than anything here takes."""


def looked(background: InBackground[int], until: list[int]) -> None:
    """Look until something was handed over."""
    begin = time.monotonic()
    while not until and time.monotonic() - begin < LONG:
        background.look()
        time.sleep(0.01)


def test_a_value_comes_from_another_process_once() -> None:
    """It is handed over by a look, not before, and not again."""
    values: list[int] = []
    background = InBackground(os.getpid, values.append)
    time.sleep(0.2)
    assert values == []
    looked(background, values)
    background.look()
    background.end()
    assert len(values) == 1 and values[0] != os.getpid()


def test_what_fails_or_is_ended_hands_over_nothing() -> None:
    """An error of ours there is no error here, and the end does not wait."""
    values: list[int] = []

    def fails() -> int:
        raise SolverError("no")

    background = InBackground(fails, values.append)
    begin = time.monotonic()
    while background._value is not None and time.monotonic() - begin < LONG:
        background.look()
    background.end()
    slow = InBackground(lambda: int(time.sleep(LONG) or 0), values.append)
    begin = time.monotonic()
    slow.end()
    slow.look()
    assert values == [] and time.monotonic() - begin < LONG / 2
