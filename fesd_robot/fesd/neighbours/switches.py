"""Where the switches of a contact may go: an interval earlier or later, into an interval, or to its boundary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise, takewhile

from fesd_robot.fesd.neighbours.contact_modes import ContactMode, ContactModes
from fesd_robot.fesd.neighbours.patterns import Pattern, Run
from fesd_robot.fesd.neighbours.placing import Placing

EARLIER, LATER = "an interval earlier", "an interval later"
TWO_EARLIER, TWO_LATER = "two intervals earlier", "two intervals later"
TO_BEGINNING, TO_END = "to the beginning of its interval", "to the end of its interval"
WITH_IMPACT, WITHOUT_IMPACT = "with impact", "without impact"
IMPACT_AFTER = "with impact as the next interval begins"
OTHER_WAY = ", slipping the other way"
HIT_AT_BOUNDARY = tuple(one + side for side in ("", OTHER_WAY) for one in (WITH_IMPACT, IMPACT_AFTER))
"""What a touchdown on a boundary may become without moving: hit before the others switch there, or after that."""

TOUCHDOWN, TAKE_OFF, STICK_OR_SLIP = "touchdown", "take-off", "stick or slip"


@dataclass(frozen=True)
class Switch:
    """A switch of a contact between two modes that are no impacts.

    Attributes:
        modes: of the contact.
        number: of the switch among those of the contact.
        name: touchdown, take-off, or stick or slip.
        interval: in which the mode before it ends.
        inside: whether the mode after it begins there, too, rather than on the boundary to the next interval.
        choices: where it may go -> the patterns that the contact then has in some intervals.
        two_away: the same, two intervals away, where it goes with another switch only.
    """

    modes: ContactModes
    number: int
    name: str
    interval: int
    inside: bool
    choices: Mapping[str, Mapping[int, Pattern]]
    two_away: Mapping[str, Mapping[int, Pattern]] = field(default_factory=dict)

    @property
    def place(self) -> tuple[int, bool]:
        """Twice the number of its interval, one more on the boundary to the next, and whether with an impact there."""
        return 2 * self.interval + (not self.inside), WITHOUT_IMPACT in self.choices

    @property
    def places(self) -> Mapping[str, Mapping[int, Pattern]]:
        """All of these."""
        return {**self.choices, **self.two_away}

    def towards(self, place: tuple[int, bool]) -> Mapping[int, Pattern] | None:
        """Return the patterns with which it is at the place of another switch; None if it may not go there."""
        steps = place[0] - self.place[0]
        into = f"into interval {self.interval + (steps > 0)}"
        near = (TO_BEGINNING, TO_END) if self.inside else (into, into)
        here = WITH_IMPACT if place[1] else WITHOUT_IMPACT
        where = {-2: EARLIER, -1: near[0], 0: here, 1: near[1], 2: LATER}.get(steps)
        return self.choices.get(where) if where else None

    def following(self, begin: Switch, where: str) -> Mapping[int, Pattern] | None:
        """Return the patterns with which this one follows an earlier switch that moves; None if it cannot.

        It moves by an interval where the other does, and where it lies inside one; else into the interval beside it.
        """
        earlier = where in (EARLIER, TO_BEGINNING, f"into interval {begin.interval}")
        if not (earlier or where in (LATER, TO_END, f"into interval {begin.interval + 1}")):
            return None
        if self.inside or where in (EARLIER, LATER):
            return self.choices.get(EARLIER if earlier else LATER)
        return self.choices.get(f"into interval {self.interval + (not earlier)}")


def switches_of(modes: ContactModes, patterns: list[Pattern], runs: list[Run], placing: Placing) -> list[Switch]:
    """Return the switches of a contact in time order.

    Args:
        modes: of the contact.
        patterns: of the contact in every interval.
        runs: of the contact.
        placing: the point that the patterns are those of.
    """
    switches = []
    for number, (before, after) in enumerate(pairwise(runs)):
        inside = before.last == after.first
        if not inside:
            choices = _from_a_boundary(modes, patterns, before, after, placing)
        else:
            choices = _from_inside(modes, patterns, before, after)
        name = _name(modes, before.mode, after.mode)
        two_away = _two_away(modes, patterns, before, after, choices)
        switches.append(Switch(modes, number, name, before.last, inside, choices, two_away))
    return switches


def _two_away(
    modes: ContactModes,
    patterns: Sequence[Pattern],
    before: Run,
    after: Run,
    choices: Mapping[str, Mapping[int, Pattern]],
) -> dict[str, Mapping[int, Pattern]]:
    """Return where a switch goes that moves by two intervals: what it leaves in the one between lasts through that."""
    two_away: dict[str, Mapping[int, Pattern]] = {}
    for one, two, step, left, passed in (
        (EARLIER, TWO_EARLIER, -1, before.mode, after.mode),
        (LATER, TWO_LATER, 1, after.mode, before.mode),
    ):
        if not (moved := choices.get(one)):
            continue
        at = (min if step < 0 else max)(moved)
        if not 0 <= at + step < len(patterns):
            continue
        if without_impacts(modes, patterns[at]) == patterns[at + step] == (left,):
            two_away[two] = {**moved, at: (passed,), at + step: moved[at]}
    return two_away


def _from_a_boundary(
    modes: ContactModes, patterns: list[Pattern], before: Run, after: Run, placing: Placing
) -> dict[str, dict[int, Pattern]]:
    """Return where a switch on the boundary of two intervals may go; an impact there goes with it."""
    k, following, a, b = before.last, after.first, before.mode, after.mode
    own, next_own = (without_impacts(modes, patterns[at]) for at in (k, following))
    ending, beginning = _impacts_between(modes, patterns[k], patterns[following])
    impact = (*ending, *beginning)
    choices: dict[str, dict[int, Pattern]] = {}
    if own == (a,):
        choices[EARLIER] = {k: (*impact, b), following: next_own}
    elif own[0] == a:
        choices[EARLIER] = {k: (b,)}
    if next_own == (b,):
        choices[LATER] = {k: own, following: (a, *impact)}
    elif next_own[-1] == b:
        choices[LATER] = {following: (a,)}
    for new, side in zip(_impacts(modes, a, b, k, placing), ("", OTHER_WAY), strict=False):
        if own == (a,):
            choices[f"into interval {k}{side}"] = {k: (a, *new, b), following: next_own}
        if next_own == (b,):
            choices[f"into interval {following}{side}"] = {k: own, following: (a, *new, b)}
        if impact and side:
            continue  # the impact that is there has a side
        hit = impact or new
        if hit and not ending and own == (a,):
            choices[f"{WITH_IMPACT}{side}"] = {k: (a, *hit), following: next_own}
        if hit and not beginning and next_own == (b,):
            choices[f"{IMPACT_AFTER}{side}"] = {k: own, following: (*hit, b)}
    if impact:
        choices[WITHOUT_IMPACT] = {k: own, following: next_own}
    return choices


def _from_inside(
    modes: ContactModes, patterns: list[Pattern], before: Run, after: Run
) -> dict[str, dict[int, Pattern]]:
    """Return where a switch inside an interval may go, none if there is another one of this contact."""
    k, a, b = before.last, before.mode, after.mode
    if len(without_impacts(modes, patterns[k])) > 2:
        return {}
    choices: dict[str, dict[int, Pattern]] = {
        TO_BEGINNING: {k: (b,)},
        TO_END: {k: (a,)},
    }
    if k > 0 and patterns[k - 1] == (a,):
        choices[EARLIER] = {k - 1: patterns[k], k: (b,)}
    if k + 1 < len(patterns) and patterns[k + 1] == (b,):
        choices[LATER] = {k: (a,), k + 1: patterns[k]}
    return choices


def _impacts(
    modes: ContactModes, a: ContactMode, b: ContactMode, interval: int, placing: Placing
) -> list[list[ContactMode]]:
    """Return the modes of the impact between two modes, one list for each side to which the contact may slip in it; an
    empty one if it is no touchdown."""
    if not modes.is_flight(a) or modes.is_flight(b):
        return [[]]
    return modes.impacts(b, *placing.end_of(interval))


def _impacts_between(modes: ContactModes, pattern: Pattern, following: Pattern) -> tuple[Pattern, Pattern]:
    """Return the modes of an impact that ends an interval, and those of one that begins the next."""
    ending = tuple(takewhile(modes.is_impact, reversed(pattern)))
    return ending[::-1], tuple(takewhile(modes.is_impact, following))


def without_impacts(modes: ContactModes, pattern: Pattern) -> Pattern:
    """Return the modes of a pattern that are no impacts."""
    return tuple(mode for mode in pattern if not modes.is_impact(mode))


def _name(modes: ContactModes, a: ContactMode, b: ContactMode) -> str:
    """Return what a switch is called."""
    if modes.is_flight(a) == modes.is_flight(b):
        return STICK_OR_SLIP
    return TOUCHDOWN if modes.is_flight(a) else TAKE_OFF
