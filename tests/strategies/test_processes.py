"""Processes of our own."""

import os
import signal
import sys
from functools import partial
from pathlib import Path

import pytest

from fesd_robot.strategies.processes import ForkedPool, cores_for, share_cores
from fesd_robot.strategies.shared import SharedCores
from fesd_robot.task import load_task

TASK = Path(__file__).parents[2] / "tasks" / "published_hopper_one_jump.yaml"

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux can fork a process safely")

_interrupting = False


def _interrupt() -> None:
    if _interrupting:
        signal.raise_signal(signal.SIGINT)


os.register_at_fork(after_in_parent=_interrupt)


@pytest.mark.usefixtures("python_interrupts")
def test_an_interrupt_while_processes_are_forked_is_not_lost(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """A Ctrl-C between fork and return ends the call with KeyboardInterrupt, and Python prints nothing about it."""
    pool = ForkedPool(1, abs, lambda: None)
    monkeypatch.setattr(sys.modules[__name__], "_interrupting", True)
    try:
        with pytest.raises(KeyboardInterrupt):
            pool.submit(-1)
    finally:
        monkeypatch.undo()
        pool.end()
    assert "Traceback" not in capfd.readouterr().err


def test_those_that_work_divide_the_cores() -> None:
    """Each has its even share of those that work just then, at least one, also of those that are forked later."""
    cores = SharedCores(4)
    shares = [cores.share]
    with cores.working():
        shares.append(cores.share)
        with cores.working(), cores.working():
            shares.append(cores.share)
            with cores.working(), cores.working():
                shares.append(cores.share)
        pool = ForkedPool(1, lambda _: cores_of(cores), partial(share_cores, cores))
        try:
            shares.append(pool.submit(0).result(timeout=60))
        finally:
            pool.end()
    assert [*shares, cores.share] == [4, 4, 1, 1, 2, 4]


def cores_of(cores: SharedCores) -> int:
    """Return the share of one more that works."""
    with cores.working():
        return cores_for(load_task(TASK)).share


def test_values_come_from_the_function() -> None:
    """What the pool returns is the function's value of the argument."""
    pool = ForkedPool(1, abs, lambda: None)
    try:
        assert pool.submit(-2).result(timeout=60) == 2
    finally:
        pool.end()
