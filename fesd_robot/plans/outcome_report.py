"""The section of a report that says what came of the motion."""

from __future__ import annotations

from collections.abc import Iterator

from fesd_robot.plans.outcome import ContactOutcome, Flight, GoalEntry, Outcome, Push
from fesd_robot.plans.tables import markdown_table


def outcome_section(outcome: Outcome) -> str:
    """Return goal, end and miss of every goal, a summary of every contact, and all flights and slides in a table."""
    parts = [
        "## Outcome\n",
        markdown_table(["goal for", "goal", "end", "missed by", "tolerance", "met"], list(map(_goal, outcome.goal))),
    ]
    if outcome.contacts:
        header = ["contact", "flights", "longest [m]", "largest gap [m]", "slides", "longest [m]", "all [m]"]
        rows = [_contact(name, contact) for name, contact in outcome.contacts.items()]
        parts.append(markdown_table([*header, "impacts", "hardest [N s]"], rows))
    events = [event for name, contact in outcome.contacts.items() for event in _events(name, contact)]
    if events:
        header = ["contact", "", "from [s]", "to [s]", "length or distance [m]", "largest gap [m]"]
        parts.append(markdown_table(header, events))
    return "\n".join(parts)


def _goal(entry: GoalEntry) -> list[str]:
    numbers = [f"{value:.6g} {entry.unit}" for value in (entry.goal, entry.end)]
    tolerance = "none given" if entry.tolerance is None else f"{entry.tolerance:g} {entry.unit}"
    met = {True: "yes", False: "no", None: ""}[entry.met]
    return [entry.name, *numbers, f"{entry.missed_by:.3g} {entry.unit}", tolerance, met]


def _contact(name: str, contact: ContactOutcome) -> list[str]:
    return [
        name,
        str(len(contact.flights)),
        _largest([flight.length for flight in contact.flights]),
        _largest([flight.height for flight in contact.flights]),
        str(len(contact.slides)),
        _largest([slide.distance for slide in contact.slides]),
        _number(contact.slide_distance),
        str(len(contact.impacts)),
        _largest([impact.normal_impulse for impact in contact.impacts]),
    ]


def _events(name: str, contact: ContactOutcome) -> Iterator[list[str]]:
    for flight in contact.flights:
        times = [f"{flight.start:.6f}", f"{flight.end:.6f}"]
        yield [name, f"flight{_cut(flight)}", *times, _number(flight.length), _number(flight.height)]
    for push in contact.pushes:
        times = [f"{push.start:.6f}", f"{push.end:.6f}"]
        yield [name, f"push of up to {_number(push.force)} N{_cut(push)}", *times, "", _number(-push.depth)]
    for slide in contact.slides:
        yield [name, "slide", f"{slide.start:.6f}", f"{slide.end:.6f}", _number(slide.distance), ""]


def _cut(one: Flight | Push) -> str:
    ends = [end for end, cut in (("start", one.open_start), ("end", one.open_end)) if cut]
    return f", cut by the {' and the '.join(ends)} of the motion" if ends else ""


def _largest(values: list[float]) -> str:
    return _number(max(values)) if values else ""


def _number(value: float) -> str:
    return f"{value:.4g}"
