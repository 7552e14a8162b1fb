"""Tasks that begin from an earlier plan: to refine it, or to find a cheaper motion."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fesd_robot.plans.files import read_plan
from fesd_robot.plans.origin import task_of
from fesd_robot.task import Task


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
