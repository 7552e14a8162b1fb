"""From a nearly complementary trajectory to the choice that every element makes in every condition."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from fesd_robot.fesd.finish.conditions import Choice, Condition, Conditions
from fesd_robot.fesd.trajectory import Element

COLLAPSED = 0.03
"""An element shorter than this times its equal share has no length: it holds one point, and nothing happens in it."""

HOVER = 2e-3
"""A flight that stays this low (m) between two elements with contact is one with contact."""


@dataclass(frozen=True)
class Structure:
    """What every finite element holds at zero.

    Attributes:
        choices: per element, per condition.
        collapsed: per element.
    """

    choices: tuple[tuple[Choice, ...], ...]
    collapsed: tuple[bool, ...]


def read_structure(conditions: Conditions, elements: Sequence[Element], steps: np.ndarray, hover: float) -> Structure:
    """Return the structure of a trajectory whose products are small but not zero.

    The decision is one an element, from all its points together: of a condition's factors the smaller one vanishes.
    Conditions of rank 0 are decided first; those of rank 1 only where their share is left.

    Args:
        elements: of the trajectory, in time order.
        steps: equal share of the interval of every element, numerical time.
        hover: see `HOVER`; 0 takes every flight as it is.
    """
    values = [_values(conditions, element) for element in elements]
    collapsed = tuple(bool(e.step < COLLAPSED * h) for e, h in zip(elements, steps, strict=True))
    first = [[_choice(c, v) if c.rank == 0 else None for c in conditions.conditions] for v in values]
    if hover > 0:
        for at, condition in enumerate(conditions.conditions):
            if condition.kept >= 0:
                _lower_hovers(first, at, [v[0][:, condition.level].max() for v in values], collapsed, hover)
    choices = [tuple(_complete(conditions, v, own)) for v, own in zip(values, first, strict=True)]
    return Structure(tuple(choices), collapsed)


def collapse(structure: Structure, elements: Sequence[Element], steps: np.ndarray) -> Structure | None:
    """Return the structure without the elements that have shrunk to nothing; None if there are none."""
    short = [e.step < COLLAPSED * h for e, h in zip(elements, steps, strict=True)]
    collapsed = tuple(bool(old or new) for old, new in zip(structure.collapsed, short, strict=True))
    return None if collapsed == structure.collapsed else replace(structure, collapsed=collapsed)


def _values(conditions: Conditions, element: Element) -> tuple[np.ndarray, np.ndarray]:
    """Quantities at all points, left boundary first, and at the stages only: (points, n), (stages, n)."""
    x = np.vstack([element.x_left, element.x])
    own = element.z if len(element.z) == len(element.x) else np.vstack([element.z, element.z[-1:]])
    z = np.vstack([element.z_left, own])
    values = np.asarray(ca.DM(conditions.values.map(len(x))(x.T, z.T)).full()).T
    return values, values[1 : len(element.slopes) + 1]


def _factors(condition: Condition, values: tuple[np.ndarray, np.ndarray]) -> tuple[float, float, float]:
    """Sizes of level, share and rest in an element; the rest is infinite where there is none."""
    points, stages = values
    level = condition.direction * points[:, condition.level]
    rest = np.inf if condition.rest < 0 else float(stages[:, condition.rest].mean())
    return float(level.max()), float(stages[:, condition.share].mean()), rest


def _choice(condition: Condition, values: tuple[np.ndarray, np.ndarray]) -> Choice:
    level, share, rest = _factors(condition, values)
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
    conditions: Conditions, values: tuple[np.ndarray, np.ndarray], own: Sequence[Choice | None]
) -> list[Choice]:
    """Decide the conditions of rank 1 of an element, given those of rank 0."""
    decided = list(zip(conditions.conditions, own, strict=True))
    shares = [set(conditions.quantities[condition.share].variables) for condition, _ in decided]
    gone = {v for share, (_, choice) in zip(shares, decided, strict=True) if choice is Choice.SHARE for v in share}
    kept = [share for share, (_, choice) in zip(shares, decided, strict=True) if choice in (Choice.LEVEL, Choice.REST)]
    chosen: list[Choice] = []
    for share, (condition, choice) in zip(shares, decided, strict=True):
        if choice is None:
            choice = Choice.SHARE if share and share <= gone else _secondary(condition, values, whole=share in kept)
        chosen.append(choice)
    for share in kept:
        _release(conditions, values, chosen, shares, share)
    return chosen


def _secondary(condition: Condition, values: tuple[np.ndarray, np.ndarray], *, whole: bool) -> Choice:
    """A condition of rank 1 in an element with contact; one on the whole of the contact's share cannot end it."""
    level, _, rest = _factors(condition, values)
    if condition.rest >= 0 and rest < float(np.abs(values[0][:, condition.level]).max()):
        return Choice.REST
    if whole or values[1][:, condition.share].max() > max(level, 0.0):
        return Choice.LEVEL
    return Choice.SHARE


def _release(
    conditions: Conditions,
    values: tuple[np.ndarray, np.ndarray],
    chosen: list[Choice],
    shares: list[set[int]],
    contact: set[int],
) -> None:
    """Where a contact would have no force left to act with, give back the part whose level is smallest."""
    parts = [
        i
        for i, condition in enumerate(conditions.conditions)
        if condition.rank == 1 and chosen[i] is Choice.SHARE and shares[i] & contact
    ]
    if contact and contact <= {v for i in parts for v in shares[i]}:
        chosen[min(parts, key=lambda i: _factors(conditions.conditions[i], values)[0])] = Choice.LEVEL
