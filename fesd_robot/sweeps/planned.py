"""The plan of a row, made by a worker."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fesd_robot.errors import FesdRobotError
from fesd_robot.planning.planner import continued, plan
from fesd_robot.plans import PAGE_FILE, Plan, write_into
from fesd_robot.render import write_page
from fesd_robot.running import Deadline, held_deadline, held_to
from fesd_robot.sweeps.order import Answer, Order, Start, Verdict
from fesd_robot.sweeps.scales import with_scales
from fesd_robot.task import Task, load_task

CONTINUED = ("solver.effort=quick",)
"""Settings of a plan that begins from another one: it keeps that one's sequence of contacts."""

CONTINUED_SHARE = 0.5
"""Part of the time limit of a row for the plan that begins from another one."""


def planned(order: Order, task_file: Path, measure: Callable[[Plan], Mapping[str, Any]] | None = None) -> Answer:
    """Plan a task with the values of a row.

    Args:
        order: the values.
        task_file: the task, which its own files lie around.
        measure: plan -> values of further columns of the table; a function of a module.

    Raises:
        FesdRobotError: the task is not valid with these values.
    """
    clock, overrides = Deadline(), with_scales(task_file, order.overrides)
    task = load_task(task_file, overrides)
    limits = [seconds for seconds in (order.limits.seconds, task.solver.time_limit) if seconds is not None]
    with held_to(Deadline(min(limits, default=None), clock.spent)):
        taken = list[int]()
        begun = _begun_from(order.start, task_file, overrides, taken) if order.start else None
        result = begun or plan(task)
    verdict = Verdict.SOLVED if result.status.solved else Verdict.NOT_SOLVED
    values = values_of(result)
    if order.start is not None:
        values |= _begun_in_vain(order.start, values, sum(taken)) if begun is None else {"start": order.start.number}
    if measure is not None:
        values |= measure(result)
    wanted = order.keep == "all" or (result.status.solved and order.keep != "none")
    if order.cheaper_than is not None and result.statistics.objective >= order.cheaper_than:
        wanted = False
    files = _files(result, task, order) if wanted else {}
    return Answer(order.number, verdict, values, result.status.message, files=files)


def _begun_from(start: Start, task_file: Path, overrides: Sequence[str], taken: list[int]) -> Plan | None:
    """Return the plan that begins from another row's, in half of the time that is left, so that its task has the rest.

    Args:
        start: the other row.
        task_file, overrides: the task.
        taken: gets the iterations that it takes.

    Returns:
        None where that plan's sequence of contacts leads to no motion.
    """
    held, task = held_deadline(), load_task(task_file, [*overrides, *CONTINUED])
    with held_to(held.share(CONTINUED_SHARE) if held else Deadline()):
        try:
            result = continued(
                task, Plan.model_validate_json(start.plan), progress=lambda nlp: taken.append(nlp.iterations)
            )
        except FesdRobotError:
            return None  # with the task alone it is found out what is wrong
    if result is None:
        return None
    told = {**result.task, "solver": {**result.task["solver"], "warm_start": start.place}}
    return result.model_copy(update={"task": told})


def _begun_in_vain(start: Start, values: Mapping[str, Any], abandoned: int) -> dict[str, Any]:
    """Return the columns that say from which row a plan began in vain, and with what all of its iterations are."""
    return {
        "abandoned": start.number,
        "abandoned_iterations": abandoned,
        "iterations": values["iterations"] + abandoned,
    }


def values_of(result: Plan) -> dict[str, Any]:
    """Return what a row says of a plan, by column."""
    contacts = list(result.outcome.contacts.values()) if result.outcome else []
    attempts = result.statistics.attempts
    return {
        "cost": result.statistics.objective,
        "work": work_of(result),
        "time": float(result.trajectory.time[-1]),
        "flights": sum(len(contact.flights) for contact in contacts),
        "slides": sum(contact.slide_distance for contact in contacts),
        "iterations": sum(one.iterations for one in attempts) or result.statistics.iterations,
        "attempts": max(len(attempts), 1),
        **{f"end.{name}": float(values[-1]) for name, values in result.trajectory.configuration.items()},
    }


def work_of(result: Plan) -> float | None:
    """Return the work of the controls of a plan, J: the integral of the size of each one's power, none given back.

    Returns:
        None where a control pushes along directions that depend on the configuration.
    """
    time, speeds = result.trajectory.time, result.trajectory.velocity
    at = np.searchsorted(result.controls["time"], time, side="right") - 1
    actuators, total = result.task["robot"].get("actuators") or {}, 0.0
    for name, values in result.controls.items():
        if name == "time":
            continue
        own = actuators.get(name, {"joint": name})
        pushed = own.get("force") or {own["joint"]: 1.0}
        if any(isinstance(part, str) or coordinate not in speeds for coordinate, part in pushed.items()):
            return None
        speed = np.sum([part * speeds[coordinate] for coordinate, part in pushed.items()], axis=0)
        power = np.abs(values[at] * speed)
        total += float(0.5 * (power[1:] + power[:-1]) @ np.diff(time))
    return total


def _files(result: Plan, task: Task, order: Order) -> dict[str, bytes]:
    """Return the files of a plan, which says that its task's files lie where they do for who has ordered it."""
    own = {"folder": order.home, "git": order.git} if order.home else {}
    provenance = result.provenance.model_copy(update=own)
    told = result.model_copy(update={"provenance": provenance})

    def extras(stage: Path) -> None:
        if task.output.page:
            write_page(result, task, stage / PAGE_FILE)

    with tempfile.TemporaryDirectory() as folder:
        written = write_into(told, Path(folder) / "plan", extras)
        return {
            path.relative_to(written).as_posix(): path.read_bytes() for path in written.rglob("*") if path.is_file()
        }
