"""From the modes that a contact shall have in some intervals to a branch, and to a point to start from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby, product

import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.fesd.neighbours.contact_conditions import ContactConditions
from fesd_robot.fesd.neighbours.patterns import Factors, Pattern, intervals_of, sequence_of, spread, with_active
from fesd_robot.fesd.trajectory import Element
from fesd_robot.fesd.transcription import Transcription


@dataclass(frozen=True)
class Placing:
    """The elements of a transcription on a branch, from which neighbours are made.

    Attributes:
        transcription: of a collocation scheme.
        elements: in time order.
        branch: on which they lie.
    """

    transcription: Transcription
    elements: Sequence[Element]
    branch: Branch

    @cached_property
    def _intervals(self) -> list[range]:
        return intervals_of(self.transcription.elements)

    def end_of(self, interval: int) -> tuple[np.ndarray, np.ndarray]:
        """Return state and algebraic variables at the end of an interval, before the impacts that it ends with."""
        own = [e for e in self._intervals[interval] if not self.branch.without_length[e]]
        free = [e for e in own if ActiveFactor.COMPLEMENT not in self.branch.factors[e]]
        element = self.elements[(free or own)[-1]]
        return element.x[-1], element.z[-1]

    def placed(self, steps: Sequence[tuple[ContactConditions, Mapping[int, Pattern]]]) -> Iterator[Placing]:
        """Yield elements and branches in which contacts have given modes in some intervals.

        Where another contact switches in the same interval, there are two: the new switches come before or after the
        others; where one of them is hit, also two in which both switch as the impact begins, as a block begins to slide
        that is hit, which takes an element less. There is none where an interval has too few elements.

        Args:
            steps: contacts and their modes by interval, placed one after the other.
        """
        seen: set[Branch] = set()
        for at_once, first in product((True, False), repeat=2):
            placing: Placing | None = self
            for contact, patterns in steps:
                placing = placing and placing._one_placed(contact, patterns, first, at_once)
            if placing is None or placing.branch in seen:
                continue
            seen.add(placing.branch)
            yield placing
            if all(
                len(pattern) == 1 or self._is_uniform(contact, k)
                for contact, own in steps
                for k, pattern in own.items()
            ):
                return

    def _one_placed(
        self, contact: ContactConditions, patterns: Mapping[int, Pattern], first: bool, at_once: bool
    ) -> Placing | None:
        sequences = {k: self._with_others(contact, pattern, k, first, at_once) for k, pattern in patterns.items()}
        if any(len(sequence) > len(self._intervals[k]) for k, sequence in sequences.items()):
            return None
        return self.with_sequences(sequences)

    def _is_uniform(self, contact: ContactConditions, interval: int) -> bool:
        """Whether all other contacts keep their modes in an interval."""
        return len(self._others(contact, interval)) == 1

    def _others(self, contact: ContactConditions, interval: int) -> list[Factors]:
        """Return the factors in the elements of an interval, as if a contact were in flight."""
        own = sequence_of(self.branch, self._intervals[interval])
        return [factors for factors, _ in groupby(with_active(contact, one, contact.flight) for one in own)]

    def _with_others(
        self, contact: ContactConditions, pattern: Pattern, interval: int, first: bool, at_once: bool
    ) -> list[Factors]:
        """Return the factors of an interval's elements when a contact's switches come before or after all others.

        Args:
            contact, pattern: the contact, and its active sets in the interval.
            interval: the interval.
            first: whether before.
            at_once: whether they switch where an impact begins, of the contact or of another one.
        """
        others = self._others(contact, interval)
        own_switch, switch = _switch_of(pattern), _switch_of(others)
        impact = any(map(contact.is_impact, (*pattern, *others)))
        if not (at_once and impact and own_switch and switch):
            return _merged(contact, pattern, others, first)
        before = _merged(contact, pattern[:own_switch], others[:switch], first)
        return before + _merged(contact, pattern[own_switch:], others[switch:], first)

    def with_sequences(self, sequences: Mapping[int, Sequence[Factors]]) -> Placing:
        """Return elements and branch with other factors in some intervals, whose elements become equally long.

        Args:
            sequences: interval -> the factors of its elements one after the other, at most as many as it has elements.
        """
        factors, without_length = list(self.branch.factors), list(self.branch.without_length)
        elements = list(self.elements)
        for k, sequence in sequences.items():
            own = self._intervals[k]
            filled = spread(sequence, len(own))
            for e, new, source in zip(own, self._resampled(k), filled, strict=True):
                factors[e], without_length[e] = source, False
                elements[e] = replace(new, z=self._algebraic(source, e))
        branch = Branch(self.branch.conditions, tuple(factors), tuple(without_length))
        return Placing(self.transcription, elements, branch)

    def _resampled(self, interval: int) -> list[Element]:
        """Return the elements of an interval with equal lengths, their states on lines between the old ones."""
        own = [self.elements[e] for e in self._intervals[interval]]
        ocp, tableau = self.transcription.ocp, self.transcription.options.tableau
        step, start = ocp.duration / ocp.intervals / len(own), own[0].start
        times = np.array([start, *(element.end for element in own)])
        states = np.vstack([own[0].x_left, *(element.x[-1:] for element in own)])
        fractions = np.append(tableau.c, [] if tableau.ends_at_stage else [1.0])
        elements = []
        for n, element in enumerate(own):
            at = start + step * (n + np.append(0.0, fractions))
            x = np.array([np.interp(at, times, state) for state in states.T]).T
            elements.append(replace(element, start=at[0], step=step, x_left=x[0], x=x[1:]))
        return elements

    def _algebraic(self, factors: Factors, at: int) -> np.ndarray:
        """Return the algebraic variables of the nearest element with the same factors; its own if there is none."""
        same = [e for e, own in enumerate(self.branch.factors) if own == factors and not self.branch.without_length[e]]
        return self.elements[min(same, key=lambda e: abs(e - at), default=at)].z


def _switch_of(factors: Sequence[Factors]) -> int:
    """Return how many factors, of a contact or of all, come before the first impact, or before the only switch of a
    sequence without one; 0 if there is neither."""
    first = next((n for n, one in enumerate(factors) if ContactConditions.is_impact(one)), None)
    return int(len(factors) == 2) if first is None else first


def _merged(contact: ContactConditions, pattern: Pattern, others: Sequence[Factors], first: bool) -> list[Factors]:
    """Return the factors of elements in which a contact's modes follow each other before, or after, those of others."""
    if first:
        return [
            *(with_active(contact, others[0], active) for active in pattern),
            *(with_active(contact, other, pattern[-1]) for other in others[1:]),
        ]
    return [
        *(with_active(contact, other, pattern[0]) for other in others[:-1]),
        *(with_active(contact, others[-1], active) for active in pattern),
    ]
