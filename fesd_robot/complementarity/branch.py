"""A branch of a problem with complementarity conditions: the factor of each that vanishes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

from fesd_robot.complementarity.labels import Label


class ActiveFactor(Enum):
    """The factor of a complementarity condition that vanishes."""

    G = "G"
    """The multiplier of a switching function is zero, or the switching function is at most zero."""
    H = "H"
    """The Filippov multiplier, or step, is zero."""
    COMPLEMENT = "complement"
    """The complement 1 - beta of a vanishing constraint is zero."""


@dataclass(frozen=True)
class Branch:
    """The active factor of every condition in every finite element.

    A problem that has no finite elements is a single element.

    Attributes:
        conditions: labels of the conditions of one element.
        factors: per element, per condition.
        without_length: elements that have no length, in which nothing happens; as many as there are elements.
    """

    conditions: tuple[Label, ...]
    factors: tuple[tuple[ActiveFactor, ...], ...]
    without_length: tuple[bool, ...]

    @classmethod
    def of_pairs(cls, conditions: Sequence[Label], factors: Sequence[ActiveFactor]) -> Branch:
        """Return the branch of a problem without finite elements."""
        return cls(tuple(conditions), (tuple(factors),), (False,))

    @cached_property
    def contacts(self) -> tuple[str, ...]:
        """Names of the contacts that conditions belong to, in their order."""
        return tuple(dict.fromkeys(label.contact for label in self.conditions if label.contact is not None))

    def of_contact(self, element: int, contact: str) -> Mapping[tuple[str, str], ActiveFactor]:
        """Return (kind, subject) of every condition of a contact -> its active factor in an element."""
        return {
            (label.kind, label.subject): factor
            for label, factor in zip(self.conditions, self.factors[element], strict=True)
            if label.contact == contact
        }
