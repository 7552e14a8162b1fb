"""The sequence of modes of one contact within every control interval, and the switches between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.fesd.neighbours.contact_modes import ContactMode, ContactModes

Factors = tuple[ActiveFactor, ...]
"""Active factors of all conditions of an element."""

Pattern = tuple[ContactMode, ...]
"""Modes of a contact in an interval, in time order, each different from the one before."""


@dataclass(frozen=True)
class Run:
    """A mode that a contact keeps, impacts left out.

    Attributes:
        mode: the mode.
        first, last: control intervals in which it begins and ends.
    """

    mode: ContactMode
    first: int
    last: int


def intervals_of(elements: Sequence[int]) -> list[range]:
    """Return the numbers of the elements of every interval, given how many it has."""
    ranges, begin = [], 0
    for count in elements:
        ranges.append(range(begin, begin + count))
        begin += count
    return ranges


def sequence_of(branch: Branch, elements: Sequence[int]) -> list[Factors]:
    """Return the factors of some elements one after the other; those without length are left out."""
    return [factors for factors, _ in groupby(branch.factors[e] for e in elements if not branch.without_length[e])]


def pattern_of(modes: ContactModes, branch: Branch, elements: Sequence[int]) -> Pattern:
    """Return the modes of a contact in some elements one after the other; those without length are left out."""
    return tuple(mode for mode, _ in groupby(modes.of_factors(one) for one in sequence_of(branch, elements)))


def runs_of(modes: ContactModes, patterns: Sequence[Pattern]) -> list[Run]:
    """Return the modes that a contact has one after the other in all intervals."""
    runs: list[Run] = []
    for k, pattern in enumerate(patterns):
        for mode in pattern:
            if modes.is_impact(mode):
                continue
            if runs and runs[-1].mode == mode:
                runs[-1] = Run(mode, runs[-1].first, k)
            else:
                runs.append(Run(mode, k, k))
    return runs


def in_flight(modes: Sequence[ContactModes], branch: Branch, elements: Sequence[int]) -> bool:
    """Return whether no contact has a force in some of the given elements."""
    return any(
        all(contact.is_flight(contact.of_factors(factors)) for contact in modes)
        for factors in sequence_of(branch, elements)
    )


def spread(sequence: Sequence[Factors], count: int) -> list[Factors]:
    """Return `count` factors in the order of a sequence, those without an impact repeated."""
    numbers = np.ones(len(sequence), dtype=int)
    free = [n for n, factors in enumerate(sequence) if ActiveFactor.COMPLEMENT not in factors]
    for i in range(count - len(sequence)):
        numbers[(free or [0])[i % len(free or [0])]] += 1
    return [factors for factors, number in zip(sequence, numbers, strict=True) for _ in range(number)]


def with_mode(modes: ContactModes, factors: Factors, mode: ContactMode) -> Factors:
    """Return the factors of an element with another mode of a contact."""
    changed = list(factors)
    for i, factor in zip(modes.members, mode, strict=True):
        changed[i] = factor
    return tuple(changed)
