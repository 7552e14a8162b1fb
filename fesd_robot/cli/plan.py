"""`fesd-robot plan`."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fesd_robot.cli.arguments import Overrides, Quiet, TaskFile
from fesd_robot.cli.exits import ExitCode
from fesd_robot.cli.interrupts import Interrupts
from fesd_robot.cli.main import before_main
from fesd_robot.cli.progress import Progress, progress_for, wrapped
from fesd_robot.running import Activity, Deadline, held_to

if TYPE_CHECKING:
    from fesd_robot.plans import Plan
    from fesd_robot.task import Task

logger = logging.getLogger(__name__)


def plan(
    task: TaskFile,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the results; default: runs/<name of the task>."),
    ] = None,
    overrides: Overrides = None,
    quiet: Quiet = False,
) -> None:
    """Plan the motion that a task describes.

    Writes trajectory, report, page and figures into one folder, in the place of those of an earlier plan there. Where
    cheaper motions are looked for for long, the first one is written meanwhile, without figures. The sequence of
    contacts of the earlier plan is one of the first that are tried.

    Ctrl-C stops the solver and writes its best iterate, marked as not solved; a second Ctrl-C aborts at once. While
    page and figures are drawn Ctrl-C leaves them out.
    """

    def load() -> tuple[Task, Path]:
        from fesd_robot.task import load_task

        loaded = load_task(task, overrides or [])
        return loaded, Path("runs") / loaded.name if out is None else out

    planned(load, quiet)


def planned(load: Callable[[], tuple[Task, Path]], quiet: bool, better_than: Path | None = None) -> None:
    """Plan a task, write its files, and exit as `plan` does.

    Args:
        load: returns the task, and the folder for the results.
        quiet: print nothing unless something goes wrong.
        better_than: folder of a plan that stays as it is where the new one is not solved, or does not cost less.
    """
    progress = progress_for(quiet, logger.isEnabledFor(logging.DEBUG))
    with Interrupts(on_request=progress.stopping, on_abort=progress.close) as interrupts:
        with progress:
            from fesd_robot.cli.summary import summary
            from fesd_robot.plans import check_output_folder

            task, folder = load()
            check_output_folder(folder)
            progress.limit(task.solver.time_limit)
            with held_to(Deadline.of_command(task.solver.time_limit, progress.spent + before_main())):
                result = _solve(task, progress, interrupts, None if better_than else folder)
            kept = better_than is not None and not _is_better(result, better_than)
            written = folder if kept else _write(result, task, folder, progress, interrupts)
        if kept:
            if not quiet:
                typer.echo(f"{result.name}: no cheaper motion is found; {folder} stays as it is")
            raise typer.Exit(ExitCode.INTERRUPTED if interrupts.received else ExitCode.SOLVED)
        if not quiet:
            typer.echo("\n".join(wrapped(line) for line in summary(result, written, folder)))
        elif not result.status.solved:
            typer.echo(f"{result.name}: {result.status.message}", err=True)
    if interrupts.received:
        raise typer.Exit(ExitCode.INTERRUPTED)
    if not result.status.solved:
        raise typer.Exit(ExitCode.NOT_SOLVED)


def _is_better(plan: Plan, folder: Path) -> bool:
    """Return whether a plan is solved and costs less than the one in a folder, or that one is not solved."""
    from fesd_robot.plans import read_plan

    earlier = read_plan(folder)
    cheaper = plan.statistics.objective < earlier.statistics.objective
    return plan.status.solved and (cheaper or not earlier.status.solved)


def _solve(task: Task, progress: Progress, interrupts: Interrupts, folder: Path | None) -> Plan:
    """Return the plan of a task; a first one goes to a folder, if one is named, and the plan there is looked at."""
    from fesd_robot.planning import planner

    def stop(iteration: int, objective: float) -> bool:
        if interrupts.solving():
            logger.debug("the solver is running")
        progress.iteration(iteration, objective)
        return interrupts.stop

    logger.debug("building the problem of %s", task.name)
    result = planner.plan(
        task,
        progress=progress.nlp,
        stop=stop,
        retrying=progress.retry,
        on_activity=progress.activity,
        on_progress=progress.steps,
        early=(lambda first: _write_early(first, task, folder, progress)) if folder else None,
        earlier=_earlier(folder) if folder else None,
    )
    interrupts.solved()
    return result


def _earlier(folder: Path) -> Plan | None:
    """Return the plan in a folder, None if there is none that can be read and is solved."""
    from fesd_robot.errors import FesdRobotError
    from fesd_robot.plans import read_plan

    try:
        plan = read_plan(folder)
    except FesdRobotError:
        return None
    return plan if plan.status.solved else None


def _write_early(plan: Plan, task: Task, folder: Path, progress: Progress) -> None:
    """Write a plan that may be replaced by a cheaper one, with its page; what cannot be written is left to the last."""
    from fesd_robot.plans import PAGE_FILE, write_into
    from fesd_robot.render import write_page

    message = f"{plan.status.message} {EARLY}"
    marked = plan.model_copy(update={"status": plan.status.model_copy(update={"message": message})})

    def page(stage: Path) -> None:
        if task.output.page:
            write_page(marked, task, stage / PAGE_FILE)

    try:
        write_into(marked, folder, page)
    except Exception as error:
        logger.debug("the first plan could not be written: %s", error)
        return
    progress.early(plan, folder)


EARLY = "Cheaper motions are still looked for."
"""Addition to the message of a plan that a cheaper one may replace."""


def _write(plan: Plan, task: Task, folder: Path, progress: Progress, interrupts: Interrupts) -> Path:
    from fesd_robot.plans import write_or_keep
    from fesd_robot.render import write_optional_files

    def extras(stage: Path) -> None:
        try:
            progress.activity(Activity.DRAWING)
            with interrupts.drawing():
                write_optional_files(plan, task, stage)
        except KeyboardInterrupt:
            typer.echo(
                f"interrupted: what was not drawn yet is left out; fesd-robot render {folder} draws it", err=True
            )

    logger.debug("writing to %s", folder)
    progress.activity(Activity.WRITING)
    written = write_or_keep(plan, folder, extras)
    interrupts.written()
    return written
