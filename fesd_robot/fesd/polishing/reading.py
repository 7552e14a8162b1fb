"""From a nearly complementary trajectory to the choice that every element makes in every alternative."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import casadi as ca
import numpy as np

from fesd_robot.fesd.polishing.conditions import Alternative, Alternatives, Choice
from fesd_robot.fesd.trajectory import Element

COLLAPSED = 0.03
"""An element shorter than this times its equal share has no length: it holds one point, and nothing happens in it."""

GRAZING_FLIGHT = 2e-3
"""A flight that stays this low (m) between two elements with contact is one with contact."""


@dataclass(frozen=True)
class Structure:
    """What every finite element holds at zero.

    Attributes:
        choices: per element, per alternative.
        collapsed: per element.
    """

    choices: tuple[tuple[Choice, ...], ...]
    collapsed: tuple[bool, ...]


def read_structure(
    alternatives: Alternatives, elements: Sequence[Element], steps: np.ndarray, hover: float
) -> Structure:
    """Return the structure of a trajectory whose products are small but not zero.

    The decision is one an element, from all its points together: of a alternative's factors the smaller one vanishes.
    Alternatives of rank 0 are decided first; those of rank 1 only where their share is left.

    Args:
        elements: of the trajectory, in time order.
        steps: equal share of the interval of every element, numerical time.
        hover: see `GRAZING_FLIGHT`; 0 takes every flight as it is.
    """
    values = [_values(alternatives, element) for element in elements]
    collapsed = tuple(bool(e.step < COLLAPSED * h) for e, h in zip(elements, steps, strict=True))
    first = [[_choice(c, v) if c.rank == 0 else None for c in alternatives.members] for v in values]
    if hover > 0:
        for at, alternative in enumerate(alternatives.members):
            if alternative.kept >= 0:
                _lower_hovers(first, at, [v[0][:, alternative.level].max() for v in values], collapsed, hover)
    choices = [tuple(_complete(alternatives, v, own)) for v, own in zip(values, first, strict=True)]
    return Structure(tuple(choices), collapsed)


def collapse(structure: Structure, elements: Sequence[Element], steps: np.ndarray) -> Structure | None:
    """Return the structure without the elements that have shrunk to nothing; None if there are none."""
    short = [e.step < COLLAPSED * h for e, h in zip(elements, steps, strict=True)]
    collapsed = tuple(bool(old or new) for old, new in zip(structure.collapsed, short, strict=True))
    return None if collapsed == structure.collapsed else replace(structure, collapsed=collapsed)


def out_of_elements(structure: Structure, elements: Sequence[Element]) -> list[int]:
    """Return the intervals that have no element to spare: each of theirs has a length and differs from its neighbours.

    One switch more, and such an interval cannot hold its motion.
    """
    found = []
    for interval in sorted({element.interval for element in elements}):
        own = [e for e, element in enumerate(elements) if element.interval == interval]
        switches = all(structure.choices[a] != structure.choices[b] for a, b in pairwise(own))
        if len(own) > 1 and switches and not any(structure.collapsed[e] for e in own):
            found.append(interval)
    return found


def _values(alternatives: Alternatives, element: Element) -> tuple[np.ndarray, np.ndarray]:
    """Quantities at all points, left boundary first, and at the stages only: (points, n), (stages, n)."""
    x = np.vstack([element.x_left, element.x])
    own = element.z if len(element.z) == len(element.x) else np.vstack([element.z, element.z[-1:]])
    z = np.vstack([element.z_left, own])
    values = np.asarray(ca.DM(alternatives.values.map(len(x))(x.T, z.T)).full()).T
    return values, values[1 : len(element.slopes) + 1]


def _factors(alternative: Alternative, values: tuple[np.ndarray, np.ndarray]) -> tuple[float, float, float]:
    """Sizes of level, share and rest in an element; the rest is infinite where there is none."""
    points, stages = values
    level = alternative.direction * points[:, alternative.level]
    rest = np.inf if alternative.rest < 0 else float(stages[:, alternative.rest].mean())
    return float(level.max()), float(stages[:, alternative.share].mean()), rest


def _choice(alternative: Alternative, values: tuple[np.ndarray, np.ndarray]) -> Choice:
    level, share, rest = _factors(alternative, values)
    if share <= max(level, 0.0) and share <= rest:
        return Choice.SHARE
    return Choice.REST if rest < max(level, 0.0) else Choice.LEVEL


def _lower_hovers(
    choices: list[list[Choice | None]], at: int, heights: list[float], collapsed: tuple[bool, ...], hover: float
) -> None:
    """Turn low flights between two contacts into contact."""
    whole = [e for e in range(len(choices)) if not collapsed[e]]
    flying = [choices[e][at] is Choice.SHARE for e in whole]
    begin = 0
    while begin < len(whole):
        end = begin
        while end < len(whole) and flying[end]:
            end += 1
        if 0 < begin < end < len(whole) and max(heights[e] for e in whole[begin:end]) < hover:
            for e in whole[begin:end]:
                choices[e][at] = Choice.LEVEL
        begin = max(end, begin + 1)


def _complete(
    alternatives: Alternatives, values: tuple[np.ndarray, np.ndarray], own: Sequence[Choice | None]
) -> list[Choice]:
    """Decide the alternatives of rank 1 of an element, given those of rank 0."""
    decided = list(zip(alternatives.members, own, strict=True))
    shares = [set(alternatives.quantities[alternative.share].variables) for alternative, _ in decided]
    gone = {v for share, (_, choice) in zip(shares, decided, strict=True) if choice is Choice.SHARE for v in share}
    kept = [share for share, (_, choice) in zip(shares, decided, strict=True) if choice in (Choice.LEVEL, Choice.REST)]
    chosen: list[Choice] = []
    for share, (alternative, choice) in zip(shares, decided, strict=True):
        if choice is None:
            choice = Choice.SHARE if share and share <= gone else _secondary(alternative, values, whole=share in kept)
        chosen.append(choice)
    for share in kept:
        _release(alternatives, values, chosen, shares, share)
    return chosen


def _secondary(alternative: Alternative, values: tuple[np.ndarray, np.ndarray], *, whole: bool) -> Choice:
    """A alternative of rank 1 in an element with contact; one on the whole of the contact's share cannot end it."""
    level, _, rest = _factors(alternative, values)
    if alternative.rest >= 0 and rest < float(np.abs(values[0][:, alternative.level]).max()):
        return Choice.REST
    if whole or values[1][:, alternative.share].max() > max(level, 0.0):
        return Choice.LEVEL
    return Choice.SHARE


def _release(
    alternatives: Alternatives,
    values: tuple[np.ndarray, np.ndarray],
    chosen: list[Choice],
    shares: list[set[int]],
    contact: set[int],
) -> None:
    """Where a contact would have no force left to act with, give back the part whose level is smallest."""
    parts = [
        i
        for i, alternative in enumerate(alternatives.members)
        if alternative.rank == 1 and chosen[i] is Choice.SHARE and shares[i] & contact
    ]
    if contact and contact <= {v for i in parts for v in shares[i]}:
        chosen[min(parts, key=lambda i: _factors(alternatives.members[i], values)[0])] = Choice.LEVEL
