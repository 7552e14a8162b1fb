"""Neighbours of a sequence: sequences in which one thing happens that does not happen in it, or the other way round."""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Sequence as ListOf
from dataclasses import dataclass, replace
from itertools import chain, combinations, zip_longest

import numpy as np

from fesd_robot.contact import Contact, ContactMode, Modes
from fesd_robot.phases.profile import ContactProfile
from fesd_robot.phases.sequence import SIDES, Phase, Sequence, flying, hits, joined, landings, switching, with_mode

INSERTED = 0.25
"""Part of a phase that what is put into it takes, in its middle or at one of its ends."""

LONGEST_INSERTED = 0.1
"""s; the same in time, at most."""

ACROSS = 0.02
"""Part of the duration by which a switch begins on the other side of a knot."""

EDGE = 0.02
"""Part of a phase that is left before and after what is put into it."""

APART = 0.01
"""s; time between two switches that happened at once."""


_SLIPS = (*SIDES, ContactMode.SLIP)


@dataclass(frozen=True)
class Neighbour:
    """A sequence near another one.

    Attributes:
        what: is changed, in words.
        sequence: without knots, with durations near those of the other.
    """

    what: str
    sequence: Sequence


def neighbours(
    sequence: Sequence,
    contacts: list[Contact],
    profile: ContactProfile,
    knots: tuple[float, ...] = (),
    images: tuple[int, ...] = (),
    compliant: int = 0,
    groups: ListOf[ListOf[str]] = (),
) -> Iterator[Neighbour]:
    """Yield the neighbours of a sequence, each once: one of each kind in turn, those of a kind in the order of time.

    Those that slip otherwise come last where nothing slips in the sequence.

    - impacts: a contact that comes down hits and slips to either side, or hits without slipping, or comes down softly;
      so does one that comes down where a gait ends and begins again;
    - a switch before a knot happens after it, or the other way round;
    - a phase is left out;
    - a contact leaves the surface for a short time in a phase, or as the motion begins; all that touch do;
    - a contact touches for a short time in a flight;
    - a compliant contact leaves for a short time, or pushes, as those that are rigid do;
    - contacts that switch together switch one after the other, in either order; two that switch one after the other
      exchange their order;
    - a contact slips, to either side, where it sticks, in all of a phase or where it begins or ends; it sticks where it
      slips;
    - another set of controls acts, of a group of which one acts at a time, in all of a phase or for a short time.

    Args:
        sequence: with durations, s; its knots are left out.
        contacts: of the task that are rigid, by whose numbers its modes are.
        profile: of its motion: what is put into a phase is put where it would happen most easily.
        knots: times at which the task asks for something, s.
        images: of a gait, the contacts whose places its contacts take where it goes on; none if it does not, or if no
            contact can hit there.
        compliant: how many compliant contacts follow the rigid ones.
        groups: sets of controls, of each of which one acts at a time.
    """
    own = _Neighbours(sequence.without_knots, contacts, profile, knots, images, compliant, groups)
    seen = {sequence.key_with(knots)}
    for one in own.all_of_them():
        key = one.sequence.key_with(knots)
        if key not in seen:
            seen.add(key)
            yield one


