"""The plan of a row, made by a worker."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from fesd_robot.errors import FesdRobotError
from fesd_robot.planning.planner import plan
from fesd_robot.plans import PAGE_FILE, Plan, read_plan, write_into
from fesd_robot.plans.results_folder import PLAN_FILE
from fesd_robot.render import write_page
from fesd_robot.running import Deadline, held_to
from fesd_robot.sweeps.order import Answer, Order, Verdict
from fesd_robot.sweeps.scales import with_scales
from fesd_robot.task import Task, load_task

CONTINUED = ("solver.effort=quick",)
"""Settings of a plan that begins from another one: it keeps that one's sequence of contacts."""


def planned(order: Order, task_file: Path) -> Answer:
    """Plan a task with the values of a row.

    Args:
        order: the values.
        task_file: the task, which its own files lie around.

    Raises:
        FesdRobotError: the task is not valid with these values.
    """
    overrides = with_scales(task_file, order.overrides)
    with held_to(Deadline(order.limits.seconds)):
        begun_from: int | None = None
        found = _continued(order, task_file, overrides) if order.start else None
        if found is not None and order.start:
            begun_from = order.start[0]
        task, result = found or _cold(task_file, overrides)
    verdict = Verdict.SOLVED if result.status.solved else Verdict.NOT_SOLVED
    values = {**values_of(result), "start": begun_from}
    kept = order.keep == "all" or (result.status.solved and order.keep != "none")
    if order.cheaper_than is not None and result.statistics.objective >= order.cheaper_than:
        kept = False
    files = _files(result, task, order.page) if kept else {}
    return Answer(order.number, verdict, values, result.status.message, files=files)


def _cold(task_file: Path, overrides: tuple[str, ...]) -> tuple[Task, Plan]:
    task = load_task(task_file, overrides)
    return task, plan(task)


def _continued(order: Order, task_file: Path, overrides: tuple[str, ...]) -> tuple[Task, Plan] | None:
    """Return the plan that begins from another row's; None where it is not solved."""
    assert order.start
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / PLAN_FILE
        file.write_bytes(order.start[1])
        earlier = read_plan(file)
    task = load_task(task_file, [*overrides, *CONTINUED, "solver.retries=0"])
    try:
        result = plan(task, earlier=earlier)
    except FesdRobotError:
        return None  # with the task alone it is found out what is wrong
    return (task, result) if result.status.solved else None


def values_of(result: Plan) -> dict[str, Any]:
    """Return what a row says of a plan, by column."""
    contacts = list(result.outcome.contacts.values()) if result.outcome else []
    attempts = result.statistics.attempts
    return {
        "cost": result.statistics.objective,
        "time": float(result.trajectory.time[-1]),
        "flights": sum(len(contact.flights) for contact in contacts),
        "slides": sum(contact.slide_distance for contact in contacts),
        "iterations": sum(one.iterations for one in attempts) or result.statistics.iterations,
        "attempts": max(len(attempts), 1),
        **{f"end.{name}": float(values[-1]) for name, values in result.trajectory.configuration.items()},
    }


def _files(result: Plan, task: Task, page: bool) -> dict[str, bytes]:
    """Return the files of a plan."""

    def extras(stage: Path) -> None:
        if page and task.output.page:
            write_page(result, task, stage / PAGE_FILE)

    with tempfile.TemporaryDirectory() as folder:
        written = write_into(result, Path(folder) / "plan", extras)
        return {
            path.relative_to(written).as_posix(): path.read_bytes() for path in written.rglob("*") if path.is_file()
        }
