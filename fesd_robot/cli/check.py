"""`fesd-robot check`."""

from __future__ import annotations

import typer

from fesd_robot.cli.arguments import Overrides, TaskFile


def check(task: TaskFile, overrides: Overrides = None) -> None:
    """Explain what a task asks for, and find mistakes.

    Reads the robot and builds the problem, but solves nothing and writes nothing.
    """
    from fesd_robot.cli.explanation import explanation
    from fesd_robot.fesd import Transcription
    from fesd_robot.ocp import formulate
    from fesd_robot.task import load_task

    motion = formulate(load_task(task, overrides or []))
    typer.echo(explanation(motion, Transcription(motion.ocp, motion.fesd).problem))
