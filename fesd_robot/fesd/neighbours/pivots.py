"""From a direction of descent to branches on which it may be followed: the modes of whole elements are completed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.fesd.neighbours.contact_conditions import ActiveSet, ContactConditions
from fesd_robot.fesd.neighbours.patterns import Factors, with_active
from fesd_robot.fesd.polishing import BranchMotion, ElementConditions, with_impulses
from fesd_robot.fesd.trajectory import Element

STEP = 1e-3
"""Part of the direction by which rates are measured."""

LEAST_RATE = 1e-6
"""A factor that grows by less, per unit of the direction, stays zero."""

ACTIVE = 1e-7
"""A factor up to this is zero."""


@dataclass(frozen=True)
class Pivots:
    """The branches that a direction points to.

    Following single pairs leads to no mode: a velocity would be free while the force is still held. So for every
    element in which the direction leaves the active factor of a condition, the mode of that contact is completed:

    - flight, if the contact has no force and wants none;
    - an impact, if the clock stands still and stays so;
    - else contact; it slips to the side to which its velocity grows, and sticks if to none;
    - a joint with dry friction slides as it moves; at rest, to the side to which its velocity grows, or it sticks.

    An element without length to which the direction gives one has the mode that the direction leads to, too. If it is
    that of a neighbour in its interval, the direction only moves the ends of elements that would be equally long
    (`growing_for_nothing`), and gains errors of the discretisation.

    Attributes:
        motion: of a collocation scheme.
        direction: of descent, (n).

    Source: modes in place of the pairs of Nurkanovic, Leyffer, arXiv 2501.13835.
    """

    motion: BranchMotion
    direction: np.ndarray

    @property
    def branch(self) -> Branch:
        """On which the motion lies."""
        return self.motion.branch

    @property
    def conditions(self) -> ElementConditions:
        """What can vanish in an element."""
        return self.motion.polisher.conditions

    def branches(self) -> Iterator[Branch]:
        """Yield the branch in which all these elements have their completed modes, then those in which one has it."""
        none = self.growing_for_nothing
        completed = ((e, self._completed(e)) for e in range(len(self.branch.factors)) if e not in none)
        changed = {e: factors for e, factors in completed if factors}
        if not changed:
            return
        yield self._with(changed)
        if len(changed) > 1:
            for e in sorted(changed, key=lambda e: -self._rate(e)):
                yield self._with({e: changed[e]})

    @cached_property
    def growing_for_nothing(self) -> frozenset[int]:
        """Elements without length to which the direction gives one, in the mode of a neighbour in their interval."""
        return frozenset(e for e in range(len(self._now)) if self._grows(e) and self._as_beside(e))

    def _grows(self, e: int) -> bool:
        """Whether an element has no length, and gets one."""
        return self.branch.without_length[e] and self._then[e].step - self._now[e].step > LEAST_RATE * STEP

    def _as_beside(self, e: int) -> bool:
        """Whether the completed mode is that of the element with a length before or after it in its interval."""
        interval, members = self._now[e].interval, len(self.conditions.members)
        completed = (self._completed(e) or ())[:members]
        for others in (range(e - 1, -1, -1), range(e + 1, len(self._now))):
            own = (o for o in others if self._now[o].interval == interval and not self.branch.without_length[o])
            beside = next(own, None)
            if beside is not None and self.branch.factors[beside][:members] == completed:
                return True
        return False

    def _with(self, changed: dict[int, Factors]) -> Branch:
        factors = [changed.get(e, own) for e, own in enumerate(self.branch.factors)]
        without = [none and e not in changed for e, none in enumerate(self.branch.without_length)]
        return with_impulses(
            self.conditions, replace(self.branch, factors=tuple(factors), without_length=tuple(without))
        )

    @cached_property
    def _contacts(self) -> list[ContactConditions]:
        return ContactConditions.of(self.conditions, self.branch)

    @cached_property
    def _now(self) -> list[Element]:
        return self.motion.elements

    @cached_property
    def _then(self) -> list[Element]:
        return self.motion.transcription.unpack(self.motion.w + STEP * self.direction)

    def _quantities(self, element: Element) -> np.ndarray:
        """Return the quantities at the stages, (n_s, quantities)."""
        stages = len(element.slopes)
        return np.array([np.asarray(self.conditions.values(element.x[j], element.z[j])).ravel() for j in range(stages)])

    def _rates(self, e: int) -> np.ndarray:
        """Return the largest rate of every quantity, with its sign, (quantities)."""
        rates = (self._quantities(self._then[e]) - self._quantities(self._now[e])) / STEP
        return np.asarray(rates[np.argmax(np.abs(rates), axis=0), np.arange(rates.shape[1])])

    def _rate(self, e: int) -> float:
        """Return the largest rate of a factor that an element holds at zero."""
        rates, held = self._rates(e), self.branch.factors[e]
        at = [member.quantity(factor) for member, factor in zip(self.conditions.members, held, strict=False)]
        return float(np.abs(rates[at]).max(initial=0.0))

    def _completed(self, e: int) -> Factors | None:
        """Return the factors of an element, the modes that the direction leaves completed; None if it leaves none."""
        grows = self._grows(e)
        if self.branch.without_length[e] and not grows:
            return None
        factors, rates, now = self.branch.factors[e], self._rates(e), self._quantities(self._now[e])
        for contact in self._contacts:
            active = contact.of_factors(factors)
            if contact.is_joint:
                if ActiveFactor.COMPLEMENT not in factors:
                    factors = with_active(contact, factors, self._completed_joint(contact, active, rates, now))
            elif grows or self._leaves(contact, active, rates):
                factors = with_active(contact, factors, self._completed_contact(contact, active, rates, now))
        return factors if grows or factors != self.branch.factors[e] else None

    def _leaves(self, contact: ContactConditions, active: ActiveSet, rates: np.ndarray) -> bool:
        """Whether a factor that a contact's mode holds at zero does not stay there."""
        for i, factor in zip(contact.members, active, strict=True):
            member = self.conditions.members[i]
            rate = rates[member.quantity(factor)] * (member.direction if factor is ActiveFactor.G else 1)
            if (rate if member.condition.vanishing else abs(rate)) > LEAST_RATE:
                return True
        return False

    def _completed_joint(
        self, contact: ContactConditions, active: ActiveSet, rates: np.ndarray, now: np.ndarray
    ) -> ActiveSet:
        """Return the completed mode of a joint with dry friction; its own if the direction does not leave it."""
        members = [self.conditions.members[i] for i in contact.members]
        at_rest = all(np.abs(now[:, member.G]).max() <= ACTIVE for member in members)
        moving = [rates[member.G] if at_rest else now[:, member.G].mean() for member in members]
        pushes = [
            rates[member.H] > LEAST_RATE
            for member, factor in zip(members, active, strict=True)
            if factor is ActiveFactor.H
        ]
        if not any(pushes) and not (at_rest and any(abs(rate) > LEAST_RATE for rate in moving)):
            return active
        return tuple(
            ActiveFactor.H if member.direction * rate > LEAST_RATE else ActiveFactor.G
            for member, rate in zip(members, moving, strict=True)
        )

    def _completed_contact(
        self, contact: ContactConditions, active: ActiveSet, rates: np.ndarray, now: np.ndarray
    ) -> ActiveSet:
        """Return the completed mode of a contact."""
        members = [self.conditions.members[i] for i in contact.members]
        force = [member.H for member in members if member.condition.level == "position"]
        if all(now[:, at].max() <= ACTIVE and rates[at] <= LEAST_RATE for at in force):
            return tuple(ActiveFactor.H for _ in active)
        clock = [member.complement for member in members if member.complement is not None]
        if contact.is_impact(active) and all(rates[at] <= LEAST_RATE for at in clock):
            return active
        parts = contact.parts
        return tuple(
            ActiveFactor.H if n in parts and member.direction * rates[member.G] > LEAST_RATE else ActiveFactor.G
            for n, member in enumerate(members)
        )
