"""The one place where an exception becomes a message and an exit status."""

from __future__ import annotations

from typing import Any

import typer
from typer.core import TyperGroup

from fesd_robot.cli.exits import ExitCode
from fesd_robot.errors import FesdRobotError
from fesd_robot.printable import visible


class CommandGroup(TyperGroup):
    """The commands of the program; a `FesdRobotError` in any of them is one message on stderr, without traceback."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command that was asked for."""
        try:
            return super().invoke(ctx)
        except FesdRobotError as error:
            typer.echo(f"error: {visible(str(error), lines=True)}", err=True)
            raise typer.Exit(ExitCode.BAD_INPUT) from error
        except KeyboardInterrupt as error:
            typer.echo("interrupted", err=True)
            raise typer.Exit(ExitCode.INTERRUPTED) from error
