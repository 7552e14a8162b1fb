"""Changes of what a contact does for a while: a run left out, swapped or interrupted, an impact that is all of it."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from itertools import groupby

from fesd_robot.fesd.neighbours.changes import Change
from fesd_robot.fesd.neighbours.contact_conditions import ActiveSet, ContactConditions
from fesd_robot.fesd.neighbours.patterns import ActiveRun, Pattern
from fesd_robot.fesd.neighbours.placing import Placing
from fesd_robot.fesd.neighbours.switches import SwitchKind, kind_of_run

SHORT_RUN = 3
"""A run of at most so many intervals may be left out between two different modes, or at an end of the motion."""

LEAST_STANCE = 3
"""A flight may be inserted into a contact of at least so many intervals: the third in the middle, or its beginning."""


def without_run(contact: ContactConditions, runs: Sequence[ActiveRun]) -> Iterator[Change]:
    """Yield the changes that leave one run out; the first and the last, which have one neighbour, if they are short."""
    for n, run in enumerate(runs):
        neighbours = [other.active for other in (*runs[max(n - 1, 0) : n], *runs[n + 1 : n + 2])]
        short = run.last - run.first < SHORT_RUN
        same = len(neighbours) == 2 and neighbours[0] == neighbours[1]
        for active in sorted(set(neighbours), key=str) if same or short else ():
            patterns = dict.fromkeys(range(run.first, run.last + 1), (active,))
            what = f"no {kind_of_run(contact, run.active)} of {contact.in_words} in intervals {run.first} to {run.last}"
            yield Change(what, [(contact, patterns)])


def swapped(contact: ContactConditions, runs: Sequence[ActiveRun]) -> Iterator[Change]:
    """Yield the changes of one mode with contact into another one."""
    closed = sorted({run.active for run in runs if not contact.is_flight(run.active)}, key=str)
    for run in runs:
        for active in closed:
            if active != run.active and not contact.is_flight(run.active):
                what = (
                    f"{SwitchKind.STICK_OR_SLIP} of {contact.in_words} swapped in intervals {run.first} to {run.last}"
                )
                patterns = dict.fromkeys(range(run.first, run.last + 1), (active,))
                yield Change(what, [(contact, patterns)])


def with_flight(contact: ContactConditions, runs: Sequence[ActiveRun]) -> Iterator[Change]:
    """Yield the changes that interrupt a contact by a flight."""
    flight = next((run.active for run in runs if contact.is_flight(run.active)), contact.flight)
    for run in runs:
        if not _may_be_interrupted(contact, run):
            continue
        count = run.last - run.first + 1
        own = range(run.first + count // 3, run.last + 1 - count // 3)
        what = f"flight of contact '{contact.name}' in intervals {own[0]} to {own[-1]} inserted"
        yield Change(what, [(contact, dict.fromkeys(own, (flight,)))])


def begun_in_flight(contact: ContactConditions, runs: Sequence[ActiveRun], placing: Placing) -> Iterator[Change]:
    """Yield the changes in which a motion that begins with a contact begins with a flight that ends with an impact.

    A leg that is pulled in first lets its robot fall into a crouch. The flight takes the first interval and a part of
    the second one; where the contact does not move along the ground the impact slips to either side.

    Args:
        contact: its conditions.
        runs: of the contact.
        placing: the point.
    """
    run = runs[0]
    if not _may_be_interrupted(contact, run):
        return
    for impact in contact.impacts(run.active, *placing.end_of(run.first)):
        patterns = {run.first: (contact.flight,), run.first + 1: (contact.flight, *impact, run.active)}
        what = f"flight of contact '{contact.name}' from the beginning to interval {run.first + 1}"
        yield Change(what, [(contact, patterns)])


def _may_be_interrupted(contact: ContactConditions, run: ActiveRun) -> bool:
    """Whether a run is a contact that is long enough for a flight."""
    return not contact.is_joint and not contact.is_flight(run.active) and run.last - run.first + 1 >= LEAST_STANCE


def bouncing(contact: ContactConditions, patterns: Sequence[Pattern], runs: Sequence[ActiveRun]) -> Iterator[Change]:
    """Yield the changes in which nothing but the impact is left of a contact between two flights."""
    for before, run, after in zip(runs, runs[1:], runs[2:], strict=False):
        hit = [k for k in range(before.last, run.last + 1) if any(map(contact.is_impact, patterns[k]))]
        if not hit or contact.is_flight(run.active) or before.active != after.active:
            continue
        flying = {
            k: tuple(
                active
                for active, _ in groupby(after.active if active == run.active else active for active in patterns[k])
            )
            for k in range(run.first, run.last + 1)
        }
        what = f"only a bounce of {contact.in_words} in intervals {run.first} to {run.last}"
        yield Change(what, [(contact, flying)])


def slipping_the_other_way(
    contact: ContactConditions, patterns: Sequence[Pattern], runs: Sequence[ActiveRun]
) -> Iterator[Change]:
    """Yield the changes in which a contact slips to the other side in an impact, or also as long as it does after it.

    A trial cannot turn the side itself: the impulse, at the edge of its cone, would have to cross it.
    """
    for k, pattern in enumerate(patterns):
        impacts = set(filter(contact.is_impact, pattern))
        if (other := _mirrored(contact, pattern, impacts)) == pattern:
            continue
        what = f"impact of {contact.in_words} in interval {k} slipping the other way"
        yield Change(what, [(contact, {k: other})])
        after = next(
            (run for run in runs if run.first - 1 <= k <= run.last and not contact.is_flight(run.active)), None
        )
        if after and contact.mirrored(after.active) != after.active:
            slipping = range(min(k, after.first), after.last + 1)
            turned = {at: _mirrored(contact, patterns[at], {*impacts, after.active}) for at in slipping}
            yield Change(f"{what}, and after it", [(contact, turned)])


def _mirrored(contact: ContactConditions, pattern: Pattern, turned: Collection[ActiveSet]) -> Pattern:
    """Return a pattern some of whose modes slip to the other side."""
    return tuple(contact.mirrored(active) if active in turned else active for active in pattern)
