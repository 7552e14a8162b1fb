"""Which row is planned next, and from which solved one it begins."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

import numpy as np


class Schedule(Protocol):
    """The order of rows."""

    def next(self) -> tuple[int, int | None] | None:
        """Return a row, and the solved one that it begins from; None if there are no more."""

    def solved(self, number: int) -> None:
        """Take note of a solved row."""


class InTurn:
    """Rows one after the other, each from its task alone.

    Args:
        total: number of rows.
        done: whether a row is there already, by number.
    """

    def __init__(self, total: int, done: bytearray) -> None:
        self._at, self._total, self._done = 0, total, done

    def next(self) -> tuple[int, int | None] | None:
        """Return the next row that is not there."""
        self._at = self._done.find(0, self._at)
        if not 0 <= self._at < self._total:
            self._at = self._total
            return None
        self._at += 1
        return self._at - 1, None

    def solved(self, number: int) -> None:
        """Change nothing."""


class FromNearest:
    """Rows from their nearest solved ones, the row that is nearest to any solved one first.

    Args:
        places: where rows lie to each other, (rows, keys).
        done: whether a row is there already, by number.
        solved: numbers of rows that are there and solved.
    """

    def __init__(self, places: np.ndarray, done: bytearray, solved: Iterable[int]) -> None:
        self._places = places
        self._open = np.frombuffer(done, dtype=np.uint8) == 0
        self._distance = np.full(len(places), np.inf, dtype=np.float32)
        self._nearest = np.full(len(places), -1, dtype=np.int32)
        middle = 0.5 * (places.min(axis=0) + places.max(axis=0))
        self._from_middle = np.square(places - middle).sum(axis=1)
        for number in solved:
            self.solved(number)

    def next(self) -> tuple[int, int | None] | None:
        """Return the open row that is nearest to a solved one, the middle one before any is solved."""
        if not self._open.any():
            return None
        reached = np.where(self._open, self._distance, np.inf)
        number = int(np.argmin(reached))
        if not np.isfinite(reached[number]):
            number = int(np.argmin(np.where(self._open, self._from_middle, np.inf)))
        self._open[number] = False
        nearest = int(self._nearest[number])
        return number, nearest if nearest >= 0 else None

    def solved(self, number: int) -> None:
        """Let rows to which this is the nearest begin from it."""
        distance = np.square(self._places - self._places[number]).sum(axis=1)
        nearer = distance < self._distance
        self._distance[nearer], self._nearest[nearer] = distance[nearer], number
