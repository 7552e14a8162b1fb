"""The time that a task may take, shared by all that is tried for it."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from fesd_robot.errors import FesdRobotError

GRACE_SECONDS, GRACE_SHARE = 1.0, 0.05
"""s, and part of a time limit: for so long after it what was found is still audited."""


WRITING_SECONDS, WRITING_SHARE = 1.0, 0.05
"""s at most, and part of a time limit: kept of it by a command for writing what was found."""


class OutOfTime(FesdRobotError):
    """The time limit came in the middle of work that is worth nothing by halves; what was there before is kept."""


class Deadline:
    """A clock that starts when it is made and knows when the time is over.

    Args:
        limit: seconds in all; None for no limit.
        spent: seconds of them that have passed before.
    """

    def __init__(self, limit: float | None = None, spent: float = 0.0) -> None:
        self._begin, self._limit = time.perf_counter() - spent, math.inf if limit is None else limit

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

    @classmethod
    def of_command(cls, limit: float | None, spent: float) -> Deadline:
        """Return the clock of a command that writes what it finds, too.

        Args:
            limit: seconds for all of it; None for no limit.
            spent: seconds of them that have passed before.
        """
        kept = 0.0 if limit is None else min(WRITING_SECONDS, WRITING_SHARE * limit)
        return cls(limit, spent + kept)

    @property
    def with_grace(self) -> Deadline:
        """A clock for what is left and the time after it in which a motion is still audited."""
        return Deadline(max(self.left, 0.0) + max(GRACE_SECONDS, GRACE_SHARE * self._limit))


_HELD: ContextVar[Deadline | None] = ContextVar("_HELD", default=None)


@contextmanager
def held_to(deadline: Deadline) -> Iterator[None]:
    """Hold all that runs in the block to a deadline, wherever it calls `check_time`; not what other threads do."""
    token = _HELD.set(deadline)
    try:
        yield
    finally:
        _HELD.reset(token)


def held_deadline() -> Deadline | None:
    """Return the deadline that the block is held to, None if it is held to none."""
    return _HELD.get()


def check_time() -> None:
    """End long work that no solver's clock ends, as making derivatives is, where the deadline of its block is over.

    Raises:
        OutOfTime: it is over.
    """
    deadline = _HELD.get()
    if deadline is not None and deadline.left <= 0:
        raise OutOfTime("the time limit is over")


def seconds_to_wait(most: float = math.inf) -> float:
    """Return for how long something may be waited for: until the deadline of the block, s, at most so long."""
    deadline = _HELD.get()
    return most if deadline is None else max(min(deadline.left, most), 0.0)
