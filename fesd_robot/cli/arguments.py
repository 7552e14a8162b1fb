"""Arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

TaskFile = Annotated[Path, typer.Argument(metavar="TASK.yaml", help="The task file.", show_default=False)]

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
