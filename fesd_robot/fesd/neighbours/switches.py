"""Where the switches of a contact may go: an interval earlier or later, into an interval, or to its boundary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from itertools import pairwise, takewhile

from fesd_robot.fesd.neighbours.contact_conditions import ActiveSet, ContactConditions
from fesd_robot.fesd.neighbours.patterns import ActiveRun, Pattern
from fesd_robot.fesd.neighbours.placing import Placing
from fesd_robot.fesd.neighbours.shifts import (
    EARLIER,
    LATER,
    TO_BEGINNING,
    TO_END,
    TWO_EARLIER,
    TWO_LATER,
    WITH_IMPACT,
    WITHOUT_IMPACT,
    ImpactSide,
    Shift,
    ShiftKind,
)


class SwitchKind(Enum):
    """What a switch is, or what begins and ends in one interval."""

    TOUCHDOWN = "touchdown"
    TAKE_OFF = "take-off"
    STICK_OR_SLIP = "stick or slip"

    BOUNCE = "bounce"
    """An impact between two flights."""
    CONTACT = "contact"
    FLIGHT = "flight"

    def __str__(self) -> str:
        return str(self.value)


Choices = Mapping[Shift, Mapping[int, Pattern]]
"""Where a switch may go -> the patterns that the contact then has in some intervals."""


@dataclass(frozen=True)
class Switch:
    """A switch of a contact between two modes that are no impacts.

    Attributes:
        contact: its conditions.
        number: of the switch among those of the contact.
        kind: what it is.
        interval: in which the mode before it ends.
        inside: whether the mode after it begins there, too, rather than on the boundary to the next interval.
        choices: where it may go.
        two_away: the same, two intervals away, where it goes with another switch only.
    """

    contact: ContactConditions
    number: int
    kind: SwitchKind
    interval: int
    inside: bool
    choices: Choices
    two_away: Choices = field(default_factory=dict)

    @property
    def place(self) -> tuple[int, bool]:
        """Twice the number of its interval, one more on the boundary to the next, and whether with an impact there."""
        return 2 * self.interval + (not self.inside), WITHOUT_IMPACT in self.choices

    @property
    def places(self) -> Choices:
        """All of these."""
        return {**self.choices, **self.two_away}

    def towards(self, place: tuple[int, bool]) -> Mapping[int, Pattern] | None:
        """Return the patterns with which it is at the place of another switch; None if it may not go there."""
        steps = place[0] - self.place[0]
        into = Shift.into(self.interval + (steps > 0))
        near = (TO_BEGINNING, TO_END) if self.inside else (into, into)
        here = WITH_IMPACT if place[1] else WITHOUT_IMPACT
        where = {-2: EARLIER, -1: near[0], 0: here, 1: near[1], 2: LATER}.get(steps)
        return self.choices.get(where) if where else None

    def following(self, begin: Switch, where: Shift) -> Mapping[int, Pattern] | None:
        """Return the patterns with which this one follows an earlier switch that moves; None if it cannot.

        It moves by an interval where the other does, and where it lies inside one; else into the interval beside it.
        """
        earlier = where in (EARLIER, TO_BEGINNING, Shift.into(begin.interval))
        if not (earlier or where in (LATER, TO_END, Shift.into(begin.interval + 1))):
            return None
        if self.inside or where in (EARLIER, LATER):
            return self.choices.get(EARLIER if earlier else LATER)
        return self.choices.get(Shift.into(self.interval + (not earlier)))


def switches_of(
    contact: ContactConditions, patterns: list[Pattern], runs: list[ActiveRun], placing: Placing
) -> list[Switch]:
    """Return the switches of a contact in time order.

    Args:
        contact: its conditions.
        patterns: of the contact in every interval.
        runs: of the contact.
        placing: the point that the patterns are those of.
    """
    switches = []
    for number, (before, after) in enumerate(pairwise(runs)):
        inside = before.last == after.first
        if not inside:
            choices = _from_a_boundary(contact, patterns, before, after, placing)
        else:
            choices = _from_inside(contact, patterns, before, after)
        kind = _kind(contact, before.active, after.active)
        two_away = _two_away(contact, patterns, before, after, choices)
        switches.append(Switch(contact, number, kind, before.last, inside, choices, two_away))
    return switches


def _two_away(
    contact: ContactConditions,
    patterns: Sequence[Pattern],
    before: ActiveRun,
    after: ActiveRun,
    choices: Choices,
) -> Choices:
    """Return where a switch goes that moves by two intervals: what it leaves in the one between lasts through that."""
    two_away: dict[Shift, Mapping[int, Pattern]] = {}
    for one, two, step, left, passed in (
        (EARLIER, TWO_EARLIER, -1, before.active, after.active),
        (LATER, TWO_LATER, 1, after.active, before.active),
    ):
        if not (moved := choices.get(one)):
            continue
        at = (min if step < 0 else max)(moved)
        if not 0 <= at + step < len(patterns):
            continue
        if without_impacts(contact, patterns[at]) == patterns[at + step] == (left,):
            two_away[two] = {**moved, at: (passed,), at + step: moved[at]}
    return two_away


def _from_a_boundary(
    contact: ContactConditions, patterns: list[Pattern], before: ActiveRun, after: ActiveRun, placing: Placing
) -> Choices:
    """Return where a switch on the boundary of two intervals may go; an impact there goes with it."""
    k, following, a, b = before.last, after.first, before.active, after.active
    own, next_own = (without_impacts(contact, patterns[at]) for at in (k, following))
    ending, beginning = _impacts_between(contact, patterns[k], patterns[following])
    impact = (*ending, *beginning)
    choices: dict[Shift, dict[int, Pattern]] = {}
    if own == (a,):
        choices[EARLIER] = {k: (*impact, b), following: next_own}
    elif own[0] == a:
        choices[EARLIER] = {k: (b,)}
    if next_own == (b,):
        choices[LATER] = {k: own, following: (a, *impact)}
    elif next_own[-1] == b:
        choices[LATER] = {following: (a,)}
    for new, side in zip(_impacts(contact, a, b, k, placing), ImpactSide, strict=False):
        if own == (a,):
            choices[Shift.into(k, side)] = {k: (a, *new, b), following: next_own}
        if next_own == (b,):
            choices[Shift.into(following, side)] = {k: own, following: (a, *new, b)}
        if impact and side is ImpactSide.OTHER:
            continue  # the impact that is there has a side
        hit = impact or new
        if hit and not ending and own == (a,):
            choices[Shift(ShiftKind.WITH_IMPACT, side=side)] = {k: (a, *hit), following: next_own}
        if hit and not beginning and next_own == (b,):
            choices[Shift(ShiftKind.WITH_LATER_IMPACT, side=side)] = {k: own, following: (*hit, b)}
    if impact:
        choices[WITHOUT_IMPACT] = {k: own, following: next_own}
    return choices


def _from_inside(contact: ContactConditions, patterns: list[Pattern], before: ActiveRun, after: ActiveRun) -> Choices:
    """Return where a switch inside an interval may go, none if there is another one of this contact."""
    k, a, b = before.last, before.active, after.active
    if len(without_impacts(contact, patterns[k])) > 2:
        return {}
    choices: dict[Shift, dict[int, Pattern]] = {
        TO_BEGINNING: {k: (b,)},
        TO_END: {k: (a,)},
    }
    if k > 0 and patterns[k - 1] == (a,):
        choices[EARLIER] = {k - 1: patterns[k], k: (b,)}
    if k + 1 < len(patterns) and patterns[k + 1] == (b,):
        choices[LATER] = {k: (a,), k + 1: patterns[k]}
    return choices


def _impacts(
    contact: ContactConditions, a: ActiveSet, b: ActiveSet, interval: int, placing: Placing
) -> list[list[ActiveSet]]:
    """Return the modes of the impact between two modes, one list for each side to which the contact may slip in it; an
    empty one if it is no touchdown."""
    if not contact.is_flight(a) or contact.is_flight(b):
        return [[]]
    return contact.impacts(b, *placing.end_of(interval))


def _impacts_between(contact: ContactConditions, pattern: Pattern, following: Pattern) -> tuple[Pattern, Pattern]:
    """Return the modes of an impact that ends an interval, and those of one that begins the next."""
    ending = tuple(takewhile(contact.is_impact, reversed(pattern)))
    return ending[::-1], tuple(takewhile(contact.is_impact, following))


def without_impacts(contact: ContactConditions, pattern: Pattern) -> Pattern:
    """Return the modes of a pattern that are no impacts."""
    return tuple(active for active in pattern if not contact.is_impact(active))


def _kind(contact: ContactConditions, a: ActiveSet, b: ActiveSet) -> SwitchKind:
    """Return what a switch between two active sets is."""
    if contact.is_flight(a) == contact.is_flight(b):
        return SwitchKind.STICK_OR_SLIP
    return SwitchKind.TOUCHDOWN if contact.is_flight(a) else SwitchKind.TAKE_OFF


def kind_of_run(contact: ContactConditions, active: ActiveSet) -> SwitchKind:
    """Return what a contact or a joint does for a while in an active set."""
    if contact.is_joint:
        return SwitchKind.STICK_OR_SLIP
    return SwitchKind.FLIGHT if contact.is_flight(active) else SwitchKind.CONTACT
