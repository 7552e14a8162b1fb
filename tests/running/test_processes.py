"""Processes of our own."""

import os
import signal
import sys

import pytest

from fesd_robot.running.processes import ForkedPool

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


def test_values_come_from_the_function() -> None:
    """What the pool returns is the function's value of the argument."""
    pool = ForkedPool(1, abs, lambda: None)
    try:
        assert pool.submit(-2).result(timeout=60) == 2
    finally:
        pool.end()
