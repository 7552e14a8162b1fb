"""The time that a task may take, shared by all that is tried for it."""

from __future__ import annotations

import math
import time


class Deadline:
    """A clock that starts when it is made and knows when the time is over.

    Args:
        limit: seconds from now on; None for no limit.
    """

    def __init__(self, limit: float | None = None) -> None:
        self._begin, self._limit = time.perf_counter(), math.inf if limit is None else limit

    @property
    def spent(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self._begin

    @property
    def left(self) -> float:
        """Seconds until the time is over, negative afterwards; infinite without a limit."""
        return self._limit - self.spent

    def remaining(self) -> float | None:
        """Return the seconds until the time is over; None without a limit."""
        return None if math.isinf(self._limit) else self.left

    def share(self, part: float) -> Deadline:
        """Return a clock for a part of the time that is left."""
        left = self.remaining()
        return Deadline(None if left is None else part * left)

    def within(self, seconds: float) -> Deadline:
        """Return a clock for some seconds, or for all of the time that is left if that is less."""
        return Deadline(min(seconds, self.left))
