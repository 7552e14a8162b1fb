"""`fesd-robot improve`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fesd_robot.cli.arguments import Overrides, PlanFile, Quiet
from fesd_robot.cli.plan import planned

if TYPE_CHECKING:
    from fesd_robot.task import Task


def improve(plan: PlanFile, overrides: Overrides = None, quiet: Quiet = False) -> None:
    """Look for a cheaper motion of the task of a plan, from the plan, until no neighbour of it is cheaper.

    Its plan takes the place of the earlier one if one is found; else that stays as it is. Ctrl-C ends the search with
    the cheapest motion so far.
    """
    file = plan.absolute()
    folder = file if file.is_dir() else file.parent

    def load() -> tuple[Task, Path]:
        from fesd_robot.plans import task_to_improve

        return task_to_improve(plan, overrides or []), folder

    planned(load, quiet, better_than=folder)
