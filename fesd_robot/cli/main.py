"""The program `fesd-robot`."""

from __future__ import annotations

import sys


def main() -> None:
    """Run the program with the arguments of the process."""
    try:
        from fesd_robot.cli.app import app

        app(prog_name="fesd-robot")
    except KeyboardInterrupt:
        sys.exit(130)
