"""`fesd-robot check`."""

from __future__ import annotations

import typer

from fesd_robot.cli.arguments import Overrides, TaskFile


def check(task: TaskFile, overrides: Overrides = None) -> None:
    """Explain what a task asks for, and find mistakes.

    Reads the robot and builds the problem, but solves nothing and writes nothing.
    """
    from fesd_robot.actions import explain
    from fesd_robot.task import load_task

    typer.echo(explain(load_task(task, overrides or [])))
