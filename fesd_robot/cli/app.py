"""The commands of the program put together."""

from __future__ import annotations

from typing import Annotated

import typer

from fesd_robot import __version__
from fesd_robot.cli.check import check
from fesd_robot.cli.examples import examples
from fesd_robot.cli.export import ExportCommand, export
from fesd_robot.cli.group import CommandGroup
from fesd_robot.cli.improve import improve
from fesd_robot.cli.logs import set_up_logging
from fesd_robot.cli.new import new
from fesd_robot.cli.plan import plan
from fesd_robot.cli.refine import refine
from fesd_robot.cli.render import render
from fesd_robot.cli.replay import replay
from fesd_robot.cli.report import report
from fesd_robot.cli.robots import robots
from fesd_robot.cli.schema import schema
from fesd_robot.cli.simulate import simulate
from fesd_robot.cli.sweep import sweep

app = typer.Typer(
    name="fesd-robot",
    cls=CommandGroup,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"fesd-robot {__version__}")
        raise typer.Exit


@app.callback()
def program(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Say on stderr what is being done.")] = False,
) -> None:
    """Plan robot motion through contact, from a task file to a checked trajectory.

    Exit status: 0 solved, 2 bad input, 3 not solved (files still written, marked so), 130 interrupted.
    """
    set_up_logging(verbose)


for command in (
    plan, refine, improve, sweep, simulate, replay, check, report, render, export, examples, new, robots, schema,
):  # fmt: skip
    app.command(cls=ExportCommand if command is export else None)(command)