@dataclass(frozen=True)
class _Neighbours:
    sequence: Sequence
    contacts: list[Contact]
    profile: ContactProfile
    knots: tuple[float, ...]
    images: tuple[int, ...]
    compliant: int
    groups: ListOf[ListOf[str]]

    def _is_compliant(self, contact: int) -> bool:
        return len(self.contacts) <= contact < len(self.contacts) + self.compliant

    def _span(self, i: int) -> tuple[float, float]:
        """When a phase begins and ends, s."""
        end = float(self.sequence.ends[i])
        return end - self.phases[i].duration, end

    @property
    def phases(self) -> tuple[Phase, ...]:
        return self.sequence.phases

    def all_of_them(self) -> Iterator[Neighbour]:
        kinds = [
            self._impacts(),
            self._impacts_at_end(),
            self._across(),
            self._left_out(),
            self._in_turn(),
            self._exchanged(),
            self._flights(),
            self._touches(),
            self._pushes(),
            self._acts(),
        ]
        slides = any(mode in _SLIPS for phase in self.phases for mode in phase.modes)
        for one in chain.from_iterable(zip_longest(*kinds, *([self._slips()] if slides else []))):
            if one is not None:
                yield one
        if not slides:
            yield from self._slips()

    def _of(self, what: str, phases: list[Phase]) -> Neighbour:
        own = replace(self.sequence, phases=joined(phases))
        if self.images and own.at_end:
            own = replace(own, at_end=self._lawful_end(own))
        return Neighbour(what, own)

    def _lawful_end(self, own: Sequence) -> tuple[Modes, ...]:
        """Return the impacts at the end of a gait if all that hit there land, beside what the others do behind them."""
        after = self._goes_on(own.phases)
        lands = landings(own.phases[-1].modes, after)
        if any(mode.hits and n not in lands for modes in own.at_end for n, mode in enumerate(modes)):
            return ()
        return tuple(
            tuple(mode if mode.hits else then for mode, then in zip(modes, after, strict=True)) for modes in own.at_end
        )

    def _name(self, i: int) -> str:
        return f"'{self.sequence.names[i]}'"

    def _names(self, numbers: list[int]) -> str:
        return " and ".join(self._name(i) for i in numbers)

    def _changed(self, i: int, phase: Phase) -> list[Phase]:
        return [*self.phases[:i], phase, *self.phases[i + 1 :]]

    def _sides(self, contact: int) -> list[ContactMode]:
        """How a contact with friction may slip; nothing if it has none, or may not."""
        if self._is_compliant(contact):
            return []
        if contact < len(self.contacts) and self.contacts[contact].friction == 0:
            return []
        if contact < len(self.contacts) and self.contacts[contact].in_space:
            return [ContactMode.SLIP]
        return list(SIDES)

    def hit(self, modes: Modes, lands: list[int], side: ContactMode | None) -> tuple[Modes, ...]:
        """Return the impacts of contacts that come down: they slip to a side first, if one is given."""
        return hits(modes, {n: side if side and self._sides(n) else modes[n] for n in lands})

    def _impacts(self) -> Iterator[Neighbour]:
        for i, phase in enumerate(self.phases):
            lands = landings(self.phases[i - 1].modes, phase.modes) if i else []
            if not lands:
                continue
            groups = [lands] if len(lands) == 1 else [lands, *([n] for n in lands)]
            for group in groups:
                for side in (None, *self._sides(group[0])):
                    word = "without slipping" if side is None else f"with {side.value}"
                    impacts = self.hit(phase.modes, group, side)
                    yield self._of(
                        f"{self._names(group)} hits {word}", self._changed(i, replace(phase, impacts=impacts))
                    )
            if phase.impacts:
                softly = self._changed(i, replace(phase, impacts=()))
                yield self._of(f"{self._names(lands)} comes down softly", softly)

    def _impacts_at_end(self) -> Iterator[Neighbour]:
        """Yield the sequences in which contacts of a gait hit as it ends, and go on as their images begin."""
        own, after = self.sequence, self._goes_on(self.phases)
        lands = landings(self.phases[-1].modes, after)
        for group in [lands] if len(lands) == 1 else [lands, *([n] for n in lands)] if lands else []:
            for side in (None, *self._sides(group[0])):
                word = "without slipping" if side is None else f"with {side.value}"
                what = f"{self._names(group)} hits {word} at the end"
                yield Neighbour(what, replace(own, at_end=self.hit(after, group, side)))
        if lands and own.at_end:
            yield Neighbour(f"{self._names(lands)} comes down softly at the end", replace(own, at_end=()))

    def _goes_on(self, phases: ListOf[Phase]) -> Modes:
        """Return the modes in which a gait goes on behind its last phase; those of that phase if it does not."""
        first, last = phases[0].modes, phases[-1].modes
        return (*(first[n] for n in self.images), *last[len(self.images) :])

    def _across(self) -> Iterator[Neighbour]:
        """Yield the sequences in which the last switch before a knot, or the first after it, is on its other side."""
        ends, whole = self.sequence.ends, float(self.sequence.durations.sum())
        for knot in self.knots:
            after = int(np.searchsorted(ends[:-1], knot))
            for i, side in ((after - 1, 1), (after, -1)):
                if not 0 <= i < len(ends) - 1:
                    continue
                begin, end = ends[i] - self.phases[i].duration, ends[i + 1]
                time = float(np.clip(knot + side * ACROSS * whole, begin + EDGE * whole, end - EDGE * whole))
                if (time - knot) * side <= 0:
                    continue
                moved = [
                    replace(self.phases[i], duration=time - begin),
                    replace(self.phases[i + 1], duration=end - time),
                ]
                what = f"the switch after phase {i + 1} {'after' if side > 0 else 'before'} {knot:g} s"
                yield self._of(what, [*self.phases[:i], *moved, *self.phases[i + 2 :]])

    def _left_out(self) -> Iterator[Neighbour]:
        for i in range(len(self.phases)):
            if len(self.phases) > 1:
                yield self._of(f"without phase {i + 1}", list(self.sequence.without([i]).phases))

    def _inserted(
        self,
        what: str,
        i: int,
        modes: Modes,
        *,
        where: str = "middle",
        span: tuple[float, float] | None = None,
        acting: tuple[str, ...] | None = None,
    ) -> Iterator[Neighbour]:
        """Yield phases put into a phase, with impacts where contacts come down, and softly.

        Args:
            what: in words.
            i: number of the phase.
            modes: that are put into it.
            where: at its ``begin``, its ``end`` or in its ``middle``.
            span: in the middle, when, s.
            acting: sets of controls that act in it; None for those of the phase.
        """
        phase = self.phases[i]
        short = min(INSERTED * phase.duration, LONGEST_INSERTED)
        begins, begin = where == "begin", self._span(i)[0]
        before_it = 0.0 if begins else phase.duration - short
        if where == "middle" and span is not None:
            short = float(np.clip(span[1] - span[0], short, (1 - INSERTED) * phase.duration))
            middle = (span[0] + span[1]) / 2 - begin
            least = EDGE * phase.duration
            before_it = float(np.clip(middle - short / 2, least, phase.duration - short - least))
        after_it = phase.duration - short - before_it
        first = [] if begins else [replace(phase, duration=before_it)]
        before = phase.modes if not begins else (self.phases[i - 1].modes if i else modes)
        lands = landings(before, modes)
        again = landings(modes, phase.modes)
        for side in (*self._sides((lands or again or [0])[0]), None) if lands or again else (None,):
            soft = side is None
            inside = replace(
                phase,
                modes=modes,
                duration=short,
                impacts=() if soft or not lands else self.hit(modes, lands, side),
                acting=phase.acting if acting is None else acting,
            )
            impacts = () if soft or not again else self.hit(phase.modes, again, side)
            last = [] if where == "end" else [replace(phase, duration=after_it, impacts=impacts)]
            yield self._of(what, [*self.phases[:i], *first, inside, *last, *self.phases[i + 1 :]])

    def _flights(self) -> Iterator[Neighbour]:
        for i, phase in enumerate(self.phases):
            closed = [n for n in range(len(self.contacts)) if phase.modes[n].closed]
            groups = [[n] for n in closed] + ([closed] if len(closed) > 1 else [])
            for group in groups:
                modes = flying(phase.modes, group)
                span = self.profile.least(self.profile.force, group, *self._span(i))
                yield from self._inserted(f"{self._names(group)} leaves in phase {i + 1}", i, modes, span=span)
                if i == 0:
                    yield from self._inserted(f"{self._names(group)} leaves at once", i, modes, where="begin")

    def _touches(self) -> Iterator[Neighbour]:
        for i, phase in enumerate(self.phases):
            for n in range(len(self.contacts)):
                if phase.modes[n] is ContactMode.FLIGHT:
                    span = self.profile.least(self.profile.gap, [n], *self._span(i))
                    sides = self._sides(n) if self._slides(n) else []
                    own = [ContactMode.SLIP] if self.contacts[n].friction == 0 else [ContactMode.STICK, *sides]
                    for mode in own:
                        modes = tuple(mode if m == n else one for m, one in enumerate(phase.modes))
                        what = f"{self._name(n)} touches in phase {i + 1}, {mode.value}"
                        yield from self._inserted(what, i, modes, span=span)

    def _pushes(self) -> Iterator[Neighbour]:
        """Yield the sequences in which a compliant contact pushes for a short time, or leaves for one."""
        for i, phase in enumerate(self.phases):
            for n in range(len(self.contacts), len(self.contacts) + self.compliant):
                flies = phase.modes[n] is ContactMode.FLIGHT
                values = self.profile.gap if flies else self.profile.force
                span = self.profile.least(values, [n], *self._span(i))
                other = ContactMode.TOUCH if flies else ContactMode.FLIGHT
                modes = with_mode(phase.modes, n, other)
                what = f"{self._name(n)} {'pushes' if flies else 'leaves'} in phase {i + 1}"
                yield from self._inserted(what, i, modes, span=span)
                for where in ("begin", "end"):
                    yield from self._inserted(f"{what}, at its {where}", i, modes, where=where)

    def _in_turn(self) -> Iterator[Neighbour]:
        for i, (before, after) in enumerate(zip(self.phases[:-1], self.phases[1:], strict=True), start=1):
            together = switching(before.modes, after.modes)
            if len(together) < 2:
                continue
            for size in dict.fromkeys((1, len(together) - 1)):
                for group in combinations(together, size):
                    between = tuple(
                        a if n in group else b for n, (b, a) in enumerate(zip(before.modes, after.modes, strict=True))
                    )
                    first = landings(before.modes, between)
                    last = landings(between, after.modes)
                    hard = bool(after.impacts)
                    hitting = self.hit(between, first, None) if hard and first else ()
                    inside = Phase(between, APART, hitting, acting=before.acting)
                    changed = replace(after, impacts=self.hit(after.modes, last, None) if hard and last else ())
                    yield self._of(
                        f"{self._names(list(group))} switches first before phase {i + 1}",
                        [*self.phases[:i], inside, changed, *self.phases[i + 1 :]],
                    )

    def _exchanged(self) -> Iterator[Neighbour]:
        for i in range(1, len(self.phases) - 1):
            before, own, after = self.phases[i - 1 : i + 2]
            last = set(switching(own.modes, after.modes))
            if last.intersection(switching(before.modes, own.modes)) or not before.acting == own.acting == after.acting:
                continue
            modes = tuple(after.modes[n] if n in last else mode for n, mode in enumerate(before.modes))
            one, other = landings(before.modes, modes), landings(modes, after.modes)
            hard = bool(own.impacts or after.impacts)
            yield self._of(
                f"phase {i + 1} exchanged",
                [
                    *self.phases[:i],
                    replace(own, modes=modes, impacts=self.hit(modes, one, None) if hard and one else ()),
                    replace(after, impacts=self.hit(after.modes, other, None) if hard and other else ()),
                    *self.phases[i + 2 :],
                ],
            )

    def _acts(self) -> Iterator[Neighbour]:
        """Yield the sequences in which another set of controls acts, in all of a phase or for a short time."""
        for i, phase in enumerate(self.phases):
            for others in self.groups:
                own = [one for one in phase.acting if one in others]
                for other in (one for one in others if one not in own):
                    acting = tuple(other if one in own else one for one in phase.acting) if own else (other,)
                    what = f"'{other}' acts in phase {i + 1}"
                    yield self._of(what, self._changed(i, replace(phase, acting=acting)))
                    for where in ("middle", "begin", "end"):
                        short = f"{what}, for a short time at its {where}"
                        yield from self._inserted(short, i, phase.modes, where=where, acting=acting)

    def _slips(self) -> Iterator[Neighbour]:
        for i, phase in enumerate(self.phases):
            free = [n for n, mode in enumerate(phase.modes) if mode.closed and self._slides(n)]
            alike = [[n for n in free if phase.modes[n] is mode] for mode in dict.fromkeys(phase.modes)]
            groups = [group for group in alike if len(group) > 1] + [[n] for n in free]
            for group in groups:
                for other in (ContactMode.STICK, *self._sides(group[0])):
                    if other is phase.modes[group[0]]:
                        continue
                    modes = tuple(other if n in group else one for n, one in enumerate(phase.modes))
                    what = f"{self._names(group)} does {other.value} in phase {i + 1}"
                    span = self._easily(group, other, i)
                    for where in ("middle", "begin", "end"):
                        short = f"{what}, for a short time at its {where}"
                        yield from self._inserted(short, i, modes, where=where, span=span)
                    changed = replace(phase, modes=modes, impacts=self._slid(phase, group, other))
                    yield self._of(what, self._changed(i, changed))

    def _easily(self, group: list[int], mode: ContactMode, i: int) -> tuple[float, float] | None:
        """When contacts would stick, or slip, most easily in a phase, s; None for joints."""
        if any(n >= len(self.contacts) for n in group):
            return None
        if mode is ContactMode.STICK:
            return self.profile.slow(group, *self._span(i))
        return self.profile.least(-self.profile.used, group, *self._span(i))

    def _slides(self, contact: int) -> bool:
        """Whether a contact, or a joint with dry friction, may stick and slip."""
        return bool(self._sides(contact)) and not (
            contact < len(self.contacts) and self.contacts[contact].slip_distance == 0
        )

    def _slid(self, phase: Phase, group: list[int], mode: ContactMode) -> tuple[Modes, ...]:
        """Return the impacts of a phase in which contacts move otherwise, as far as they are not hit themselves."""
        return tuple(
            tuple(mode if n in group and not one.hits else one for n, one in enumerate(modes))
            for modes in phase.impacts
        )
