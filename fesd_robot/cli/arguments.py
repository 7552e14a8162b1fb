"""Arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def _names_beginning_with(incomplete: str) -> list[str]:
    """Return the names of shipped tasks a shell may complete to."""
    from fesd_robot.examples import shipped_examples

    names = [example.name for example in shipped_examples() if example.kind == "task"]
    return [name for name in names if name.startswith(incomplete)]


TaskFile = Annotated[
    Path,
    typer.Argument(
        metavar="TASK",
        help="The task file, or the name of a task that `fesd-robot examples` lists.",
        autocompletion=_names_beginning_with,
        show_default=False,
    ),
]

PlanFile = Annotated[
    Path,
    typer.Argument(metavar="PLAN", help="A folder of results, or the plan.json in it.", show_default=False),
]

Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Replace one value of the task, e.g. --set horizon.intervals=30; may be given several times.",
        show_default=False,
    ),
]

Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing unless something goes wrong.")]

Page = Annotated[
    Path | None,
    typer.Option(
        "--page",
        metavar="FILE.html",
        help="Draw it, too, as a web page that needs no network: a file, or the folder for it.",
        show_default=False,
    ),
]
