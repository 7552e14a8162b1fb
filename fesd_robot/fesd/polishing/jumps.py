"""From a nearly complementary trajectory to the impulses that act in it, and how."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.dcs import SLIPPING
from fesd_robot.fesd.polishing.conditions import ElementConditions, JumpFactors
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
    pair = _pair(conditions, impulse)
    return before[pair] is ActiveFactor.H and factors[pair] is ActiveFactor.G


def _pair(conditions: ElementConditions, impulse: int) -> int:
    """Return the number of the member that is the pair of an impulse."""
    quantity = next(one.G for one in conditions.jumps if one.impulse == impulse and not one.condition.vanishing)
    return next(i for i, member in enumerate(conditions.members) if quantity == member.G)


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


def without_impulses(conditions: ElementConditions, branch: Branch) -> Branch:
    """Return a branch in which no impulse acts, so that elements of one mode are alike.

    Args:
        conditions: of the system.
        branch: of a trajectory.
    """
    own, none = len(conditions.members), (ActiveFactor.H,) * len(conditions.jumps)
    return replace(branch, factors=tuple((*factors[:own], *none) for factors in branch.factors))


def with_impulses(conditions: ElementConditions, branch: Branch) -> Branch:
    """Return a branch in which the impulses act that its modes need.

    Where contact begins, those of all contacts that are closed act, with the friction of the mode that follows.

    Args:
        conditions: of the system.
        branch: whose impulses are not known.
    """
    if not conditions.jumps:
        return branch
    result, before = [], None
    for e, factors in enumerate(without_impulses(conditions, branch).factors):
        own = list(factors)
        hit = before is not None and not branch.without_length[e]
        begin = [hit and _begins(conditions, k, before or (), factors) for k in range(conditions.laws)]
        for i, jump in enumerate(conditions.jumps):
            if any(begin) and factors[_pair(conditions, jump.impulse)] is ActiveFactor.G:
                own[len(conditions.members) + i] = _as_afterwards(conditions, jump, factors)
        result.append(tuple(own))
        before = before if branch.without_length[e] else factors
    return replace(branch, factors=tuple(result))


def _as_afterwards(conditions: ElementConditions, jump: JumpFactors, factors: Sequence[ActiveFactor]) -> ActiveFactor:
    """Return the active factor of the condition on the same velocity in the element, G of all others."""
    if jump.G is None or not jump.condition.vanishing:
        return ActiveFactor.G
    alike = [
        factor
        for member, factor in zip(conditions.members, factors, strict=False)
        if (member.G, member.direction) == (jump.G, jump.direction) and member.condition.label.kind != SLIPPING
    ]
    return alike[0] if alike else ActiveFactor.G
