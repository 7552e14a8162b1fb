"""An outcome in a few words, for the terminal, the page and the gallery."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from fesd_robot.plans.outcome import ContactOutcome, GoalEntry, Outcome


def goal_words(outcome: Outcome) -> str:
    """Return the largest misses of position and velocity, one a unit, and which tolerances are not kept."""
    parts = [
        f"{kind} missed by {misses}"
        for kind in ("position", "velocity")
        if (misses := ", ".join(f"{_miss(entry)} ({entry.name})" for entry in outcome.largest_misses(kind)))
    ]
    missed = [entry.name for entry in outcome.goal if entry.met is False]
    return "; ".join([*parts, *(["outside the tolerance: " + ", ".join(missed)] if missed else [])])


def miss_words(outcome: Outcome, kind: Literal["position", "velocity"]) -> str:
    """Return the largest misses of one kind, e.g. ``0.081 m, 0.3 rad``; empty if the goal has none of it."""
    return ", ".join(_miss(entry) for entry in outcome.largest_misses(kind))


def contact_words(contact: ContactOutcome) -> str:
    """Return number, length and gap of the flights, number and distance of the slides, number of impacts.

    Of a contact that is compressed the number, force and depth of its pushes in place of slides and impacts.
    """
    if contact.pushes:
        force, depth = max(one.force for one in contact.pushes), max(one.depth for one in contact.pushes)
        noun = "push" if len(contact.pushes) == 1 else "pushes"
        return f"{flight_words([contact])}; {len(contact.pushes)} {noun}, up to {force:.3g} N, {depth:.3g} m deep"
    return "; ".join([flight_words([contact]), _slides(contact), count(len(contact.impacts), "impact")])


def flight_words(contacts: Sequence[ContactOutcome]) -> str:
    """Return the number of all flights of some contacts, and the greatest length and gap."""
    flights = [flight for contact in contacts for flight in contact.flights]
    if not flights:
        return "no flight"
    length, height = max(flight.length for flight in flights), max(flight.height for flight in flights)
    up_to = "up to " if len(flights) > 1 else ""
    return f"{count(len(flights), 'flight')}, {up_to}{length:.3g} m long, gap up to {height:.3g} m"


def _slides(contact: ContactOutcome) -> str:
    if not contact.slides:
        return "no slide"
    together = " in all" if len(contact.slides) > 1 else ""
    return f"{count(len(contact.slides), 'slide')}, {contact.slide_distance:.3g} m{together}"


def _miss(entry: GoalEntry) -> str:
    return f"{entry.missed_by:.3g} {entry.unit}"


def count(number: int, noun: str) -> str:
    """Return a number with its noun, ``1 impact`` or ``2 impacts``."""
    return f"{number} {noun}" + ("" if number == 1 else "s")
