"""What a neighbour changes: the patterns of some contacts in some intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fesd_robot.fesd.neighbours.contact_conditions import ContactConditions
from fesd_robot.fesd.neighbours.patterns import Pattern


@dataclass(frozen=True)
class Change:
    """The patterns that some contacts get in some intervals.

    Attributes:
        what: is moved, and how, in words.
        steps: contacts and their patterns by interval, placed one after the other.
    """

    what: str
    steps: Sequence[tuple[ContactConditions, Mapping[int, Pattern]]]

    @property
    def intervals(self) -> range:
        """All from the first to the last that changes."""
        changed = [k for _, patterns in self.steps for k in patterns]
        return range(min(changed), max(changed) + 1)
