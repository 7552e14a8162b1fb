"""Consistency of a task: errors about keys of different sections that contradict each other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from pydantic_core import PydanticCustomError

from fesd_robot.instants import WRITTEN_NODE
from fesd_robot.task.constraints import ContactWindow
from fesd_robot.task.costs import COST_TERMS
from fesd_robot.task.endpoints import FreeDuration
from fesd_robot.task.fields import conflict
from fesd_robot.task.limits import SpeedOfTime
from fesd_robot.task.reference import Jumps, ThroughWaypoints

if TYPE_CHECKING:
    from fesd_robot.task.schema import Task

_DIVISORS = (2, 3)
"""Into how many parts an interval of a coarser control grid falls: the first of these that fits the task."""

_FEWEST = 4
"""Intervals of a coarser control grid, at least: fewer controls hardly lead anywhere."""

_WRONG_DURATION = {
    "fixed": "found weights of what needs intervals of fixed length, which have a free length; expected a fixed "
    "horizon.duration",
    "free": "found a weight of the duration, which is fixed; expected horizon.duration with lower and upper",
}
"""Duration that a term of the cost needs -> the sentence where it is the other one."""


def consistency_errors(task: Task) -> Iterator[PydanticCustomError]:
    """Yield an error about every pair of keys that contradict each other."""
    if isinstance(task.reference, Jumps) and task.reference.count > task.horizon.intervals:
        yield conflict(
            ("reference", "count"),
            f"found {task.reference.count} jumps, expected at most one per control interval ({task.horizon.intervals})",
        )
    if isinstance(task.reference, Jumps) and not task.contacts:
        yield conflict(
            ("reference", "type"), "found jumps in a task without contacts, where nothing leaves the ground; expected "
            "another type, or contacts"
        )  # fmt: skip
    yield from _waypoints(task)
    yield from _compliance(task)
    for name, constraint in task.constraints.items():
        if isinstance(constraint, ContactWindow):
            for time in constraint.times:
                yield from _time(task, ("constraints", name, "times"), time)
    yield from _costs(task)
    free = isinstance(task.horizon.duration, FreeDuration)
    if task.method.contact == "impulses" and not free and task.limits.speed_of_time != SpeedOfTime():
        yield conflict(
            ("limits", "speed_of_time"),
            "found limits of the speed of time, which is 1 with a fixed horizon.duration and method.contact: impulses; "
            "expected no such key",
        )


def _compliance(task: Task) -> Iterator[PydanticCustomError]:
    """Yield an error about everything that asks of a compliant contact what only a rigid one does."""
    compliant = {name for name, contact in task.contacts.items() if contact.stiffness is not None}
    for name in task.contacts:
        own = task.contacts[name]
        if name in compliant and own.slipping not in ("allowed", "auto"):
            yield conflict(
                ("contacts", name, "slipping"),
                f"found '{own.slipping}' for a contact with stiffness, which has no friction, expected no such key",
            )
        if name in compliant and own.reserve:
            yield conflict(
                ("contacts", name, "reserve"),
                f"found {own.reserve:g} for a contact with stiffness, which has no friction, expected no such key",
            )
    rigid = "expected a contact without stiffness, which a gap of zero holds"
    for at, section in task.states:
        standing = section.standing
        for contact in standing.contacts if standing else ():
            if contact in compliant:
                yield conflict((*at, "stand_on"), f"found '{contact}', a contact with stiffness, {rigid}")
    for name, constraint in task.constraints.items():
        own_contacts = getattr(constraint, "contacts", [getattr(constraint, "contact", None)])
        for contact in own_contacts:
            if contact in compliant:
                yield conflict(("constraints", name), f"found '{contact}', a contact with stiffness, {rigid}")


def coarser_intervals(task: Task) -> int | None:
    """Return the number of intervals of the coarser control grid that shows what touches when.

    Args:
        task: the task.

    Returns:
        None where there is none: the number of intervals has no small divisor, the task contradicts itself there, as a
        time that is not the end of an interval does, the motion begins from an earlier one, or its velocities jump
        between elements.
    """
    own = task.horizon.intervals
    if task.solver.warm_start is not None or task.method.contact == "impulses":
        return None
    for fewer in (own // parts for parts in _DIVISORS if own % parts == 0 and own // parts >= _FEWEST):
        horizon = task.horizon.model_copy(update={"intervals": fewer})
        if not any(consistency_errors(task.model_copy(update={"horizon": horizon}))):
            return fewer
    return None


def _costs(task: Task) -> Iterator[PydanticCustomError]:
    duration = "free" if isinstance(task.horizon.duration, FreeDuration) else "fixed"
    for key, term in COST_TERMS.items():
        at = ("costs", key)
        if term.duration is not None and term.duration != duration and task.costs.used(key):
            yield conflict(at, _WRONG_DURATION[term.duration])
        if term.goal and task.goal.periodic is not None and getattr(task.costs, key) is not None:
            yield conflict(at, "found weights of a goal beside goal.periodic, which has none; expected no such key")


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
    if isinstance(task.reference, ThroughWaypoints) and all(
        waypoint.complete and not waypoint.configuration for waypoint in task.waypoints
    ):
        yield conflict(("reference", "type"), "found 'waypoints', but no waypoint has a configuration, expected one")


def _time(task: Task, key: tuple[str, ...], time: float, inside: bool = False) -> Iterator[PydanticCustomError]:
    """Yield an error unless a time is the end of a control interval (or 0, or the end, unless `inside`).

    Where the control grid moves it may be any time.
    """
    duration, intervals = task.horizon.duration, task.horizon.intervals
    if isinstance(duration, FreeDuration):
        yield conflict(key, f"found the time {time:g} in a motion of free duration, expected a fixed horizon.duration")
        return
    if task.method.grid == "phases":
        if not (0 < time < duration if inside else 0 <= time <= duration):
            yield conflict(key, f"found {time:g}, expected a time {'between' if inside else 'from'} 0 "
                           f"{'and' if inside else 'to'} {duration:g} s")  # fmt: skip
        return
    length = duration / intervals
    first, last = (1, intervals - 1) if inside else (0, intervals)
    if not (first - WRITTEN_NODE) * length <= time <= (last + WRITTEN_NODE) * length:
        bounds = f"from {first * length:.6g} to {last * length:.6g} s"
        yield conflict(key, f"found {time:g}, expected the end of a control interval {bounds}")
    elif abs(time / length - round(time / length)) > WRITTEN_NODE:
        below = int(time / length)
        nearby = " or ".join(f"{end * length:.6g}" for end in (below, below + 1) if first <= end <= last)
        yield conflict(key, f"found {time:g}, expected the end of a control interval; the nearest are {nearby} s")
