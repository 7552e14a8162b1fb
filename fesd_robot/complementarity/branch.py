"""A branch of a problem with complementarity conditions: the factor of each that vanishes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

from fesd_robot.complementarity.labels import Label
from fesd_robot.errors import DimensionError, ModelError


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

    Raises:
        DimensionError: factors or lengths that are not one an element, or not one factor a condition.
    """

    conditions: tuple[Label, ...]
    factors: tuple[tuple[ActiveFactor, ...], ...]
    without_length: tuple[bool, ...]

    def __post_init__(self) -> None:
        shape, expected = (len(self.without_length),), (len(self.factors),)
        if shape != expected:
            raise DimensionError(f"without_length has shape {shape}, expected {expected}, one an element")
        for e, factors in enumerate(self.factors):
            if len(factors) != len(self.conditions):
                raise DimensionError(f"element {e} has {len(factors)} factors for {len(self.conditions)} conditions")

    @classmethod
    def of_pairs(cls, conditions: Sequence[Label], factors: Sequence[ActiveFactor]) -> Branch:
        """Return the branch of a problem without finite elements.

        Args:
            conditions: label of every pair, (n_pairs).
            factors: active factor of every pair, (n_pairs).
        """
        return cls(tuple(conditions), (tuple(factors),), (False,))

    @cached_property
    def contacts(self) -> tuple[str, ...]:
        """Names of the contacts that conditions belong to, in their order."""
        return tuple(dict.fromkeys(label.contact for label in self.conditions if label.contact is not None))

    def of_contact(self, element: int, contact: str) -> Mapping[tuple[str, str], ActiveFactor]:
        """Return (kind, subject) of every condition of a contact -> its active factor in an element.

        Args:
            element: number of the element in the trajectory.
            contact: name of the contact.

        Raises:
            ModelError: two conditions of one kind and subject, as in the branch of a problem without elements.
        """
        return self._active(element, [label.contact == contact for label in self.conditions])

    @cached_property
    def joints(self) -> tuple[str, ...]:
        """Names of the velocity coordinates with dry friction that conditions belong to, in their order."""
        return tuple(dict.fromkeys(label.joint for label in self.conditions if label.joint is not None))

    def of_joint(self, element: int, joint: str) -> Mapping[tuple[str, str], ActiveFactor]:
        """Return (kind, subject) of every condition of a joint's dry friction -> its active factor in an element.

        Args:
            element: number of the element in the trajectory.
            joint: name of the velocity coordinate.

        Raises:
            ModelError: two conditions of one kind and subject, as in the branch of a problem without elements.
        """
        return self._active(element, [label.joint == joint for label in self.conditions])

    def _active(self, element: int, chosen: Sequence[bool]) -> Mapping[tuple[str, str], ActiveFactor]:
        active: dict[tuple[str, str], ActiveFactor] = {}
        for label, factor, own in zip(self.conditions, self.factors[element], chosen, strict=True):
            if own:
                if (label.kind, label.subject) in active:
                    raise ModelError(f"'{label}' stands twice in element {element}, expected the branch of elements")
                active[label.kind, label.subject] = factor
        return active
