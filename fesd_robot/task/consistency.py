"""Whether the sections of a task agree with each other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from pydantic_core import PydanticCustomError

from fesd_robot.task.constraints import ContactWindow
from fesd_robot.task.endpoints import FreeDuration
from fesd_robot.task.fields import conflict
from fesd_robot.task.reference import Jumps, ThroughWaypoints

if TYPE_CHECKING:
    from fesd_robot.task.schema import Task

_ROUNDED = 1e-3
"""A time this near to the end of a control interval, as a share of the interval, is that end in few digits."""


def disagreements(task: Task) -> Iterator[PydanticCustomError]:
    """Yield an error about every pair of keys that contradict each other."""
    if isinstance(task.reference, Jumps) and task.reference.count > task.horizon.intervals:
        yield conflict(
            ("reference", "count"),
            f"found {task.reference.count} jumps, expected at most one per control interval ({task.horizon.intervals})",
        )
    yield from _waypoints(task)
    yield from _periodic(task)
    for name, constraint in task.constraints.items():
        if isinstance(constraint, ContactWindow):
            for time in constraint.times:
                yield from _time(task, ("constraints", name, "times"), time)
    free = isinstance(task.horizon.duration, FreeDuration)
    if free and any(task.costs.acceleration.values()):
        yield conflict(
            ("costs", "acceleration"), "found weights of the mean acceleration over intervals of free length; expected "
            "a fixed horizon.duration"
        )  # fmt: skip
    if task.costs.time and not free:
        yield conflict(
            ("costs", "time"), "found a weight of the duration, which is fixed; expected horizon.duration with lower "
            "and upper"
        )  # fmt: skip


def _waypoints(task: Task) -> Iterator[PydanticCustomError]:
    times = [waypoint.time for waypoint in task.waypoints]
    given = [time for time in times if time is not None]
    if given and len(given) < len(times):
        yield conflict(
            ("waypoints", str(times.index(None))), "found no time beside waypoints with a time, expected a time for "
            "all of them or for none"
        )  # fmt: skip
    elif given:
        for i, time in enumerate(given):
            key = ("waypoints", str(i), "time")
            yield from _time(task, key, time, inside=True)
            if i and not given[i - 1] < time:
                yield conflict(key, f"found {time:g} after {given[i - 1]:g}, expected times in increasing order")
    elif len(times) >= task.horizon.intervals:
        yield conflict(
            ("waypoints",), f"found {len(times)} waypoints, expected less than there are control intervals "
            f"({task.horizon.intervals})"
        )  # fmt: skip
    if isinstance(task.reference, ThroughWaypoints) and not any(w.configuration for w in task.waypoints):
        yield conflict(("reference", "type"), "found 'waypoints', but no waypoint has a configuration, expected one")


def _periodic(task: Task) -> Iterator[PydanticCustomError]:
    if task.goal.periodic is None:
        return
    for key in ("terminal_configuration", "terminal_velocity"):
        if getattr(task.costs, key) is not None:
            yield conflict(
                ("costs", key), "found weights of a goal beside goal.periodic, which has none; expected no such key"
            )


def _time(task: Task, key: tuple[str, ...], time: float, inside: bool = False) -> Iterator[PydanticCustomError]:
    """Yield an error unless a time is the end of a control interval (or 0, or the end, unless `inside`)."""
    duration, intervals = task.horizon.duration, task.horizon.intervals
    if isinstance(duration, FreeDuration):
        yield conflict(key, f"found the time {time:g} in a motion of free duration, expected a fixed horizon.duration")
        return
    length = duration / intervals
    first, last = (1, intervals - 1) if inside else (0, intervals)
    if not (first - _ROUNDED) * length <= time <= (last + _ROUNDED) * length:
        bounds = f"from {first * length:.6g} to {last * length:.6g} s"
        yield conflict(key, f"found {time:g}, expected the end of a control interval {bounds}")
    elif abs(time / length - round(time / length)) > _ROUNDED:
        below = int(time / length)
        nearby = " or ".join(f"{end * length:.6g}" for end in (below, below + 1) if first <= end <= last)
        yield conflict(key, f"found {time:g}, expected the end of a control interval; the nearest are {nearby} s")
