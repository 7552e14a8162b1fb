"""A value that another process works out."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from fesd_robot.errors import SolverError
from fesd_robot.running.background import InBackground, in_other_process

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


def test_work_is_done_by_another_process(tmp_path: Path) -> None:
    """It is done once, elsewhere, when the block has ended."""
    file = tmp_path / "who"
    with in_other_process(lambda: _append(file)):
        pass
    (who,) = file.read_text(encoding="utf-8").split()
    assert int(who) != os.getpid()


def test_work_that_fails_elsewhere_is_done_here(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Nothing is printed about the first try, and an error of the second is an error here."""
    file, here = tmp_path / "who", os.getpid()

    def work() -> None:
        _append(file)
        if os.getpid() != here:
            raise SolverError("elsewhere")

    with in_other_process(work):
        pass
    there, again = map(int, file.read_text(encoding="utf-8").split())
    assert there != here and again == here
    with pytest.raises(ZeroDivisionError), in_other_process(lambda: 1 // 0):
        pass
    assert "Traceback" not in capfd.readouterr().err


def test_a_block_that_fails_does_not_wait() -> None:
    """The other process ends with the block, and its work is not done here."""
    begin = time.monotonic()
    with pytest.raises(SolverError), in_other_process(lambda: time.sleep(LONG)):
        raise SolverError("no")
    assert time.monotonic() - begin < LONG / 2


def _append(file: Path) -> None:
    with file.open("a", encoding="utf-8") as lines:
        lines.write(f"{os.getpid()}\n")
