"""`fesd-robot refine`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fesd_robot.cli.arguments import Overrides, PlanFile, Quiet
from fesd_robot.cli.plan import planned

if TYPE_CHECKING:
    from fesd_robot.task import Task


def refine(
    plan: PlanFile,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the results; default: <folder of the plan>_refined."),
    ] = None,
    overrides: Overrides = None,
    quiet: Quiet = False,
) -> None:
    """Plan the task of a plan again, changed by --set, from the plan: with its contact sequence, states and controls.

    On a control grid that contains that of the plan, as with twice the horizon.intervals, the motion costs no more than
    the plan. Any other change of the task is possible, too. Sequences that cost less there are looked for with --set
    solver.effort=balanced.
    """

    def load() -> tuple[Task, Path]:
        from fesd_robot.plans import task_to_refine

        file = plan.absolute()
        folder = file if file.is_dir() else file.parent
        return task_to_refine(plan, overrides or []), folder.with_name(f"{folder.name}_refined") if out is None else out

    planned(load, quiet)
