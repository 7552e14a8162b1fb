"""The program `fesd-robot`."""

from __future__ import annotations

import contextlib
import os
import sys

from fesd_robot.cli.exits import ExitCode
from fesd_robot.cli.streams import set_up_streams


def main() -> None:
    """Run the program with the arguments of the process.

    After an interrupt the process is left at once: where the interrupt came while Python executed a string, as it does
    for every dataclass that it imports, it would end itself by the signal, although the exception was caught.
    """
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
