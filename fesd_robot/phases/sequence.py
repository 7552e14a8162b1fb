"""A sequence of phases as a value: what every contact does, one phase after the other, and about how long."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from fesd_robot.contact import ContactMode, Modes
from fesd_robot.instants import SAME_EVENT

_LETTERS = {
    ContactMode.FLIGHT: "F",
    ContactMode.STICK: "S",
    ContactMode.SLIP: "L",
    ContactMode.SLIP_FORWARDS: "+",
    ContactMode.SLIP_BACKWARDS: "-",
    ContactMode.TOUCH: "T",
}

SIDES = (ContactMode.SLIP_FORWARDS, ContactMode.SLIP_BACKWARDS)
"""Modes that slip to one side of a tangent."""


@dataclass(frozen=True)
class Phase:
    """A span of time in which no contact changes its mode.

    Attributes:
        modes: of everything, none of them an impact.
        duration: s; about, as long as it is not solved.
        impacts: modes while the clock stands still where the phase begins, one after the other; some of them hit.
        knot: whether its end stays at its time.
        acting: the sets of controls that act, one at most of every group of which one acts at a time.
    """

    modes: Modes
    duration: float
    impacts: tuple[Modes, ...] = ()
    knot: bool = False
    acting: tuple[str, ...] = ()

    @property
    def hit(self) -> frozenset[int]:
        """Numbers of the contacts that are hit where it begins."""
        return frozenset(i for modes in self.impacts for i, mode in enumerate(modes) if mode.hits)


@dataclass(frozen=True)
class Sequence:
    """Phases in the order of time.

    Attributes:
        names: of rigid contacts, compliant ones and joints with dry friction, in the order of their `Modes`.
        phases: at least one.
        at_end: impacts where the last phase ends, as where another one would begin.
    """

    names: tuple[str, ...]
    phases: tuple[Phase, ...]
    at_end: tuple[Modes, ...] = ()

    @property
    def key(self) -> tuple[object, ...]:
        """What happens, without when: two sequences that share it differ in durations and knots only."""
        return (*((phase.modes, phase.impacts, phase.acting) for phase in self.without_knots.phases), self.at_end)

    def key_with(self, knots: tuple[float, ...]) -> tuple[object, ...]:
        """What happens, and between which knots, s: no switch crosses one while a motion is solved."""
        ends = self.without_knots.ends
        return (self.key, tuple(np.searchsorted(ends, np.array(knots) - SAME_EVENT).tolist()))

    @property
    def durations(self) -> np.ndarray:
        """Of the phases, s, (P)."""
        return np.array([phase.duration for phase in self.phases])

    @property
    def ends(self) -> np.ndarray:
        """Of the phases, s, (P)."""
        return np.cumsum(self.durations)

    @property
    def without_knots(self) -> Sequence:
        """The sequence in which phases are joined that follow each other without a change."""
        return replace(self, phases=joined(replace(phase, knot=False) for phase in self.phases))

    def with_knots(self, times: Iterable[float]) -> Sequence:
        """Return the sequence cut at given times, s, each into two phases that do the same."""
        phases = list(self.without_knots.phases)
        for time in sorted(times):
            end = 0.0
            for i, phase in enumerate(phases):
                begin, end = end, end + phase.duration
                if abs(end - time) <= SAME_EVENT:
                    phases[i] = replace(phase, duration=time - begin, knot=True)
                    if i + 1 < len(phases):
                        phases[i + 1] = replace(phases[i + 1], duration=phases[i + 1].duration + end - time)
                    break
                if begin + SAME_EVENT < time < end:
                    first = replace(phase, duration=time - begin, knot=True)
                    phases[i : i + 1] = [first, replace(phase, duration=end - time, impacts=())]
                    break
        return replace(self, phases=tuple(phases))

    def lasting(self, duration: float) -> Sequence:
        """Return the sequence stretched to a duration, s."""
        factor = duration / self.durations.sum()
        return replace(self, phases=tuple(replace(one, duration=one.duration * factor) for one in self.phases))

    def simplified(self, shortest: float, *, sticking: bool) -> Sequence:
        """Return the sequence without short phases, and with contacts that stick wherever they touch.

        Args:
            shortest: part of the duration of the shortest phase that is kept.
            sticking: whether contacts with friction stick that slip to a side.
        """
        phases = self.without_knots.phases
        if sticking:
            phases = joined(replace(phase, modes=stuck(phase.modes)) for phase in phases)
        whole = float(self.durations.sum())
        own = replace(self, phases=phases)
        while len(own.phases) > 1 and own.durations.min() < shortest * whole:
            own = own.without([int(own.durations.argmin())])
            own = replace(own, phases=joined(own.phases))
        return own

    def with_durations(self, durations: np.ndarray) -> Sequence:
        """Return the sequence with other durations, s, (P)."""
        pairs = zip(self.phases, durations, strict=True)
        return replace(self, phases=tuple(replace(one, duration=float(duration)) for one, duration in pairs))

    def without_impacts(self, gone: Iterable[tuple[int, int]]) -> Sequence:
        """Return the sequence without some impacts, given by the number of a phase and its number there.

        Those at the end have the number of the phase that would follow.
        """
        left = set(gone)
        return replace(
            self,
            at_end=tuple(one for n, one in enumerate(self.at_end) if (len(self.phases), n) not in left),
            phases=tuple(
                replace(phase, impacts=tuple(one for n, one in enumerate(phase.impacts) if (i, n) not in left))
                for i, phase in enumerate(self.phases)
            ),
        )

    def sticking(self, where: Iterable[tuple[int, int]]) -> Sequence:
        """Return the sequence in which contacts of given numbers stick in phases of given numbers.

        One that hits where such a phase begins slips in that impact as it did, and then sticks.
        """
        phases = list(self.phases)
        for i, n in where:
            impacts = [one if one[n].hits else with_mode(one, n, ContactMode.STICK) for one in phases[i].impacts]
            if impacts and impacts[-1][n].hits and impacts[-1][n] is not ContactMode.IMPACT_STICK:
                impacts.append(with_mode(impacts[-1], n, ContactMode.IMPACT_STICK))
            modes = with_mode(phases[i].modes, n, ContactMode.STICK)
            phases[i] = replace(phases[i], modes=modes, impacts=tuple(impacts))
        return replace(self, phases=joined(phases))

    def without(self, gone: Iterable[int]) -> Sequence:
        """Return the sequence without phases of given numbers.

        A neighbour takes the time of each: the one before it, or the one after the first. What hits where it began hits
        where the next one begins, as far as that has not begun in flight again.
        """
        left, phases = set(gone), list(self.phases)
        for i in sorted(left, reverse=True):
            if len(phases) == 1:
                break
            lost = phases.pop(i)
            if i == 0:
                phases[0] = replace(phases[0], duration=phases[0].duration + lost.duration, impacts=())
                continue
            phases[i - 1] = replace(
                phases[i - 1], duration=phases[i - 1].duration + lost.duration, knot=phases[i - 1].knot or lost.knot
            )
            if i < len(phases):
                following = replace(phases[i], impacts=phases[i].impacts or lost.impacts)
                phases[i] = replace(following, impacts=_lawful(phases[i - 1].modes, following))
        return replace(self, phases=tuple(phases))

    def __str__(self) -> str:
        return " ".join(
            ("!" if phase.impacts else "") + "".join([*(_LETTERS[mode] for mode in phase.modes), *_acting(phase)])
            for phase in self.without_knots.phases
        ) + "!" * bool(self.at_end)


def _acting(phase: Phase) -> list[str]:
    """Return the sets of controls that act in a phase, as a sequence is written."""
    return [f"[{one.split(' ', 1)[1]}]" for one in phase.acting]


def with_mode(modes: Modes, n: int, mode: ContactMode) -> Modes:
    """Return modes of which the n-th is another one."""
    return (*modes[:n], mode, *modes[n + 1 :])


def stuck(modes: Modes) -> Modes:
    """Return modes with everything sticking that slips to a side."""
    return tuple(ContactMode.STICK if mode in SIDES else mode for mode in modes)


def _lawful(before: Modes, phase: Phase) -> tuple[Modes, ...]:
    """Return the impacts of a phase of contacts that touch in it, and do not in the one before it."""
    lands = phase.hit.intersection(landings(before, phase.modes))
    return tuple(
        tuple(mode if not mode.hits or i in lands else phase.modes[i] for i, mode in enumerate(modes))
        for modes in phase.impacts
        if any(mode.hits and i in lands for i, mode in enumerate(modes))
    )


def landings(before: Modes, after: Modes) -> list[int]:
    """Return the numbers of the contacts that touch in a phase and not in the one before it."""
    return [
        i
        for i, (one, other) in enumerate(zip(before, after, strict=True))
        if one is ContactMode.FLIGHT and other.closed
    ]


def switching(before: Modes, after: Modes) -> list[int]:
    """Return the numbers of everything whose mode is not the same in two phases."""
    return [i for i, (one, other) in enumerate(zip(before, after, strict=True)) if one is not other]


def flying(modes: Modes, contacts: Iterable[int]) -> Modes:
    """Return modes with contacts of given numbers in flight."""
    up = set(contacts)
    return tuple(ContactMode.FLIGHT if i in up else mode for i, mode in enumerate(modes))


def hits(modes: Modes, sides: Mapping[int, ContactMode]) -> tuple[Modes, ...]:
    """Return the impacts of contacts that come down at once: they slip to a side, and then do what follows.

    Args:
        modes: that follow.
        sides: number of every contact that comes down -> how it slips first, or what it does then.
    """
    slipping = tuple(sides[n].hitting if n in sides else mode for n, mode in enumerate(modes))
    after = tuple(mode.hitting if n in sides else mode for n, mode in enumerate(modes))
    return (slipping,) if slipping == after else (slipping, after)


def joined(phases: Iterable[Phase]) -> tuple[Phase, ...]:
    """Return phases without those that repeat the one before them."""
    found: list[Phase] = []
    for phase in phases:
        if found and (found[-1].modes, found[-1].acting) == (phase.modes, phase.acting) and not phase.impacts:
            found[-1] = replace(found[-1], duration=found[-1].duration + phase.duration, knot=phase.knot)
        else:
            found.append(phase)
    return tuple(found)
