"""Errors of the task in a plan, told with the file of the plan."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fesd_robot.errors import PlanFileError, TaskError


@contextmanager
def task_in(plan: Path, hint: str = "") -> Iterator[None]:
    """Tell what is wrong with the task of a plan by the plan's file; a mistake of the command line stays one.

    Args:
        plan: the file or its folder.
        hint: what may help, the end of the sentence.
    """
    try:
        yield
    except TaskError as error:
        if "--set" in str(error):
            raise
        raise PlanFileError(f"{plan}: its task cannot be used: {error}{hint}") from error
