"""A task that is real but solved in a second, and the program run on it, in this process or in its own."""

from __future__ import annotations

import logging
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import pytest

from fesd_robot.running.activities import Activity

ROOT = Path(__file__).parents[2]
ONE_JUMP = ROOT / "tasks" / "published_hopper_one_jump.yaml"

SMALL = (
    "horizon.duration=0.2",
    "horizon.intervals=2",
    "reference={type: line}",
    "goal.configuration.root_x=0.1",
    "solver.tolerance=1e-6",
)
"""Standing still for 0.2 s instead of a jump."""

BARE = ("output.page=false", "output.figures=false")


class Outcome(NamedTuple):
    """What a run of the program left behind: exit status and what it printed."""

    code: int
    out: str
    err: str

    @property
    def sentences(self) -> str:
        """What it printed, with every sentence in one line."""
        return re.sub(r"\n {4}(?=\S)", " ", self.out)

    @property
    def said(self) -> str:
        """What it printed but for the lines that it is at work, before it looks for a motion."""
        before = (Activity.READING.value, Activity.BUILDING.value)
        return "".join(line for line in self.out.splitlines(keepends=True) if not line.rstrip().endswith(before))


TERMINAL_VARIABLES = ("FORCE_COLOR", "TTY_COMPATIBLE")
"""What makes rich take a pipe for a terminal."""

Run = Callable[..., Outcome]


def settings(values: Sequence[str]) -> list[str]:
    """Return ``--set`` before every value."""
    return [word for value in values for word in ("--set", value)]


@pytest.fixture
def small() -> list[str]:
    """Arguments that make the task a small one and leave out page and figures."""
    return settings([*SMALL, *BARE])


@pytest.fixture
def task() -> Path:
    """The task file of the one jump."""
    return ONE_JUMP


@pytest.fixture
def task_text() -> str:
    """The text of the one jump with a model path that holds anywhere."""
    return ONE_JUMP.read_text(encoding="utf-8").replace("../models", str(ROOT / "models"))


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Iterator[Run]:
    """Run the program's entry point in an empty folder, `tmp_path / 'work'`."""
    from fesd_robot.cli.main import main

    folder = tmp_path / "work"
    folder.mkdir()
    monkeypatch.chdir(folder)
    for variable in TERMINAL_VARIABLES:
        monkeypatch.delenv(variable, raising=False)
    logger = logging.getLogger("fesd_robot")
    level, handlers = logger.level, list(logger.handlers)

    def run_program(*arguments: str | Path) -> Outcome:
        monkeypatch.setattr(sys, "argv", ["fesd-robot", *map(str, arguments)])
        capfd.readouterr()
        with pytest.raises(SystemExit) as caught:
            main()
        code = caught.value.code
        assert isinstance(code, int)
        return Outcome(code, *capfd.readouterr())

    yield run_program
    logger.setLevel(level)
    logger.handlers[:] = handlers


class Finished(NamedTuple):
    """A finished run with all files."""

    folder: Path
    outcome: Outcome


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    """The small task planned once by the program in its own process, with page and figures."""
    folder = tmp_path_factory.mktemp("finished")
    done = subprocess.run(command("plan", ONE_JUMP, *settings(SMALL)), cwd=folder, env=environment(), **PIPES)
    return Finished(folder / "runs" / "published_hopper_one_jump", Outcome(done.returncode, done.stdout, done.stderr))


PIPES = {"capture_output": True, "text": True, "timeout": 120}


def command(*arguments: str | Path) -> list[str]:
    """Return the command line of the program."""
    return [sys.executable, "-m", "fesd_robot.cli", *map(str, arguments)]


def environment() -> dict[str, str]:
    """Return an environment in which the program prints plainly and takes one core."""
    kept = {name: value for name, value in os.environ.items() if name not in TERMINAL_VARIABLES}
    return {**kept, "OMP_NUM_THREADS": "1", "TERM": "dumb"}


class Running:
    """The program in its own process, watched through what it says on stderr."""

    def __init__(self, *arguments: str | Path, cwd: Path) -> None:
        self._process = subprocess.Popen(
            command(*arguments),
            cwd=cwd,
            env=environment(),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            # A shell may have started the tests with interrupts ignored, which processes inherit.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        self._said = ""

    def wait_for(self, words: str) -> None:
        """Read stderr until a line contains `words`."""
        assert self._process.stderr is not None
        for line in self._process.stderr:
            self._said += line
            if words in line:
                return
        raise AssertionError(f"the program ended without saying {words!r}, but:\n{self._said}")

    def interrupt(self) -> None:
        """Send what Ctrl-C sends."""
        self._process.send_signal(signal.SIGINT)

    def finish(self) -> Outcome:
        """Wait for the end."""
        out, err = self._process.communicate(timeout=120)
        return Outcome(self._process.returncode, out, self._said + err)

    def kill(self) -> None:
        """End it whatever it does."""
        self._process.kill()
        self._process.communicate()


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Running]]:
    """Start the program in `tmp_path`."""
    started: list[Running] = []

    def start_program(*arguments: str | Path) -> Running:
        started.append(Running(*arguments, cwd=tmp_path))
        return started[-1]

    yield start_program
    for running in started:
        running.kill()
