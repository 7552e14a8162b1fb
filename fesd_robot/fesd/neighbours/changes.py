"""What a neighbour changes: the patterns of some contacts in some intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fesd_robot.fesd.neighbours.contact_modes import ContactModes
from fesd_robot.fesd.neighbours.patterns import Pattern

Key = tuple[str, int, str]
"""What is moved, and how: of two changes with the same key one continues the other."""


@dataclass(frozen=True)
class Change:
    """The patterns that some contacts get in some intervals.

    Attributes:
        key: what is moved, and how.
        what: the same in words.
        steps: contacts and their patterns by interval, placed one after the other.
        hit: as in `Move`.
    """

    key: Key
    what: str
    steps: Sequence[tuple[ContactModes, Mapping[int, Pattern]]]
    hit: bool = False

    @property
    def intervals(self) -> range:
        """All from the first to the last that changes."""
        changed = [k for _, patterns in self.steps for k in patterns]
        return range(min(changed), max(changed) + 1)
