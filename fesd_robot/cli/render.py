"""`fesd-robot render`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fesd_robot.cli.arguments import PlanFile


def render(
    plan: PlanFile,
    other: Annotated[
        Path | None,
        typer.Argument(
            metavar="[OTHER]",
            help="Another plan, drawn as a ghost beside the first in comparison.html.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Folder for page and figures; default: that of the plan."),
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Option(
            "--folder",
            metavar="DIR",
            help="Where relative paths in the task start; default: the folder of the task file when it was planned.",
            exists=True,
            file_okay=False,
        ),
    ] = None,
    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="output.KEY=VALUE",
            help="How figures are written: output.figure_formats=[png, svg, pdf], output.figure_width=one_column or "
            "two_columns, output.animation=true for a GIF, output.figures=false for none; may be given several times.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Draw the page and the figures of a plan again, or two plans in one page.

    Needs the files that the task names: the robot's model, and the file of a height map.
    """
    from fesd_robot.actions import render_comparison, render_plan
    from fesd_robot.errors import FesdRobotError, PlanFileError, TaskError
    from fesd_robot.plans import FIGURES_FOLDER, read_plan

    target = (plan if plan.is_dir() else plan.parent) if out is None else out
    try:
        if other is not None:
            second = read_plan(other)
            page = render_comparison(read_plan(plan), second, target, task_folder=folder, other_folder=folder)
            typer.echo(f"written to {target}: {page.name}, {second.name} is the ghost")
            return
        page, *figures = render_plan(read_plan(plan), target, task_folder=folder, overrides=overrides or [])
    except PlanFileError:
        raise
    except FesdRobotError as error:
        if not isinstance(error, TaskError):
            raise PlanFileError(f"{plan if other is None else f'{plan}, {other}'}: cannot be drawn: {error}") from error
        if "--set" in str(error) or "output" in (error.key or ""):
            raise
        hint = "" if folder else "; if the task's files have moved, say where by --folder"
        raise PlanFileError(
            f"{plan if other is None else f'{plan}, {other}'}: its task cannot be drawn again: {error}{hint}"
        ) from error
    typer.echo(f"written to {target}: {page.name}, {FIGURES_FOLDER}/ ({len(figures)} files)")
