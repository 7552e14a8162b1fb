"""The sequence of active sets of one contact within every control interval, and the switches between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.fesd.neighbours.contact_conditions import ActiveSet, ContactConditions

Factors = tuple[ActiveFactor, ...]
"""Active factors of all conditions of an element."""

Pattern = tuple[ActiveSet, ...]
"""Active sets of a contact in an interval, in time order, each different from the one before."""


@dataclass(frozen=True)
class ActiveRun:
    """An active set that a contact keeps, impacts left out.

    Attributes:
        active: the active set.
        first, last: control intervals in which it begins and ends.
    """

    active: ActiveSet
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


def pattern_of(contact: ContactConditions, branch: Branch, elements: Sequence[int]) -> Pattern:
    """Return the active sets of a contact in some elements one after the other; those without length are left out."""
    return tuple(active for active, _ in groupby(contact.of_factors(one) for one in sequence_of(branch, elements)))


def runs_of(contact: ContactConditions, patterns: Sequence[Pattern]) -> list[ActiveRun]:
    """Return the active sets that a contact has one after the other in all intervals."""
    runs: list[ActiveRun] = []
    for k, pattern in enumerate(patterns):
        for active in pattern:
            if contact.is_impact(active):
                continue
            if runs and runs[-1].active == active:
                runs[-1] = ActiveRun(active, runs[-1].first, k)
            else:
                runs.append(ActiveRun(active, k, k))
    return runs


def spread(sequence: Sequence[Factors], count: int) -> list[Factors]:
    """Return `count` factors in the order of a sequence, those without an impact repeated."""
    numbers = np.ones(len(sequence), dtype=int)
    free = [n for n, factors in enumerate(sequence) if ActiveFactor.COMPLEMENT not in factors]
    for i in range(count - len(sequence)):
        numbers[(free or [0])[i % len(free or [0])]] += 1
    return [factors for factors, number in zip(sequence, numbers, strict=True) for _ in range(number)]


def with_active(contact: ContactConditions, factors: Factors, active: ActiveSet) -> Factors:
    """Return the factors of an element with another active set of a contact."""
    changed = list(factors)
    for i, factor in zip(contact.members, active, strict=True):
        changed[i] = factor
    return tuple(changed)
