"""The task of a plan, as it was solved, read back from the plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any

from pydantic import ValidationError

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


def check_task(plan: Plan) -> None:
    """Raise unless the task of a plan is one in its form; values may contradict each other, and keys may have gone.

    Raises:
        TaskError: a key that is missing, or whose value is none of its kind.
    """
    data = deepcopy(plan.task)
    _leave_out_gone(data)
    try:
        Task.model_validate(data)
    except ValidationError as error:
        if any(one["type"] not in _OF_OTHER_VERSIONS for one in error.errors(include_url=False)):
            raise validation_error(error, Origins()) from error


_OF_OTHER_VERSIONS = ("conflict", "extra_forbidden")
"""Errors, in the words of pydantic, of tasks that another version took."""


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
        task = task.get(part, {}) if isinstance(task, dict) else {}
    return task if isinstance(task, dict) else {}
