"""`fesd-robot report`."""

from __future__ import annotations

import typer

from fesd_robot.cli.arguments import PlanFile


def report(plan: PlanFile) -> None:
    """Print the report of a plan.

    Status, contacts, audit, cost and effort; as Markdown unless on a terminal.
    """
    from fesd_robot.plans import read_plan
    from fesd_robot.plans import report as report_text

    text = report_text(read_plan(plan))
    from rich.console import Console

    console = Console()
    if console.is_terminal:
        from rich.markdown import Markdown

        console.print(Markdown(text))
    else:
        typer.echo(text)
