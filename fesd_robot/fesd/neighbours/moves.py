"""Moves from a branch to its neighbours: switches earlier or later, with an impact or without, or a run left out."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain, combinations, pairwise

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.fesd.neighbours.changes import Change
from fesd_robot.fesd.neighbours.contact_conditions import ContactConditions
from fesd_robot.fesd.neighbours.patterns import Pattern, intervals_of, pattern_of, runs_of
from fesd_robot.fesd.neighbours.placing import Placing
from fesd_robot.fesd.neighbours.runs import (
    begun_in_flight,
    bouncing,
    slipping_the_other_way,
    swapped,
    with_flight,
    without_run,
)
from fesd_robot.fesd.neighbours.shifts import EARLIER, LATER, TWO_EARLIER, TWO_LATER, Shift
from fesd_robot.fesd.neighbours.switches import Switch, SwitchKind, kind_of_run, switches_of, without_impacts
from fesd_robot.fesd.polishing import BranchMotion, with_impulses, without_impulses

PAIR = 2
"""Contacts of a pair. Where more than two switch alike, pairs of them move, too, as the hind feet of a quadruped; and
where there are more contacts than a pair, those that move together come before single ones, which seldom gain then."""

NEAR_INTERVALS = 1
"""Intervals between switches of several contacts that move together, exchange places, or share their impacts."""

_Slides = Mapping[tuple[str, int], Switch]
"""Name of a contact and number of one of its switches -> the next one, if both are between stick and slip."""


@dataclass(frozen=True)
class Move:
    """A neighbour of a branch.

    Attributes:
        what: is moved, and how, in words.
        intervals: in which something changes.
        placing: the neighbour, and the elements from which to look for its motion.
    """

    what: str
    intervals: range
    placing: Placing

    @property
    def branch(self) -> Branch:
        """The neighbour."""
        return self.placing.branch

    @cached_property
    def w(self) -> np.ndarray:
        """Where to start looking for its motion, (n)."""
        return self.placing.transcription.pack(self.placing.elements)


def moves(motion: BranchMotion) -> Iterator[Move]:
    """Yield the neighbours of a branch, contact by contact and switch by switch in time order.

    - A switch between two modes that lies on the boundary of two control intervals moves to the boundary before, the
      one after, or into one of the two intervals; one inside an interval moves into the interval before or after, or
      to one of its boundaries.
    - Contacts that switch alike at different places, at most an interval apart, exchange these: where one foot lands
      with an impact and the other softly, the other one gets the impact.
    - Both ends of a flight, or of a contact, move an interval earlier or later; so do the touchdowns, or the take-offs,
      of several contacts that happen at most an interval apart, and all switches of several contacts that happen at
      once, as a block begins to slide where a pusher meets it, or at most an interval apart. Where one of them is hit
      and moves to the end of the next interval, the others switch there after its impact, or as it begins.
    - What begins and ends in one interval, a bounce (an impact between two flights) or a short mode, moves into the
      interval before or after, alone or with switches of other contacts at most an interval away.
    - Where switches of several contacts move together and one of them begins a slide, its end moves with them, too: a
      puck that is hit earlier stops earlier.
    - A touchdown that moves into an interval gets an impact, one that moves to a boundary has none; one that stays on a
      boundary, with a switch of another contact at most an interval away, gets an impact, before what the other one
      does there or after it, or loses the one it has: a foot may take off as the other one is hit, or just before.
      Where it comes down without moving along the ground, an impact slips to either side.
    - A mode between two that are the same, or a short one between two others or at an end, is left out.
    - A long contact is interrupted by a flight.
    - A mode with contact becomes another one with contact that the contact has elsewhere: stick, or slip.
    - Last, for they seldom gain: both ends of a flight move, one of them two intervals; of a contact between flights
      only the impact is left; an impact slips to the other side, alone or with the slip after it; a motion that begins
      with a contact begins with a flight.
    - A joint with dry friction is moved as a contact is that never flies: it sticks or slides.

    Args:
        motion: of a collocation scheme.
    """
    transcription, conditions = motion.transcription, motion.polisher.conditions
    branch = without_impulses(conditions, motion.branch)
    placing, intervals = Placing(transcription, motion.elements, branch), intervals_of(transcription.elements)
    contacts = ContactConditions.of(conditions, branch)
    patterns = [[pattern_of(contact, branch, own) for own in intervals] for contact in contacts]
    runs = [runs_of(contact, own) for contact, own in zip(contacts, patterns, strict=True)]
    switches = [switches_of(*one, placing) for one in zip(contacts, patterns, runs, strict=True)]
    slides = _slides(switches)
    changes, seldom, begun = list[Change](), list[Change](), list[Change]()
    for contact, own, of_contact, shifts in zip(contacts, patterns, runs, switches, strict=True):
        others = [switch for every in switches if every is not shifts for switch in every]
        within = [change for one in _within(contact, own) for change in _shifted_within(one, others, slides)]
        changes += [*_shifted(shifts, {other.interval for other in others}), *_shifted_runs(shifts), *within]
        changes += [*without_run(contact, of_contact), *swapped(contact, of_contact), *with_flight(contact, of_contact)]
        seldom += [*_longer_and_shorter_flights(shifts), *bouncing(contact, own, of_contact)]
        seldom += slipping_the_other_way(contact, own, of_contact)
        begun += begun_in_flight(contact, of_contact, placing)
    together = [*_shifted_together(switches, slides), *_exchanged(switches)]
    ordered = [*together, *changes] if len(switches) > PAIR else [*changes, *together]
    for change in [*ordered, *seldom, *begun]:
        for neighbour in placing.placed(change.steps):
            impacts = with_impulses(conditions, neighbour.branch)
            yield Move(change.what, change.intervals, replace(neighbour, branch=impacts))


def _shifted(switches: Sequence[Switch], others: Collection[int]) -> Iterator[Change]:
    """Yield the changes that move one switch, or give it an impact on a boundary, or take that away.

    Without another contact that switches near by, an impact inside an interval, which may move to the boundary, is the
    same.

    Args:
        switches: of one contact.
        others: intervals in which others switch.
    """
    for switch in switches:
        for where, patterns in switch.choices.items():
            if where.stays and not any(abs(switch.interval - one) <= NEAR_INTERVALS for one in others):
                continue
            what = f"{switch.kind} of {switch.contact.in_words} in interval {switch.interval} {where}"
            yield Change(what, [(switch.contact, patterns)])


def _shifted_runs(switches: Sequence[Switch]) -> Iterator[Change]:
    """Yield the changes that move both ends of a run."""
    for begin, end in pairwise(switches):
        for where in (EARLIER, LATER):
            if patterns := _both(begin.choices.get(where), end.choices.get(where)):
                what = (
                    f"{begin.kind} and {end.kind} of {begin.contact.in_words} in intervals {begin.interval} "
                    f"and {end.interval} {where}"
                )
                yield Change(what, [(begin.contact, patterns)])


def _longer_and_shorter_flights(switches: Sequence[Switch]) -> Iterator[Change]:
    """Yield the changes that move both ends of a flight, one of them an interval farther than the other."""
    for begin, end in pairwise(switches):
        if (begin.kind, end.kind) != (SwitchKind.TAKE_OFF, SwitchKind.TOUCHDOWN):
            continue
        for one, two in ((EARLIER, TWO_EARLIER), (LATER, TWO_LATER)):
            for first, last in ((one, two), (two, one)):
                if patterns := _both(begin.places.get(first), end.places.get(last)):
                    what = (
                        f"{begin.kind} of {begin.contact.in_words} in interval {begin.interval} {first} and {end.kind} "
                        f"in interval {end.interval} {last}"
                    )
                    yield Change(what, [(begin.contact, patterns)])


def _both(one: Mapping[int, Pattern] | None, other: Mapping[int, Pattern] | None) -> Mapping[int, Pattern]:
    """Return the patterns of one contact after two changes; none if one of these is none, or they share an interval."""
    return {**one, **other} if one and other and not one.keys() & other.keys() else {}


def _within(contact: ContactConditions, patterns: Sequence[Pattern]) -> Iterator[Switch]:
    """Yield what begins and ends in one interval, an impact between two flights, or a mode, and where it may go."""
    flat = [without_impacts(contact, pattern) for pattern in patterns]
    for k, own in enumerate(flat):
        before, after = (flat[k - 1] if k else own)[-1:], (flat[k + 1] if k + 1 < len(flat) else own)[:1]
        if not (before and own and after):
            continue  # an interval with nothing but an impact
        within = own[own[:1] == before : len(own) - (own[-1:] == after)]
        bounces = len(own) < len(patterns[k]) and all(map(contact.is_flight, (*before, *own, *after)))
        if not within and not bounces:
            continue
        kind = SwitchKind.BOUNCE if bounces else kind_of_run(contact, within[0])
        choices = {
            where: {k: left, other: patterns[k]}
            for where, other, left in ((EARLIER, k - 1, after), (LATER, k + 1, before))
            if 0 <= other < len(patterns) and len(patterns[other]) == 1
        }
        yield Switch(contact, k, kind, k, True, choices)


def _shifted_within(one: Switch, others: Sequence[Switch], slides: _Slides) -> Iterator[Change]:
    """Yield the changes that move what begins and ends in one interval, alone or with what switches nearly at once.

    Args:
        one: that.
        others: switches of other contacts.
        slides: where what they begin ends.
    """
    for where, patterns in one.choices.items():
        what = f"{one.kind} of {one.contact.in_words} in interval {one.interval} {where}"
        yield Change(what, [(one.contact, patterns)])
    near = [other for other in others if abs(other.interval - one.interval) <= NEAR_INTERVALS]
    at_once = [other for other in near if other.interval == one.interval]
    for group in [at_once, near] if at_once != near else [near]:
        if group and len({other.contact.name for other in group}) == len(group):
            yield from _all_shifted([one, *group], one, slides)


def _slides(switches: Sequence[Sequence[Switch]]) -> _Slides:
    """Return the ends of what contacts do between two changes from stick to slip or back, by where it begins."""
    pairs = [
        (one, end) for own in switches for one, end in pairwise(own) if one.kind is end.kind is SwitchKind.STICK_OR_SLIP
    ]
    return {(begin.contact.name, begin.number): end for begin, end in pairs}


def _shifted_together(switches: Sequence[Sequence[Switch]], slides: _Slides) -> Iterator[Change]:
    """Yield the changes that move the same switch of several contacts, or all switches that happen nearly at once.

    Args:
        switches: of every contact.
        slides: where what they begin ends.
    """
    every, seen = [switch for own in switches for switch in own], set()
    for switch in every:
        near = [other for other in every if abs(other.interval - switch.interval) <= NEAR_INTERVALS]
        alike = [other for other in near if other.kind is switch.kind]
        at_once = [other for other in every if other.interval == switch.interval]
        pairs = combinations(alike, PAIR) if len(alike) > PAIR else ()
        for group in (alike, at_once, near, *map(list, pairs)):
            contacts = {other.contact.name for other in group}
            members = frozenset((other.contact.name, other.number) for other in group)
            if len(group) < 2 or len(contacts) < len(group) or members in seen:
                continue
            seen.add(members)
            yield from _all_shifted(group, switch, slides)


def _all_shifted(group: Sequence[Switch], first: Switch, slides: _Slides) -> Iterator[Change]:
    """Yield the changes that move all of some switches of different contacts, alone or with the end of a slide.

    How long a contact slides is decided by how fast it is: if the slide begins earlier, it ends earlier.

    Args:
        group: the switches.
        first: the one of them after which the changes are named.
        slides: where what they begin ends.
    """
    for where in first.choices:
        if not all(where in other.choices for other in group):
            continue
        what = f"{_in_words(group)} in interval {first.interval} {where}"
        steps = [(other.contact, other.choices[where]) for other in group]
        yield Change(what, steps)
        if where == LATER and (at_once := _as_impacts_begin(group)):
            yield Change(f"{what} at once", at_once)
        for n, begin in enumerate(group):
            end = slides.get((begin.contact.name, begin.number))
            if end and (patterns := _both(begin.choices[where], end.following(begin, where))):
                longer = [*steps[:n], (begin.contact, patterns), *steps[n + 1 :]]
                yield Change(f"{what}, and the end of the slide", longer)


def _as_impacts_begin(group: Sequence[Switch]) -> list[tuple[ContactConditions, Mapping[int, Pattern]]]:
    """Return the patterns in which contacts move an interval later where some of them are hit, and the others switch as
    these impacts begin; none if none is hit, or all are."""
    hit = [any(map(one.contact.is_impact, chain(*one.choices[LATER].values()))) for one in group]
    into = [one.choices.get(Shift.into(one.interval + 1)) for one in group]
    if all(hit) or not any(hit) or not all(own or is_hit for own, is_hit in zip(into, hit, strict=True)):
        return []
    chosen = [one.choices[LATER] if is_hit else own for one, own, is_hit in zip(group, into, hit, strict=True)]
    return [(one.contact, patterns) for one, patterns in zip(group, chosen, strict=True) if patterns]


def _exchanged(switches: Sequence[Sequence[Switch]]) -> Iterator[Change]:
    """Yield the changes in which contacts that switch alike, but not at the same place, switch where the others did."""
    every = [switch for own in switches for switch in own]
    alike: dict[tuple[SwitchKind, tuple[int, bool]], list[Switch]] = {}
    for switch in every:
        alike.setdefault((switch.kind, switch.place), []).append(switch)
    last_first = sorted(alike, key=lambda one: (one[0].value, one[1]), reverse=True)
    for (kind, place), (other_kind, other_place) in combinations(last_first, 2):
        if kind is not other_kind or place[0] - other_place[0] > 2 * NEAR_INTERVALS:
            continue
        own, others = alike[kind, place], alike[kind, other_place]
        moved = [(one, one.towards(other_place)) for one in own] + [(one, one.towards(place)) for one in others]
        steps = [(one.contact, patterns) for one, patterns in moved if patterns is not None]
        if len({contact.name for contact, _ in steps}) == len(moved):
            what = f"{_in_words([one for one, _ in moved])} in interval {own[0].interval} exchanged"
            yield Change(what, steps)


def _in_words(group: Sequence[Switch]) -> str:
    if len({switch.kind for switch in group}) == 1 and not any(switch.contact.is_joint for switch in group):
        contacts = [f"'{switch.contact.name}'" for switch in group]
        return f"{group[0].kind} of contacts {', '.join(contacts)}"
    return " and ".join(f"{one.kind} of {one.contact.in_words}" for one in group)
