"""`fesd-robot simulate`."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fesd_robot.cli.arguments import Overrides, Quiet

if TYPE_CHECKING:
    from fesd_robot.plans import Plan
    from fesd_robot.task import Task


def simulate(
    what: Annotated[
        Path,
        typer.Argument(
            metavar="TASK|PLAN",
            help="A task file, the name of a task that `fesd-robot examples` lists, a folder of results, or its "
            "plan.json.",
            show_default=False,
        ),
    ],
    controls: Annotated[
        Path | None,
        typer.Option(
            "--controls",
            metavar="FILE",
            help="A plan, or a CSV table with a column 'time' (s, where a row begins to hold) and one for every "
            "control; default: those of the plan, or zero.",
            show_default=False,
        ),
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(
            "--duration", metavar="SECONDS", help="Default: that of the plan, or of the task.", show_default=False
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the results; default: runs/<name>_simulated."),
    ] = None,
    overrides: Overrides = None,
    quiet: Quiet = False,
) -> None:
    """Simulate what given controls lead to, from the start of a task or a plan.

    Every contact event is located exactly, and nothing is optimised. The files are those of a plan: trajectory, report,
    page and figures. Exit status: 0 if the motion is the only one there is, 3 if rigid bodies could go on in several
    ways.
    """
    from fesd_robot.cli.exits import ExitCode
    from fesd_robot.cli.plan_task import task_in
    from fesd_robot.cli.summary import summary
    from fesd_robot.plans import Plan, check_output_folder, task_of, write_or_keep
    from fesd_robot.render import write_optional_files
    from fesd_robot.simulation import simulate_robot

    given = _loaded(what, overrides or [])
    folder = Path("runs") / f"{given.name}_simulated" if out is None else out
    check_output_folder(folder)
    with task_in(what) if isinstance(given, Plan) else nullcontext():
        result = simulate_robot(given, controls, duration=duration)
    written = write_or_keep(result, folder, lambda stage: write_optional_files(result, task_of(result), stage))
    if not quiet:
        typer.echo("\n".join(summary(result, written, folder)))
    if not result.status.solved:
        raise typer.Exit(ExitCode.NOT_SOLVED)


def _loaded(what: Path, overrides: list[str]) -> Task | Plan:
    """Return the plan, or the task, that a path is."""
    from fesd_robot.cli.plan_task import task_in
    from fesd_robot.ocp import is_plan
    from fesd_robot.plans import read_plan, task_of
    from fesd_robot.task import load_task

    if not is_plan(what):
        return load_task(what, overrides)
    plan = read_plan(what)
    with task_in(what):
        return plan.model_copy(update={"task": task_of(plan, overrides=overrides).model_dump(mode="json")})
