"""`fesd-robot check`."""

from __future__ import annotations

import typer

from fesd_robot.cli.arguments import Overrides, Page, TaskFile


def check(task: TaskFile, overrides: Overrides = None, page: Page = None) -> None:
    """Explain what a task asks for, and find mistakes.

    Reads the robot and builds the problem, but solves nothing, and writes nothing but the page that is asked for.
    """
    from fesd_robot.actions import draw_task, explain
    from fesd_robot.task import load_task

    loaded = load_task(task, overrides or [])
    typer.echo(explain(loaded))
    if page is not None:
        typer.echo(f"\nwritten to {draw_task(loaded, page)}")
