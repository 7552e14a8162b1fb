"""The conditions of one contact, or of one joint with dry friction, and their active sets.

They are not `contact.ContactMode`, which is read from them: `fesd` knows conditions, whatever form of the contact logic
they are of, but not what contacts do. An active set is finer, too: two that differ in the friction after a bounce only
are one mode.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.exactness import NO_VELOCITY
from fesd_robot.fesd.polishing import ElementConditions

ActiveSet = tuple[ActiveFactor, ...]
"""Active factors of the conditions of one contact, or of the dry friction of one joint: its part of a branch."""


@dataclass(frozen=True)
class ContactConditions:
    """The conditions of one contact, or of one joint with dry friction, which is never in flight.

    Attributes:
        name: of the contact, or of the joint.
        conditions: all of the system.
        members: which of them are its own, as indices into `conditions.members`.
        is_joint: whether it is a joint.
    """

    name: str
    conditions: ElementConditions
    members: tuple[int, ...]
    is_joint: bool = False

    @classmethod
    def of(cls, conditions: ElementConditions, branch: Branch) -> list[ContactConditions]:
        """Return those of every contact that has a condition of the position level, and of every joint."""
        own = branch.conditions[: len(conditions.members)]
        found = [
            cls(name, conditions, tuple(i for i, label in enumerate(own) if label.contact == name))
            for name in branch.contacts
        ]
        joints = [cls(name, conditions, tuple(group), is_joint=True) for name, group in conditions.shares.items()]
        return [*(one for one in found if one._positions), *joints]

    @property
    def in_words(self) -> str:
        """What it is, with its name."""
        return f"{'joint' if self.is_joint else 'contact'} '{self.name}'"

    @cached_property
    def _positions(self) -> list[int]:
        """Numbers, in an active set, of the conditions of the position level."""
        return [n for n, i in enumerate(self.members) if self.conditions.members[i].condition.level == "position"]

    @cached_property
    def parts(self) -> list[int]:
        """Numbers, in an active set, of the conditions on a part of the contact's force: friction to one side."""
        own = [self.conditions.members[i] for i in self.members]
        whole = {frozenset(self.conditions.variables(own[n].H)) for n in self._positions}
        return [n for n, one in enumerate(own) if frozenset(self.conditions.variables(one.H)) not in whole]

    def of_factors(self, factors: Sequence[ActiveFactor]) -> ActiveSet:
        """Return the active set, of all factors of an element."""
        return tuple(factors[i] for i in self.members)

    @property
    def flight(self) -> ActiveSet:
        """The active set in which no condition holds anything of the contact on the ground."""
        return tuple(ActiveFactor.H for _ in self.members)

    def is_flight(self, active: ActiveSet) -> bool:
        """Whether the contact has no force; a joint is never in flight."""
        return not self.is_joint and all(active[n] is ActiveFactor.H for n in self._positions)

    @staticmethod
    def is_impact(active: ActiveSet) -> bool:
        """Whether the clock stands still."""
        return ActiveFactor.COMPLEMENT in active

    def mirrored(self, active: ActiveSet) -> ActiveSet:
        """Return an active set in which the contact slips to the other side; the same if it does not slip."""
        sides = [active[n] for n in self.parts]
        turned = dict(zip(self.parts, reversed(sides), strict=True)) if len(sides) == 2 else {}
        return tuple(turned.get(n, factor) for n, factor in enumerate(active))

    def impacts(self, after: ActiveSet, state: np.ndarray, algebraic: np.ndarray) -> list[list[ActiveSet]]:
        """Return the active sets of an impact, in the order in which they follow each other.

        Where there is friction the contact slips first, and then sticks if it does so afterwards: to the side to which
        it moves, or, if it comes down without moving along the ground, to either, one sequence for each.

        Args:
            after: the active set after the impact, with a force.
            state, algebraic: before the impact, (n_x) and (n_z).
        """
        rigid = any(self.conditions.members[i].condition.complement is not None for i in self.members)
        if self.conditions.jumps or not rigid:
            return [[]]  # an impact is an impulse where the contact begins, and a compliant contact has none
        values = np.asarray(self.conditions.values(state, algebraic)).ravel()
        own = [self.conditions.members[i] for i in self.members]
        parts = self.parts
        along = {own[n].G for n in parts}
        slipping, sticking = list(after), list(after)
        for n, one in enumerate(own):
            if one.complement is not None:
                slipping[n] = ActiveFactor.COMPLEMENT
                sticking[n] = after[n] if one.G in along else ActiveFactor.COMPLEMENT
            elif n in parts:
                slipping[n] = ActiveFactor.H if one.direction * values[one.G] > 0 else ActiveFactor.G
        if len(parts) == 2 and all(abs(values[one]) < NO_VELOCITY for one in along):
            slipping[parts[0]], slipping[parts[1]] = ActiveFactor.G, ActiveFactor.H
            sides = [tuple(slipping), self.mirrored(tuple(slipping))]
        else:
            sides = [tuple(slipping)]
        sticks = parts and all(after[n] is ActiveFactor.G for n in parts)
        return [[side, tuple(sticking)] if sticks else [side] for side in sides]
