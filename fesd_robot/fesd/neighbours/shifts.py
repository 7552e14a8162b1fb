"""Where a switch may go, as a value."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class ShiftKind(Enum):
    """How a switch moves."""

    TWO_EARLIER = "two intervals earlier"
    EARLIER = "an interval earlier"
    LATER = "an interval later"
    TWO_LATER = "two intervals later"
    TO_BEGINNING = "to the beginning of its interval"
    TO_END = "to the end of its interval"
    INTO = "into interval"
    """From the boundary of two intervals into one of them."""
    WITH_IMPACT = "with impact"
    """It stays on its boundary, and an impact ends the interval before."""
    WITH_LATER_IMPACT = "with impact as the next interval begins"
    WITHOUT_IMPACT = "without impact"


class ImpactSide(Enum):
    """To which side a contact slips in an impact that it gets."""

    FIRST = "to the side to which it moves"
    OTHER = "slipping the other way"
    """Of a contact that comes down without moving along the ground, which may slip to either."""


@dataclass(frozen=True)
class Shift:
    """Where a switch goes.

    Attributes:
        kind: how it moves.
        interval: the one into which it goes; None of other kinds.
        side: of an impact that it gets.
    """

    kind: ShiftKind
    interval: int | None = None
    side: ImpactSide = ImpactSide.FIRST

    @classmethod
    def into(cls, interval: int, side: ImpactSide = ImpactSide.FIRST) -> Shift:
        """Return the shift into an interval."""
        return cls(ShiftKind.INTO, interval, side)

    def __str__(self) -> str:
        where = self.kind.value if self.interval is None else f"{self.kind.value} {self.interval}"
        return f"{where}, {self.side.value}" if self.side is ImpactSide.OTHER else where

    @property
    def stays(self) -> bool:
        """Whether the switch stays where it is."""
        return self.kind in (ShiftKind.WITH_IMPACT, ShiftKind.WITH_LATER_IMPACT, ShiftKind.WITHOUT_IMPACT)


EARLIER, LATER = Shift(ShiftKind.EARLIER), Shift(ShiftKind.LATER)
TWO_EARLIER, TWO_LATER = Shift(ShiftKind.TWO_EARLIER), Shift(ShiftKind.TWO_LATER)
TO_BEGINNING, TO_END = Shift(ShiftKind.TO_BEGINNING), Shift(ShiftKind.TO_END)
WITH_IMPACT, WITHOUT_IMPACT = Shift(ShiftKind.WITH_IMPACT), Shift(ShiftKind.WITHOUT_IMPACT)
