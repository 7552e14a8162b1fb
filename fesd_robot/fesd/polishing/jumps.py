"""From a nearly complementary trajectory to the impulses that act in it, and how."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fesd_robot.complementarity import ActiveFactor
from fesd_robot.fesd.polishing.conditions import ElementConditions
from fesd_robot.fesd.trajectory import Element

SMALL_IMPULSE = 1e-2
"""An impulse smaller than this times the largest one of the trajectory does not act, unless contact begins with it."""


def jump_factors(
    conditions: ElementConditions,
    elements: Sequence[Element],
    factors: Sequence[Sequence[ActiveFactor]],
    without_length: Sequence[bool],
) -> list[list[ActiveFactor]]:
    """Return the active factors of the jump at the left boundary of every element.

    An impulse acts where contact begins, and where it is larger than its law is violated. Those at elements without
    length act at the next one that has a length.

    Args:
        conditions: of the system.
        elements: of the trajectory, in time order.
        factors: of all other conditions, an element each.
        without_length: elements in which nothing happens.
    """
    assert conditions.jump_values is not None
    values = np.array([np.asarray(conditions.jump_values(e.x_before, e.jump)).ravel() for e in elements])
    laws, sizes = values[:, : conditions.laws], _carried(values[:, conditions.laws :], without_length)
    of_law = [next(i for i, one in enumerate(conditions.jumps) if one.impulse == k) for k in range(conditions.laws)]
    enough = SMALL_IMPULSE * max(float(sizes.max(initial=0.0)), 1e-6)
    result, before = [], None
    for e, element in enumerate(elements):
        after = _quantities(conditions, element)
        own = [ActiveFactor.H] * len(conditions.jumps)
        for k in range(conditions.laws):
            begins = before is not None and _begins(conditions, k, factors[before], factors[e])
            size = sizes[e, of_law[k]]
            if not without_length[e] and (begins or size > max(abs(laws[e, k]), enough)):
                _act(conditions, k, sizes[e], after, own)
        before = before if without_length[e] else e
        result.append(own)
    return result


def _act(
    conditions: ElementConditions, impulse: int, sizes: np.ndarray, after: np.ndarray, own: list[ActiveFactor]
) -> None:
    """Let an impulse act by its law, and of every part of its friction either G or H vanish, not all H."""
    parts = []
    for i, jump in enumerate(conditions.jumps):
        if jump.impulse != impulse:
            continue
        own[i] = ActiveFactor.G
        if jump.condition.vanishing and jump.G is not None:
            parts.append(i)
            if sizes[i] <= max(jump.direction * after[jump.G], 0.0):
                own[i] = ActiveFactor.H
    if parts and all(own[i] is ActiveFactor.H for i in parts):
        own[max(parts, key=lambda i: float(sizes[i]))] = ActiveFactor.G


def _begins(
    conditions: ElementConditions, impulse: int, before: Sequence[ActiveFactor], factors: Sequence[ActiveFactor]
) -> bool:
    """Return whether the pair of an impulse is active in an element and was not in the one before."""
    quantity = next(one.G for one in conditions.jumps if one.impulse == impulse and not one.condition.vanishing)
    pair = next(i for i, member in enumerate(conditions.members) if quantity == member.G)
    return before[pair] is ActiveFactor.H and factors[pair] is ActiveFactor.G


def _carried(sizes: np.ndarray, without_length: Sequence[bool]) -> np.ndarray:
    """Return the impulses with those at elements without length added to the next one that has a length."""
    carried = sizes.copy()
    for e, empty in enumerate(without_length[:-1]):
        if empty:
            carried[e + 1] += carried[e]
            carried[e] = 0.0
    return carried


def _quantities(conditions: ElementConditions, element: Element) -> np.ndarray:
    """Return all quantities at the left boundary, after the jump."""
    return np.asarray(conditions.values(element.x_left, element.z_left)).ravel()
