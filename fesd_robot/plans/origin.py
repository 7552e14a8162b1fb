"""The task of a plan, as it was solved, read back from the plan."""

from __future__ import annotations

from pathlib import Path

from pydantic import ValidationError

from fesd_robot.plans.plan import Plan
from fesd_robot.task import Task
from fesd_robot.task.messages import validation_error
from fesd_robot.task.origins import Origins


def task_of(plan: Plan, folder: Path | None = None) -> Task:
    """Return the task that a plan was made for, with relative paths starting where they did then.

    Args:
        folder: where they start now; default: the folder the plan names, or the working directory if it names none.

    Raises:
        TaskError: the task is not one of this version.
    """
    start = Path(plan.provenance.folder or "") if folder is None else folder
    origins = Origins(start=start.absolute())
    try:
        task = Task.model_validate(plan.task)
    except ValidationError as error:
        raise validation_error(error, origins) from error
    return task.with_origins(origins)
