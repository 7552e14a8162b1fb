"""What processes share that plan from several initial guesses: the wish to stop, the least cost so far, the cores."""

from __future__ import annotations

import contextlib
import math
import multiprocessing
from collections.abc import Iterator

from fesd_robot.strategies.attempts import Stop

DEARER = 0.02
"""Of the least cost: a motion that costs at least so much more is not worth refining or certifying. Refinement lowered
the cost of none of 32 tasks by more than 5e-4 of it; most motions cost more afterwards."""


class SharedStop:
    """A wish to stop that processes which are forked later see, too.

    Args:
        stop: asks the user; none if there is nobody to ask.
    """

    def __init__(self, stop: Stop | None) -> None:
        self._stop, self._wished = stop, multiprocessing.Event()

    def here(self, iteration: int, objective: float) -> bool:
        """Ask the user, and tell the others."""
        if self._stop is None or not self._stop(iteration, objective):
            return False
        self._wished.set()
        return True

    def elsewhere(self, iteration: int, objective: float) -> bool:
        """Return whether the user has wished to stop."""
        return self._wished.is_set()


class LeastCost:
    """The cost of the cheapest motion of a task that is solved, which processes that are forked later see, too."""

    def __init__(self) -> None:
        self._least = multiprocessing.Value("d", math.inf)

    @property
    def value(self) -> float:
        """The cost; infinite as long as no motion is solved."""
        return self._least.value

    def note(self, cost: float) -> None:
        """Take note of the cost of a motion that is solved."""
        with self._least.get_lock():
            self._least.value = min(self._least.value, cost)

    def beats(self, cost: float) -> bool:
        """Return whether a motion that costs so much is too dear to go on with (`DEARER`)."""
        least = self.value
        return cost - least > DEARER * abs(least) if math.isfinite(least) else False


class Cores:
    """Cores that one process has for itself.

    Args:
        most: how many.
    """

    def __init__(self, most: int) -> None:
        self.most = most

    @property
    def share(self) -> int:
        """How many processes may work just now, at least one."""
        return self.most


class SharedCores(Cores):
    """Cores that processes which are forked later divide evenly among those of them that work just then.

    Args:
        most: how many.
    """

    def __init__(self, most: int) -> None:
        super().__init__(most)
        self._working = multiprocessing.Value("i", 0)

    @contextlib.contextmanager
    def working(self) -> Iterator[None]:
        """Count as one that works during the block."""
        self._count(1)
        try:
            yield
        finally:
            self._count(-1)

    @property
    def share(self) -> int:
        """How many processes one that works may have just now, at least one."""
        return max(1, self.most // max(1, self._working.value))

    def _count(self, change: int) -> None:
        with self._working.get_lock():
            self._working.value += change
