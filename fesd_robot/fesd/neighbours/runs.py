"""Changes of what a contact does for a while: a run left out, swapped or interrupted, an impact that is all of it."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from itertools import groupby

from fesd_robot.fesd.neighbours.changes import Change
from fesd_robot.fesd.neighbours.contact_modes import ContactMode, ContactModes
from fesd_robot.fesd.neighbours.patterns import Pattern, Run
from fesd_robot.fesd.neighbours.placing import Placing
from fesd_robot.fesd.neighbours.switches import STICK_OR_SLIP

SHORT_RUN = 3
"""A run of at most so many intervals may be left out between two different modes, or at an end of the motion."""

LEAST_STANCE = 3
"""A flight may be inserted into a contact of at least so many intervals: the third in the middle, or its beginning."""


def without_run(modes: ContactModes, runs: Sequence[Run]) -> Iterator[Change]:
    """Yield the changes that leave one run out; the first and the last, which have one neighbour, if they are short."""
    for n, run in enumerate(runs):
        neighbours = [other.mode for other in (*runs[max(n - 1, 0) : n], *runs[n + 1 : n + 2])]
        short = run.last - run.first < SHORT_RUN
        same = len(neighbours) == 2 and neighbours[0] == neighbours[1]
        for mode in sorted(set(neighbours), key=str) if same or short else ():
            patterns = dict.fromkeys(range(run.first, run.last + 1), (mode,))
            kind = "flight" if modes.is_flight(run.mode) else STICK_OR_SLIP if modes.is_joint else "contact"
            what = f"no {kind} of {modes.in_words} in intervals {run.first} to {run.last}"
            yield Change((modes.name, n, "left out"), what, [(modes, patterns)])


def swapped(modes: ContactModes, runs: Sequence[Run]) -> Iterator[Change]:
    """Yield the changes of one mode with contact into another one."""
    closed = sorted({run.mode for run in runs if not modes.is_flight(run.mode)}, key=str)
    for n, run in enumerate(runs):
        for mode in closed:
            if mode != run.mode and not modes.is_flight(run.mode):
                what = f"{STICK_OR_SLIP} of {modes.in_words} swapped in intervals {run.first} to {run.last}"
                patterns = dict.fromkeys(range(run.first, run.last + 1), (mode,))
                yield Change((modes.name, n, "swapped"), what, [(modes, patterns)])


def with_flight(modes: ContactModes, runs: Sequence[Run]) -> Iterator[Change]:
    """Yield the changes that interrupt a contact by a flight."""
    flight = next((run.mode for run in runs if modes.is_flight(run.mode)), modes.flight)
    for n, run in enumerate(runs):
        if not _may_be_interrupted(modes, run):
            continue
        count = run.last - run.first + 1
        own = range(run.first + count // 3, run.last + 1 - count // 3)
        what = f"flight of contact '{modes.name}' in intervals {own[0]} to {own[-1]} inserted"
        yield Change((modes.name, n, "inserted"), what, [(modes, dict.fromkeys(own, (flight,)))])


def begun_in_flight(modes: ContactModes, runs: Sequence[Run], placing: Placing) -> Iterator[Change]:
    """Yield the changes in which a motion that begins with a contact begins with a flight that ends with an impact.

    A leg that is pulled in first lets its robot fall into a crouch. The flight takes the first interval and a part of
    the second one; where the contact does not move along the ground the impact slips to either side.

    Args:
        modes, runs: of the contact.
        placing: the point.
    """
    run = runs[0]
    if not _may_be_interrupted(modes, run):
        return
    for impact in modes.impacts(run.mode, *placing.end_of(run.first)):
        patterns = {run.first: (modes.flight,), run.first + 1: (modes.flight, *impact, run.mode)}
        what = f"flight of contact '{modes.name}' from the beginning to interval {run.first + 1}"
        yield Change((modes.name, 0, "begun in flight"), what, [(modes, patterns)], hit=True)


def _may_be_interrupted(modes: ContactModes, run: Run) -> bool:
    """Whether a run is a contact that is long enough for a flight."""
    return not modes.is_joint and not modes.is_flight(run.mode) and run.last - run.first + 1 >= LEAST_STANCE


def bouncing(modes: ContactModes, patterns: Sequence[Pattern], runs: Sequence[Run]) -> Iterator[Change]:
    """Yield the changes in which nothing but the impact is left of a contact between two flights."""
    for n, (before, run, after) in enumerate(zip(runs, runs[1:], runs[2:], strict=False)):
        hit = [k for k in range(before.last, run.last + 1) if any(map(modes.is_impact, patterns[k]))]
        if not hit or modes.is_flight(run.mode) or before.mode != after.mode:
            continue
        flying = {
            k: tuple(mode for mode, _ in groupby(after.mode if mode == run.mode else mode for mode in patterns[k]))
            for k in range(run.first, run.last + 1)
        }
        what = f"only a bounce of {modes.in_words} in intervals {run.first} to {run.last}"
        yield Change((modes.name, n, "only a bounce"), what, [(modes, flying)])


def slipping_the_other_way(modes: ContactModes, patterns: Sequence[Pattern], runs: Sequence[Run]) -> Iterator[Change]:
    """Yield the changes in which a contact slips to the other side in an impact, or also as long as it does after it.

    A trial cannot turn the side itself: the impulse, at the edge of its cone, would have to cross it.
    """
    for k, pattern in enumerate(patterns):
        impacts = set(filter(modes.is_impact, pattern))
        if (other := _mirrored(modes, pattern, impacts)) == pattern:
            continue
        what = f"impact of {modes.in_words} in interval {k} slipping the other way"
        yield Change((modes.name, k, "the other way"), what, [(modes, {k: other})])
        after = next((run for run in runs if run.first - 1 <= k <= run.last and not modes.is_flight(run.mode)), None)
        if after and modes.mirrored(after.mode) != after.mode:
            slipping = range(min(k, after.first), after.last + 1)
            turned = {at: _mirrored(modes, patterns[at], {*impacts, after.mode}) for at in slipping}
            yield Change((modes.name, k, "the other way"), f"{what}, and after it", [(modes, turned)])


def _mirrored(modes: ContactModes, pattern: Pattern, turned: Collection[ContactMode]) -> Pattern:
    """Return a pattern some of whose modes slip to the other side."""
    return tuple(modes.mirrored(mode) if mode in turned else mode for mode in pattern)
