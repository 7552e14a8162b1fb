"""A plan in five sentences: goal, contacts, effort, forces, and whether it ends at rest."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from fesd_robot.exactness import ROUNDED, WRITTEN
from fesd_robot.plans.outcome import LOWEST_JUMP, ContactOutcome, GoalEntry
from fesd_robot.plans.plan import Plan
from fesd_robot.task import DEFAULT_TOLERANCE

NAMED_MISSES, NAMED_CONTACTS, NAMED_EVENTS = 3, 4, 3
"""So many missed values, contacts, and flights or slides of a contact are named one by one."""

AT_LIMIT = 0.999
"""Share of its limit from which on a control is at it."""

REACHED = "The goal is reached"

SMALLEST_FORCE = 1e-6
"""N; less is round-off."""

_NUMBERS = ("no", "one", "two", "three", "four", "five", "six")


def sentences(plan: Plan) -> list[str]:
    """Summarise a plan, a sentence each; the second has one part for every contact.

    Of a motion that breaks the laws of the audit the first sentence says so, for the others describe it as it is.
    """
    return [
        goal_sentence(plan),
        contact_sentence(plan),
        effort_sentence(plan),
        force_sentence(plan),
        rest_sentence(plan),
    ]


def goal_sentence(plan: Plan) -> str:
    """Return whether the goal is reached, or by how much it is missed, and whether by a motion that is valid."""
    sentence = _goal(plan)
    broken = [name for name in plan.audit.violations if name != "max_goal_violation"]
    if not broken:
        return sentence
    more = [f"{len(broken) - NAMED_MISSES} more"] if len(broken) > NAMED_MISSES else []
    limits = f"limits of the audit ({_list([*broken[:NAMED_MISSES], *more])})"
    if sentence.startswith(REACHED):
        return f"No valid motion was found: this one ends at its goal, but breaks {limits}."
    return f"No valid motion was found: this one breaks {limits}; {_lower(sentence)}"


def _goal(plan: Plan) -> str:
    if plan.outcome is None:
        return "Whether the goal is reached is not recorded in this plan."
    entries = plan.outcome.goal
    hard = [entry for entry in entries if entry.met is not None]
    missed = [entry for entry in hard if not entry.met]
    if missed:
        missed.sort(key=lambda entry: -_share(entry))
        parts = [
            f"{entry.name} ends at {entry.end:.4g} {entry.unit}, {entry.missed_by:.3g} {entry.unit} from "
            f"{entry.goal:.4g} {entry.unit} ({entry.tolerance:g} {entry.unit} allowed)"
            for entry in missed[:NAMED_MISSES]
        ]
        more = [f"{len(missed) - NAMED_MISSES} more values are missed"] if len(missed) > NAMED_MISSES else []
        return f"The goal is missed: {_list([*parts, *more])}."
    soft = [entry for entry in entries if entry.met is None]
    if hard:
        count = _count(len(hard), "value")
        with_room = [entry for entry in hard if entry.tolerance]
        if not with_room:
            largest = max(entry.missed_by for entry in hard)
            return f"{REACHED}: of {count} none is missed by more than {largest:.1g}."
        nearest = max(with_room, key=_share)
        return (
            f"{REACHED}: {count} within tolerance; {nearest.name} uses most of it, {nearest.missed_by:.2g} of "
            f"{nearest.tolerance:g} {nearest.unit}."
        )
    if soft:
        worst = [*plan.outcome.largest_misses("position"), *plan.outcome.largest_misses("velocity")]
        misses = _list([f"{entry.missed_by:.3g} {entry.unit} ({entry.name})" for entry in worst])
        return f"The goal is soft, without a tolerance: the motion ends away from it by {misses}."
    return "The task lists no value that its motion should reach."


def contact_sentence(plan: Plan) -> str:
    """Return when and how far every contact flies and slides."""
    duration = f"The motion takes {float(plan.trajectory.time[-1]):.4g} s"
    if not plan.contacts:
        return f"{duration} and has no contacts."
    if plan.outcome is None:
        counts = [
            f"{name} with {sum(each.contact == name for each in plan.switches)} switches" for name in plan.contacts
        ]
        return f"{duration}; its contacts are {_list(counts)}."
    contacts = plan.outcome.contacts
    parts = [f"{name} {_doings(contact)}" for name, contact in list(contacts.items())[:NAMED_CONTACTS]]
    if len(contacts) > NAMED_CONTACTS:
        parts.append(f"of {len(contacts) - NAMED_CONTACTS} more contacts see below")
    return f"{duration}: {'; '.join(parts)}."


def _doings(contact: ContactOutcome) -> str:
    """Return flights and slides of a contact with times and distances."""
    high = [each for each in contact.flights if each.height > LOWEST_JUMP]
    low = [each for each in contact.flights if each.height <= LOWEST_JUMP]
    flights = [
        f"{'in the air ' if each.open_start else ''}from {each.start:.3g} to {each.end:.3g} s over {each.length:.3g} m "
        f"(gap up to {each.height:.3g} m)"
        for each in high
    ]
    hovers = [f"from {each.start:.3g} to {each.end:.3g} s (gap up to {each.height:.1g} m)" for each in low]
    slides = [f"from {each.start:.3g} to {each.end:.3g} s over {each.distance:.3g} m" for each in contact.slides]
    pushes = [
        f"from {each.start:.3g} to {each.end:.3g} s with up to {each.force:.3g} N, {each.depth:.3g} m deep"
        for each in contact.pushes
    ]
    parts = [
        _all_or_sum("pushes", pushes, []),
        _all_or_sum("flies", flights, [each.length for each in high]),
        _all_or_sum("is unloaded just above its surface", hovers, []),
        _all_or_sum("slides", slides, [each.distance for each in contact.slides]),
    ]
    doings = [part for part in parts if part]
    if not slides and not pushes:
        doings.append("does not slide")
    if not contact.flights:
        doings.insert(0, "never leaves its surface")
    return f"{', '.join(doings[:-1])}, and {doings[-1]}" if len(doings) > 1 else doings[0]


def _all_or_sum(verb: str, events: Sequence[str], distances: Sequence[float]) -> str:
    """Return events one by one, of many only how many and how far; empty if there are none."""
    if len(events) <= NAMED_EVENTS:
        return f"{verb} {_list(events)}" if events else ""
    length = f", {sum(distances):.3g} m in all and {max(distances):.3g} m at most" if distances else ""
    return f"{verb} {len(events)} times{length}"


class ControlPeak(NamedTuple):
    """A control that is constant from `start` to `end`, s, at `value`, with the limit on its side, None if unknown."""

    name: str
    value: float
    start: float
    end: float
    limit: float | None

    @property
    def share(self) -> float:
        """Part of the limit that is used; zero where there is none."""
        return self.value / self.limit if self.limit else 0.0


def control_peaks(plan: Plan) -> list[ControlPeak]:
    """Return of every control the interval in which it uses most of its limit, or is largest if that is unknown."""
    if not plan.controls:
        return []
    starts = plan.controls["time"]
    ends = np.append(starts[1:], max(float(plan.trajectory.time[-1]), float(starts[-1])))
    found = []
    for name, values in plan.controls.items():
        if name == "time":
            continue
        limits = limits_of_controls(plan).get(name)
        all_of_it = [
            ControlPeak(name, float(value), float(start), float(end), _limit_on_the_side(float(value), limits))
            for value, start, end in zip(values, starts, ends, strict=True)
        ]
        found.append(max(all_of_it, key=lambda each: (each.share, abs(each.value))))
    return found


def limits_of_controls(plan: Plan) -> dict[str, tuple[float, float]]:
    """Return the limits of every control; those that the task gives where the plan does not record them."""
    if plan.control_limits is not None:
        return plan.control_limits
    found = {name: (bounds[0], bounds[1]) for name, bounds in (plan.task["limits"].get("effort") or {}).items()}
    for name, actuator in (plan.task["robot"].get("actuators") or {}).items():
        if actuator.get("lower") is not None and actuator.get("upper") is not None:
            found[name] = (actuator["lower"], actuator["upper"])
    return {name: bounds for name, bounds in found.items() if name in plan.controls}


def _limit_on_the_side(value: float, limits: Sequence[float] | None) -> float | None:
    if limits is None:
        return None
    limit = limits[1] if value >= 0 else limits[0]
    # A limit of zero is no measure of what is used.
    return limit if math.isfinite(limit) and limit * value > 0 else None


def effort_sentence(plan: Plan) -> str:
    """Return the control that uses most of its limit, when, and which ones are at it."""
    found = control_peaks(plan)
    if not found:
        return "The task has no controls."
    unit = plan.units.controls
    limited = [each for each in found if each.limit is not None]
    if not limited:
        why = "without a limit on that side" if limits_of_controls(plan) else "this plan does not record the limits"
        largest = {unit.get(each.name, ""): each for each in sorted(found, key=lambda each: abs(each.value))}
        parts = [f"{each.value:.3g} {name} of {each.name} from {_span(each)}" for name, each in largest.items()]
        verb = "efforts are" if len(parts) > 1 else "effort is"
        return f"The largest {verb} {_list(parts)} ({why})."
    most = max(limited, key=lambda each: each.share)
    words = (
        f"{most.name} works hardest: {most.value:.3g} {unit.get(most.name, '')} from {_span(most)}, "
        f"{_percent(most.share)} of its limit"
    )
    at_limit = [each.name for each in limited if each.share >= AT_LIMIT and each is not most]
    if not at_limit:
        return f"{words}."
    return f"{words}; {_list(at_limit)} {'reach their limits' if len(at_limit) > 1 else 'reaches its limit'}, too."


def force_sentence(plan: Plan) -> str:
    """Return the largest contact force and the hardest impact, where and when."""
    if not plan.contacts:
        return "There are no contact forces."
    time = plan.trajectory.time
    peaks = []
    for name, contact in plan.contacts.items():
        sizes = np.hypot(contact.normal_force, contact.friction)
        if np.isfinite(sizes).any():
            sample = int(np.nanargmax(sizes))
            peaks.append((float(sizes[sample]), name, float(time[sample]), float(contact.normal_force[sample])))
    size, name, moment, normal = max(peaks, default=(0.0, "", 0.0, 0.0))
    if size < SMALLEST_FORCE:
        words = "No contact carries a force"
    else:
        words = f"The largest contact force is {size:.3g} N ({normal:.3g} N of it normal), on {name} at {moment:.3g} s"
    if not plan.impulses:
        return f"{words}; there is no impact."
    hardest = max(plan.impulses, key=lambda impulse: impulse.normal)
    several = f"the hardest of {_count(len(plan.impulses), 'impact')}" if len(plan.impulses) > 1 else "the only impact"
    place = f"of {hardest.contact} at {hardest.time:.3g} s"
    return f"{words}; {several}, {place}, has a normal impulse of {hardest.normal:.3g} N s."


def rest_sentence(plan: Plan) -> str:
    """Say whether the motion ends at rest, or else the velocities that are left."""
    ends = {name: float(values[-1]) for name, values in plan.trajectory.velocity.items()}
    fastest: dict[str, str] = {}
    for name in sorted(ends, key=lambda name: -abs(ends[name]) if math.isfinite(ends[name]) else -math.inf):
        fastest.setdefault(plan.units.velocity.get(name, ""), name)
    words = _list([f"{abs(ends[name]):.2g} {unit} ({name})" for unit, name in fastest.items()])
    if not ends:
        return "The motion has no velocities."
    if all(abs(speed) <= DEFAULT_TOLERANCE * (1 + WRITTEN) for speed in ends.values()):
        return f"It ends at rest: nothing is faster than {words}."
    return f"It does not end at rest: the fastest are {words}."


def _share(entry: GoalEntry) -> float:
    """Return a miss in units of its tolerance."""
    share = entry.missed_by / max(entry.tolerance or 0.0, ROUNDED)
    return share if math.isfinite(share) else math.inf


def _span(effort: ControlPeak) -> str:
    return f"{effort.start:.3g} to {effort.end:.3g} s"


def _percent(share: float) -> str:
    return "all" if share >= AT_LIMIT else f"{100 * share:.0f} %"


def _count(number: int, noun: str) -> str:
    word = _NUMBERS[number] if number < len(_NUMBERS) else str(number)
    return f"{word} {noun}" + ("" if number == 1 else "s")


def _list(parts: Iterable[str]) -> str:
    """Return parts as in a sentence: ``a, b and c``."""
    *first, last = parts
    return f"{', '.join(first)} and {last}" if first else last


def _lower(sentence: str) -> str:
    return sentence[0].lower() + sentence[1:]
