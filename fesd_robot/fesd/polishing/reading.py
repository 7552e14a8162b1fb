"""From a nearly complementary trajectory to its branch: the active factor of every condition in every element."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import casadi as ca
import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch, HeldAt
from fesd_robot.fesd.polishing.conditions import ConditionFactors, ElementConditions
from fesd_robot.fesd.polishing.jumps import jump_factors
from fesd_robot.fesd.trajectory import Element

WITHOUT_LENGTH = 0.03
"""An element shorter than this times its equal part of the interval has no length: nothing happens in it."""

COLLAPSED = 1e-7
"""The same of an element of an exact motion: one at its least length, a tolerance of IPOPT above it. Between this and a
millionth there are none, above that what is short is a mode."""

GRAZING_FLIGHT = 2e-3
"""A flight that stays this low (m) between two elements with contact is one with contact."""


def read_branch(
    conditions: ElementConditions, elements: Sequence[Element], steps: np.ndarray, grazing: float
) -> Branch:
    """Return the branch of a trajectory whose products are small but not zero.

    The decision is one an element, from all its points together: of a condition's factors the smaller one vanishes.
    Conditions of the position level are decided first; those of the velocity level only where their H is left.

    Args:
        conditions: of the system.
        elements: of the trajectory, in time order.
        steps: equal part of the interval of every element, numerical time.
        grazing: see `GRAZING_FLIGHT`; 0 takes every flight as it is.
    """
    sizes = [ElementSizes.of(conditions, element) for element in elements]
    without_length = tuple(bool(e.step < WITHOUT_LENGTH * h) for e, h in zip(elements, steps, strict=True))
    position = [
        [size.smallest(member) if member.condition.level == "position" else None for member in conditions.members]
        for size in sizes
    ]
    if grazing > 0:
        for at, member in enumerate(conditions.members):
            if member.invariant_state is not None:
                heights = [size.points[:, member.G].max() for size in sizes]
                _close_grazing_flights(position, at, heights, without_length, grazing)
    factors = [_velocity_level(size, own) for size, own in zip(sizes, position, strict=True)]
    _settle_idle(conditions, sizes, factors, without_length)
    _settle_shares(conditions, sizes, factors, without_length)
    if conditions.jumps:
        jumps = jump_factors(conditions, elements, factors, without_length)
        factors = [[*own, *jump] for own, jump in zip(factors, jumps, strict=True)]
    return Branch(conditions.labels, tuple(tuple(own) for own in factors), without_length)


def drop_elements(
    branch: Branch, elements: Sequence[Element], steps: np.ndarray, shortest: float = WITHOUT_LENGTH
) -> Branch | None:
    """Return the branch in which the elements that have shrunk to nothing have no length; None if there are none.

    Args:
        branch: of the elements.
        elements: of the trajectory, in time order.
        steps: equal part of the interval of every element, numerical time.
        shortest: of their equal parts, what has a length.
    """
    short = [e.step < shortest * h for e, h in zip(elements, steps, strict=True)]
    without_length = tuple(bool(old or new) for old, new in zip(branch.without_length, short, strict=True))
    return None if without_length == branch.without_length else replace(branch, without_length=without_length)


def out_of_elements(conditions: ElementConditions, branch: Branch, elements: Sequence[Element]) -> list[int]:
    """Return the intervals that have no element to spare: each of theirs has a length and differs from its neighbours.

    One switch more, and such an interval cannot hold its motion.

    Args:
        conditions: of the system.
        branch: of the elements.
        elements: of the trajectory, in time order.
    """
    intervals = []
    for interval in sorted({element.interval for element in elements}):
        own = [e for e, element in enumerate(elements) if element.interval == interval]
        switches = not any(
            conditions.goes_on(branch.factors[before], branch.factors[after]) for before, after in pairwise(own)
        )
        if len(own) > 1 and switches and not any(branch.without_length[e] for e in own):
            intervals.append(interval)
    return intervals


@dataclass(frozen=True)
class ElementSizes:
    """The quantities of an element.

    Attributes:
        conditions: of the system.
        points: at all points, left boundary first, (points, n).
        stages: at the stages only, (n_s, n).
    """

    conditions: ElementConditions
    points: np.ndarray
    stages: np.ndarray

    @classmethod
    def of(cls, conditions: ElementConditions, element: Element) -> ElementSizes:
        """Return the quantities of an element."""
        x = np.vstack([element.x_left, element.x])
        own = element.z if len(element.z) == len(element.x) else np.vstack([element.z, element.z[-1:]])
        z = np.vstack([element.z_left, own])
        points = np.asarray(ca.DM(conditions.values.map(len(x))(x.T, z.T)).full()).T
        return cls(conditions, points, points[1 : len(element.slopes) + 1])

    def G(self, member: ConditionFactors) -> float:
        """Largest G of a condition."""
        points = self.stages if member.condition.held_at.algebraic else self.points
        if member.condition.held_at is HeldAt.RIGHT_BOUNDARY:
            points = points[-1:]
        return float((member.direction * points[:, member.G]).max())

    def complement(self, member: ConditionFactors) -> float:
        """Mean complement of a condition; infinite where there is none."""
        return np.inf if member.complement is None else float(self.stages[:, member.complement].mean())

    def smallest(self, member: ConditionFactors) -> ActiveFactor:
        """Return the factor of a condition that is the smallest."""
        G, H, complement = self.G(member), float(self.stages[:, member.H].mean()), self.complement(member)
        if max(G, 0.0) >= H and complement >= H:
            return ActiveFactor.H
        return ActiveFactor.COMPLEMENT if complement < max(G, 0.0) else ActiveFactor.G


def _close_grazing_flights(
    factors: list[list[ActiveFactor | None]],
    at: int,
    heights: list[float],
    without_length: tuple[bool, ...],
    grazing: float,
) -> None:
    """Turn low flights between two contacts into contact."""
    whole = [e for e in range(len(factors)) if not without_length[e]]
    flying = [factors[e][at] is ActiveFactor.H for e in whole]
    begin = 0
    while begin < len(whole):
        end = begin
        while end < len(whole) and flying[end]:
            end += 1
        if 0 < begin < end < len(whole) and max(heights[e] for e in whole[begin:end]) < grazing:
            for e in whole[begin:end]:
                factors[e][at] = ActiveFactor.G
        begin = max(end, begin + 1)


def _velocity_level(sizes: ElementSizes, position: Sequence[ActiveFactor | None]) -> list[ActiveFactor]:
    """Decide the conditions of the velocity level of an element, given those of the position level."""
    conditions = sizes.conditions
    multipliers = [conditions.variables(member.H) for member in conditions.members]
    zero, closed = conditions.vanishing(position), (ActiveFactor.G, ActiveFactor.COMPLEMENT)
    positive = [own for own, factor in zip(multipliers, position, strict=True) if factor in closed]
    factors: list[ActiveFactor] = []
    for multiplier, member, factor in zip(multipliers, conditions.members, position, strict=True):
        if factor is None and multiplier and multiplier <= zero:
            factor = ActiveFactor.H
        factors.append(factor or _in_contact(sizes, member, whole=multiplier in positive))
    for group in conditions.vector_groups:
        own = {factors[i] for i in group}
        for vanishes in (ActiveFactor.H, ActiveFactor.COMPLEMENT):
            if vanishes in own:
                for i in group:
                    factors[i] = vanishes
                break
    for contact in positive:
        _release(sizes, factors, multipliers, contact)
    return _without_repetition(conditions, factors)


def _settle_shares(
    conditions: ElementConditions,
    sizes: Sequence[ElementSizes],
    factors: list[list[ActiveFactor]],
    without_length: tuple[bool, ...],
) -> None:
    """Let one share of every joint that the clock's rate is split into be free, and shares of impacts be as before.

    Where all shares of a joint would vanish, that with the smallest G does not. While the clock stands still they mean
    nothing, and are those of the element before, or after if it is the first.
    """
    for group in conditions.shares.values():
        for size, own in zip(sizes, factors, strict=True):
            if all(own[i] is ActiveFactor.H for i in group):
                own[group[int(np.argmin([size.G(conditions.members[i]) for i in group]))]] = ActiveFactor.G
        _as_before_rest(group, factors, without_length)


def _settle_idle(
    conditions: ElementConditions,
    sizes: Sequence[ElementSizes],
    factors: list[list[ActiveFactor]],
    without_length: tuple[bool, ...],
) -> None:
    """Let what means nothing while the clock stands still be as before, and else be decided without the clock.

    The components of a vector are zero together, or the H that they share is; what that implies holds G.
    """
    groups = [group for group in conditions.vector_groups if conditions.members[group[0]].condition.idle]
    for group in groups:
        for size, own in zip(sizes, factors, strict=True):
            fast = max(size.G(conditions.members[i]) for i in group)
            moves = float(size.stages[:, conditions.members[group[0]].H].mean()) <= max(fast, 0.0)
            for i in group:
                own[i] = ActiveFactor.H if moves else ActiveFactor.G
    members = [i for i, member in enumerate(conditions.members) if member.condition.idle]
    implied = [i for i in members if not any(i in group for group in groups)]
    for own in factors:
        for i in implied:
            own[i] = ActiveFactor.G
    _as_before_rest(members, factors, without_length)


def _as_before_rest(
    members: Sequence[int], factors: list[list[ActiveFactor]], without_length: tuple[bool, ...]
) -> None:
    """Let members be those of the element before where the clock stands still, or of the first one in which it runs."""
    running = [e for e, own in enumerate(factors) if ActiveFactor.COMPLEMENT not in own and not without_length[e]]
    for e, own in enumerate(factors):
        if running and e not in running:
            source = max((r for r in running if r < e), default=running[0])
            for i in members:
                own[i] = factors[source][i]


def _without_repetition(conditions: ElementConditions, factors: list[ActiveFactor]) -> list[ActiveFactor]:
    """Return the factors in which no H is held at zero beside a G that others hold at zero from both sides.

    Such a condition is met already, and its H is left free: friction at a contact that may not slip.
    """
    held = {
        (member.G, member.direction)
        for member, factor in zip(conditions.members, factors, strict=True)
        if factor is ActiveFactor.G
        and member.condition.vanishing
        and member.condition.held_at is not HeldAt.RIGHT_BOUNDARY
    }
    return [
        ActiveFactor.G if member.condition.vanishing and {(member.G, 1), (member.G, -1)} <= held else factor
        for member, factor in zip(conditions.members, factors, strict=True)
    ]


def _in_contact(sizes: ElementSizes, member: ConditionFactors, *, whole: bool) -> ActiveFactor:
    """A condition of the velocity level in an element with contact; one on the contact's whole H cannot end it."""
    if member.complement is not None and not whole:
        return sizes.smallest(member)
    if sizes.complement(member) < float(np.abs(sizes.points[:, member.G]).max()):
        return ActiveFactor.COMPLEMENT
    if whole or sizes.stages[:, member.H].max() > max(sizes.G(member), 0.0):
        return ActiveFactor.G
    return ActiveFactor.H


def _release(sizes: ElementSizes, factors: list[ActiveFactor], multipliers: list[set[int]], contact: set[int]) -> None:
    """Where a contact would have no force left to act with, give back the part whose G is smallest."""
    members = sizes.conditions.members
    parts = [
        i
        for i, member in enumerate(members)
        if member.condition.level == "velocity" and factors[i] is ActiveFactor.H and multipliers[i] & contact
    ]
    if contact and contact <= {v for i in parts for v in multipliers[i]}:
        factors[min(parts, key=lambda i: sizes.G(members[i]))] = ActiveFactor.G
