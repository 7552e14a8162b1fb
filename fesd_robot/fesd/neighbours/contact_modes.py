"""What a contact, or a joint with dry friction, does in an element, as the active factors of its conditions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.fesd.polishing import ElementConditions

NO_SIDE = 1e-6
"""Velocity along the ground, m/s, below which it does not tell to which side a contact slips in an impact."""

ContactMode = tuple[ActiveFactor, ...]
"""Active factors of the conditions of one contact, or of the dry friction of one joint."""


@dataclass(frozen=True)
class ContactModes:
    """The modes of one contact, or of one joint with dry friction, which is never in flight.

    Attributes:
        name: of the contact, or of the joint.
        conditions: of the system.
        members: which conditions are its own, as indices into `conditions.members`.
        is_joint: whether it is a joint.
    """

    name: str
    conditions: ElementConditions
    members: tuple[int, ...]
    is_joint: bool = False

    @classmethod
    def of(cls, conditions: ElementConditions, branch: Branch) -> list[ContactModes]:
        """Return the modes of every contact that has a condition of the position level, and of every joint."""
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
        """Numbers, in the mode, of the conditions of the position level."""
        return [n for n, i in enumerate(self.members) if self.conditions.members[i].condition.level == "position"]

    @cached_property
    def parts(self) -> list[int]:
        """Numbers, in the mode, of the conditions on a part of the contact's force: friction to one side."""
        own = [self.conditions.members[i] for i in self.members]
        whole = {frozenset(self.conditions.variables(own[n].H)) for n in self._positions}
        return [n for n, one in enumerate(own) if frozenset(self.conditions.variables(one.H)) not in whole]

    def of_factors(self, factors: Sequence[ActiveFactor]) -> ContactMode:
        """Return the mode that all factors of an element imply."""
        return tuple(factors[i] for i in self.members)

    @property
    def flight(self) -> ContactMode:
        """The mode in which no condition holds anything of the contact on the ground."""
        return tuple(ActiveFactor.H for _ in self.members)

    def is_flight(self, mode: ContactMode) -> bool:
        """Whether the contact has no force; a joint is never in flight."""
        return not self.is_joint and all(mode[n] is ActiveFactor.H for n in self._positions)

    @staticmethod
    def is_impact(mode: ContactMode) -> bool:
        """Whether the clock stands still."""
        return ActiveFactor.COMPLEMENT in mode

    def mirrored(self, mode: ContactMode) -> ContactMode:
        """Return a mode in which the contact slips to the other side; the mode itself if it does not slip."""
        sides = [mode[n] for n in self.parts]
        turned = dict(zip(self.parts, reversed(sides), strict=True)) if len(sides) == 2 else {}
        return tuple(turned.get(n, factor) for n, factor in enumerate(mode))

    def impacts(self, contact: ContactMode, state: np.ndarray, algebraic: np.ndarray) -> list[list[ContactMode]]:
        """Return the modes of an impact that ends in a mode of contact, in the order in which they follow each other.

        Where there is friction the contact slips first, and then sticks if it does so afterwards: to the side to which
        it moves, or, if it comes down without moving along the ground, to either, one sequence of modes for each.

        Args:
            contact: the mode after the impact.
            state, algebraic: before the impact, (n_x) and (n_z).
        """
        if self.conditions.jumps:
            return [[]]  # an impact is an impulse where the contact begins
        values = np.asarray(self.conditions.values(state, algebraic)).ravel()
        own = [self.conditions.members[i] for i in self.members]
        parts = self.parts
        along = {own[n].G for n in parts}
        slipping, sticking = list(contact), list(contact)
        for n, one in enumerate(own):
            if one.complement is not None:
                slipping[n] = ActiveFactor.COMPLEMENT
                sticking[n] = contact[n] if one.G in along else ActiveFactor.COMPLEMENT
            elif n in parts:
                slipping[n] = ActiveFactor.H if one.direction * values[one.G] > 0 else ActiveFactor.G
        if len(parts) == 2 and all(abs(values[one]) < NO_SIDE for one in along):
            slipping[parts[0]], slipping[parts[1]] = ActiveFactor.G, ActiveFactor.H
            sides = [tuple(slipping), self.mirrored(tuple(slipping))]
        else:
            sides = [tuple(slipping)]
        sticks = parts and all(contact[n] is ActiveFactor.G for n in parts)
        return [[side, tuple(sticking)] if sticks else [side] for side in sides]
