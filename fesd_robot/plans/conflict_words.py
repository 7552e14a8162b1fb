"""The conflicting constraints of a task that was not solved, in words."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Mapping

from fesd_robot.mpcc import Conflict, Demand
from fesd_robot.plans.measured import Names

_MOST_NAMED = 4
"""How many limits and goals are named."""

_LEAST_SHARE = 0.05
"""They are named if their price is at least this part of the largest."""

_GAP = " integrated gap"
"""End of the name of the state that is zero while a contact is closed."""

_VELOCITY = " velocity"
"""End of the name of the state that is a velocity."""


def conflict_words(conflict: Conflict, names: Names, intervals: int, friction_coordinates: Collection[str] = ()) -> str:
    """Name the limits, goals and contacts in conflict, and their intervals; empty if none is named.

    Args:
        conflict: at the least violated point.
        names: of contacts, coordinates and controls.
        intervals: N.
        friction_coordinates: velocity coordinates with dry friction, which may hold their velocity at zero or on one
            side of it.
    """
    prices: dict[str, float] = defaultdict(float)
    places: dict[str, set[int]] = defaultdict(set)
    contacts: set[str] = set()
    for demand in conflict.demands:
        label, interval = demand.label, demand.label.place.interval
        contact = label.subject.removesuffix(_GAP)
        is_gap = label.kind == "state" and label.subject.endswith(_GAP) and contact in names.contacts
        joint = label.subject.removesuffix(_VELOCITY)
        is_velocity = label.kind == "state" and joint != label.subject
        is_held = is_velocity and joint in friction_coordinates and demand.bound == 0
        closed = f"contact '{contact}' on the ground" if is_gap else ""
        closed = f"dry friction of joint '{joint}'" if is_held else closed
        what = closed or _demanded(demand, names, intervals)
        if what and interval is not None:
            prices[what] += demand.price
            places[what].add(interval)
            contacts |= {closed} if closed else set()
    limits = sorted(set(prices) - contacts, key=lambda what: -prices[what])
    named = [what for what in limits if prices[what] >= _LEAST_SHARE * prices[limits[0]]][:_MOST_NAMED]
    if not named:
        return ""
    words = [what if what.startswith("the goal") else f"{what} in {interval_numbers(places[what])}" for what in named]
    return ", ".join([*words, *(f"{what} in {interval_numbers(places[what])}" for what in sorted(contacts))])


def _demanded(demand: Demand, names: Names, intervals: int) -> str:
    """Describe a bound in the words of the task; empty for those that belong to the method."""
    name, interval = demand.label.subject, demand.label.place.interval
    units = {**names.configuration, **{f"{name} velocity": unit for name, unit in names.velocity.items()}}
    kinds: dict[str, Mapping[str, str]] = {"state": units, "control": names.controls}
    unit = kinds.get(demand.label.kind, {}).get(name)
    if unit is None:
        return ""
    words = f"{name} {'at most' if demand.upper else 'at least'} {demand.bound:.4g} {unit}".rstrip()
    return f"the goal {words}" if demand.label.kind == "state" and interval == intervals - 1 else words


def interval_numbers(intervals: set[int]) -> str:
    """Return numbers of intervals, neighbouring ones as ranges."""
    ranges: list[list[int]] = []
    for k in sorted(intervals):
        if ranges and k == ranges[-1][-1] + 1:
            ranges[-1].append(k)
        else:
            ranges.append([k])
    words = [str(one[0]) if len(one) == 1 else f"{one[0]} to {one[-1]}" for one in ranges]
    return ("interval " if len(intervals) == 1 else "intervals ") + " and ".join(words)
