"""`fesd-robot new`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Literal

import typer


def new(
    robot: Annotated[
        str,
        typer.Argument(
            metavar="ROBOT",
            help="A URDF or MuJoCo file, package://NAME/PATH, or a name that `fesd-robot robots` lists.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="The task file to write; default: <name of the task>.yaml."),
    ] = None,
    foot: Annotated[
        list[str] | None,
        typer.Option(
            "--foot",
            metavar="BODY",
            help="A body that touches the ground; may be given several times. Default: the lowest ends of the limbs.",
            show_default=False,
        ),
    ] = None,
    root: Annotated[
        Literal["fixed", "sagittal"] | None,
        typer.Option(
            "--root",
            help="What carries the robot: the world, or a boom in the x-z plane. Default: guessed.",
            show_default=False,
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the file if there is one.")] = False,
) -> None:
    """Write a first task for a robot: one with legs jumps, an arm puts its tip to the ground.

    Feet and a posture to stand in are found in the model. The task is checked before it is written, and says in
    comments what there is to change.
    """
    from fesd_robot.errors import FesdRobotError
    from fesd_robot.first_task import propose_first_task
    from fesd_robot.task import SCHEMA_FILE
    from fesd_robot.writing import write_atomically

    folder = Path() if out is None else out.parent
    if not folder.is_dir():
        raise FesdRobotError(f"{folder}: there is no such folder, expected one for the task file")
    schema = os.path.relpath(SCHEMA_FILE, folder.resolve())
    name, text = propose_first_task(robot, folder, root=root, feet=foot or (), schema=schema)
    file = Path(f"{name}.yaml") if out is None else out
    if file.exists() and not force:
        raise FesdRobotError(f"{file}: this file exists, expected none: choose another name by --out, or use --force")
    try:
        write_atomically(file, text.encode("utf-8"))
    except OSError as error:
        raise FesdRobotError(f"{file}: this cannot be written ({error.strerror})") from error
    typer.echo(f"written: {file}\n\nNext: fesd-robot check {file} --page task.html\n      fesd-robot plan {file}")
