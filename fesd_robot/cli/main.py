"""The program `fesd-robot`."""

from __future__ import annotations

import contextlib
import os
import sys
import time

import psutil

from fesd_robot.cli.exits import ExitCode
from fesd_robot.cli.streams import set_up_streams

_LONGEST = 60.0
"""s; a start that took longer is none, as where the clock was set."""

_before: list[float] = []


def before_main() -> float:
    """Return how long the process ran before the program was called, s; zero where it is called from elsewhere."""
    return _before[0] if _before else 0.0


def _note_start() -> None:
    seconds = time.time() - psutil.Process().create_time()
    _before[:] = [seconds if 0.0 <= seconds <= _LONGEST else 0.0]


def main() -> None:
    """Run the program with the arguments of the process.

    After an interrupt the process is left at once: where the interrupt came while Python executed a string, as it does
    for every dataclass that it imports, it would end itself by the signal, although the exception was caught.
    """
    _note_start()
    set_up_streams()
    try:
        from fesd_robot.cli.app import app

        app(prog_name="fesd-robot")
    except (KeyboardInterrupt, SystemExit) as ended:
        if isinstance(ended, SystemExit) and ended.code != ExitCode.INTERRUPTED:
            raise
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):
                stream.flush()
        os._exit(ExitCode.INTERRUPTED)
