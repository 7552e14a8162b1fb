"""Ctrl-C before, during and after the solve, on the real program and on the object that takes it."""

from __future__ import annotations

import contextlib
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fesd_robot.cli.interrupts import Interrupts
from fesd_robot.plans import read_plan

PAUSE = 0.7
"""s into the solve."""


def test_one_interrupt_writes_the_best_iterate(start: Callable[..., Any], task: Path, tmp_path: Path) -> None:
    """During the solve Ctrl-C stops it; its best iterate is written, marked as interrupted; exit status 130."""
    running = start("-v", "plan", task, "--out", "out", "--set", "output.figures=false")
    running.wait_for("the solver is running")
    time.sleep(PAUSE)
    running.interrupt()
    outcome = running.finish()
    assert outcome.code == 130
    assert "interrupted: stopping with the best iterate" in outcome.err and "Traceback" not in outcome.err
    plan = read_plan(tmp_path / "out")
    assert (plan.status.solved, plan.status.nlp) == (False, "interrupted")
    assert (tmp_path / "out" / "plan.html").is_file()
    assert "Not solved: interrupted" in outcome.out


def test_a_second_interrupt_aborts_at_once(start: Callable[..., Any], task: Path, tmp_path: Path) -> None:
    """Two interrupts end the program without files; exit status 130."""
    running = start("-v", "plan", task, "--out", "out")
    running.wait_for("the solver is running")
    time.sleep(PAUSE)
    running.interrupt()
    running.wait_for("interrupt again to abort at once")
    running.interrupt()
    outcome = running.finish()
    assert outcome.code == 130 and "Traceback" not in outcome.err
    assert not list(tmp_path.iterdir())


def test_an_interrupt_before_the_solve_leaves_nothing(start: Callable[..., Any], task: Path, tmp_path: Path) -> None:
    """While the problem is built there is no iterate to write; exit status 130."""
    running = start("-v", "plan", task, "--out", "out")
    running.wait_for("building the problem")
    running.interrupt()
    outcome = running.finish()
    assert outcome.code == 130 and "Traceback" not in outcome.err
    assert not list(tmp_path.iterdir())


def test_an_interrupt_while_drawing_keeps_the_plan(
    start: Callable[..., Any], task: Path, small: list[str], tmp_path: Path
) -> None:
    """While figures are drawn Ctrl-C leaves them out: the plan takes the place of the earlier one, whole, with what was
    drawn before, and without what an earlier run drew; exit status 130."""
    earlier = start("plan", task, "--out", "out", *small)
    assert earlier.finish().code == 0
    settings = [*small, "--set", "output.figures=true", "--set", "output.page=true", "--set", "solver.seed=2"]
    running = start("-v", "plan", task, "--out", "out", *settings)
    running.wait_for("writing figures")
    running.interrupt()
    outcome = running.finish()
    assert outcome.code == 130 and "Traceback" not in outcome.err
    assert "interrupted: what was not drawn yet is left out; fesd-robot render" in outcome.err
    plan = read_plan(tmp_path / "out")
    assert plan.status.solved and plan.task["solver"]["seed"] == 2
    assert (tmp_path / "out" / "plan.html").is_file() and not (tmp_path / "out" / "figures").exists()
    assert [file.name for file in tmp_path.iterdir()] == ["out"]


def test_an_interrupt_in_an_import_has_its_exit_status(tmp_path: Path) -> None:
    """Python would end itself by the signal after an exception that came out of a string, as those of dataclasses."""
    (tmp_path / "program.py").write_text(
        "import fesd_robot.cli.app as app\n"
        "from fesd_robot.cli.main import main\n"
        "app.app = lambda prog_name: exec('raise KeyboardInterrupt')\n"
        "main()",
        encoding="utf-8",
    )
    assert subprocess.run([sys.executable, "-m", "program"], cwd=tmp_path, timeout=60).returncode == 130


@pytest.fixture
def calls() -> list[str]:
    """What the object called."""
    return []


@pytest.fixture
def interrupts(python_interrupts: None, calls: list[str]) -> Interrupts:
    """An object that notes its calls."""
    return Interrupts(on_request=lambda: calls.append("request"), on_abort=lambda: calls.append("abort"))


def test_the_handler_is_given_back(interrupts: Interrupts) -> None:
    """After the block SIGINT is handled as before it, and no wakeup descriptor is left."""
    before = signal.getsignal(signal.SIGINT)
    with interrupts:
        assert signal.getsignal(signal.SIGINT) != before
    assert signal.getsignal(signal.SIGINT) == before
    assert signal.set_wakeup_fd(-1) == -1


def test_an_ignored_interrupt_stays_ignored(interrupts: Interrupts, calls: list[str]) -> None:
    """A program started with nohup or in the background of a script runs to its end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with interrupts:
        interrupts.solving()
        signal.raise_signal(signal.SIGINT)
        assert not interrupts.stop and not interrupts.received
    assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN
    assert not calls


def test_outside_the_solve_an_interrupt_raises(interrupts: Interrupts, calls: list[str]) -> None:
    """An interrupt is the usual KeyboardInterrupt as long as no solver runs."""
    with pytest.raises(KeyboardInterrupt), interrupts:
        signal.raise_signal(signal.SIGINT)
    assert not calls


def test_during_the_solve_an_interrupt_is_a_request(interrupts: Interrupts, calls: list[str]) -> None:
    """The solver is asked to stop, and the object says so once."""
    with interrupts:
        assert interrupts.solving() and not interrupts.solving()
        signal.raise_signal(signal.SIGINT)
        assert interrupts.stop and interrupts.received
        interrupts.solved()
    assert calls in (["request"], [])  # the note comes from another thread, which may be too late


def test_an_interrupt_that_a_library_swallows_is_raised_again(interrupts: Interrupts) -> None:
    """An exception lost inside CasADi makes the solver stop and comes back after it."""
    with pytest.raises(KeyboardInterrupt), interrupts:
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        interrupts.solving()
        assert interrupts.stop
        interrupts.solved()
        raise AssertionError("not reached")


def test_an_interrupt_that_a_library_turns_into_an_error_is_raised_again(interrupts: Interrupts) -> None:
    """Whatever a library makes of it, the user sees an interrupt."""
    with pytest.raises(KeyboardInterrupt), interrupts:
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt as error:
            raise RuntimeError("something failed") from error


def test_a_plan_is_written_before_an_interrupt_counts(interrupts: Interrupts) -> None:
    """Once there is a plan an interrupt is noted, and pictures that are not begun yet are not begun."""
    with interrupts:
        interrupts.solved()
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt), interrupts.drawing():
            raise AssertionError("not reached")
        interrupts.written()
        assert interrupts.received and not interrupts.stop


def test_an_interrupt_ends_a_drawing_once(interrupts: Interrupts) -> None:
    """While pictures are drawn it raises; after that files are written."""
    with interrupts:
        interrupts.solved()
        with pytest.raises(KeyboardInterrupt), interrupts.drawing():
            signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        interrupts.written()
        assert interrupts.received and not interrupts.stop
