"""A control grid that is coarser than a task's, and contained in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.task.constraints import ContactWindow
from fesd_robot.task.endpoints import FreeDuration

if TYPE_CHECKING:
    from fesd_robot.task.schema import Task

DIVISORS = (2, 3)
"""Into how many parts an interval of the coarser grid falls: the first of these that fits the task."""

FEWEST = 4
"""Intervals of a coarser grid, at least: fewer controls hardly lead anywhere."""

_ROUNDED = 1e-3
"""Part of an interval within which a time is the end of one."""


def coarser_intervals(task: Task) -> int | None:
    """Return the number of intervals of the coarser control grid that a motion can be planned on first.

    Args:
        task: the task.

    Returns:
        None where there is none: the number of intervals has no small divisor, a time of the task is not the end of an
        interval there, the motion begins from an earlier one, or its velocities jump between elements.
    """
    own = task.horizon.intervals
    if task.solver.warm_start is not None or task.method.contact == "impulses":
        return None
    for parts in DIVISORS:
        if own % parts == 0 and own // parts >= FEWEST and _all_times_fit(task, own // parts):
            return own // parts
    return None


def _all_times_fit(task: Task, intervals: int) -> bool:
    if isinstance(task.horizon.duration, FreeDuration):
        return True
    times = [one.time for one in task.waypoints if one.time is not None]
    for constraint in task.constraints.values():
        times += constraint.times if isinstance(constraint, ContactWindow) else []
    ends = [time / task.horizon.duration * intervals for time in times]
    enough = len(task.waypoints) < intervals and getattr(task.reference, "count", 1) <= intervals
    return enough and all(abs(end - round(end)) <= _ROUNDED for end in ends)
