"""The task of a plan, as it was solved, read back from the plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from fesd_robot.plans.files import read_plan
from fesd_robot.plans.plan import Plan
from fesd_robot.task import KeyPath, Origin, Origins, Task, override_keys, validation_error

GONE: Mapping[KeyPath, Sequence[str]] = {
    ("solver",): ("starts", "coarse_to_fine", "local_search", "steering", "schedule"),
    ("method",): ("cross_complementarity",),
    ("method", "formulation"): ("gap", "gate", "step_regularisation_weight", "step_selection_weight"),
}
"""Keys by section in plans of version 0.1.0 that tasks do not have any more."""

GONE_VALUES: Mapping[KeyPath, Sequence[str]] = {
    ("solver", "relaxation"): (
        "natural_residual",
        "chen_chen_kanzow",
        "steffensen_ulbrich_sine",
        "steffensen_ulbrich_polynomial",
        "kanzow_schwartz",
    ),
}
"""Values by key in plans of version 0.1.0 that tasks do not have any more; the default takes their place."""


def task_of(plan: Plan, folder: Path | None = None, overrides: Sequence[str] = ()) -> Task:
    """Return the task that a plan was made for, with relative paths starting where they did then.

    Args:
        plan: the plan.
        folder: where they start now; default: the folder the plan names, or the working directory if it names none.
        overrides: ``key.path=value`` each; values are YAML, the last one for a key wins.

    Raises:
        TaskError: the task is not one of this version, or an override does not fit.
    """
    start = Path(plan.provenance.folder or "") if folder is None else folder
    data, places = deepcopy(plan.task), dict[KeyPath, Origin]()
    _leave_out_gone(data)
    override_keys(data, places, overrides)
    origins = Origins(start=start.absolute(), places=places)
    try:
        task = Task.model_validate(data)
    except ValidationError as error:
        raise validation_error(error, origins) from error
    return task.with_origins(origins)


def _leave_out_gone(task: dict[str, Any]) -> None:
    """Remove `GONE` keys and keys with `GONE_VALUES` from a task as plain data, in place."""
    for path, keys in GONE.items():
        section = _section(task, path)
        for key in keys:
            section.pop(key, None)
    for path, values in GONE_VALUES.items():
        section = _section(task, path[:-1])
        if section.get(path[-1]) in values:
            del section[path[-1]]


def _section(task: dict[str, Any], path: KeyPath) -> dict[str, Any]:
    """Return a section of a task, empty if the task leaves it out."""
    for part in path:
        task = task.get(part, {})
    return task


def task_to_refine(path: Path, overrides: Sequence[str] = ()) -> Task:
    """Return the task of a plan that begins from the plan and keeps its contacts, changed.

    The plan may be that of another start than the first, which would ask for that start again.

    Args:
        path: ``plan.json`` or its folder.
        overrides: as those of `task_of`; they go before what is kept.

    Raises:
        TaskError, PlanFileError: as those of `task_of` and `read_plan`.
    """
    return _from_plan(path, ["solver.effort=quick", *overrides])


def task_to_improve(path: Path, overrides: Sequence[str] = ()) -> Task:
    """Return the task of a plan that begins from the plan, and is searched until no neighbour is cheaper.

    Args:
        path: ``plan.json`` or its folder.
        overrides: as those of `task_of`.

    Raises:
        TaskError, PlanFileError: as those of `task_of` and `read_plan`.
    """
    return _from_plan(path, ["solver.effort=best", *overrides])


def _from_plan(path: Path, overrides: Sequence[str]) -> Task:
    """Return the task of a plan that begins at the plan."""
    own = ("solver.seed=0", *overrides, f"solver.warm_start={path.absolute()}")
    return task_of(read_plan(path), overrides=own)
