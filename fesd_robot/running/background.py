"""What another process works out while this one goes on."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any, Generic, TypeVar

from fesd_robot.errors import FesdRobotError
from fesd_robot.running.processes import FORKS, ForkedPool

Value = TypeVar("Value")

logger = logging.getLogger(__name__)


class InBackground(Generic[Value]):
    """The value of a function in a process that is forked for it, which is handed over once it is there.

    Only Linux can fork a process safely; elsewhere nothing is worked out.

    Args:
        function: what is worked out; it knows what it refers to as it is now. Its value is pickled.
        hand_over: called with the value, once, from `look`.
    """

    def __init__(self, function: Callable[[], Value], hand_over: Callable[[Value], None]) -> None:
        self._hand_over = hand_over
        self._pool = _forked(function)
        self._value = self._pool.submit(None) if self._pool else None

    @property
    def working(self) -> bool:
        """Whether a value is still to come."""
        return self._value is not None

    def look(self) -> None:
        """Hand the value over if it is there."""
        if self._value is None or not self._value.done():
            return
        value, self._value = self._value, None
        try:
            self._hand_over(value.result())
        except (FesdRobotError, BrokenProcessPool) as error:
            logger.debug("nothing comes of what was done in the background: %s", error)

    def end(self) -> None:
        """End the process, whatever it is doing."""
        if self._pool:
            self._pool.end()
        self._pool = self._value = None


@contextmanager
def in_other_process(work: Callable[[], None]) -> Iterator[None]:
    """Do work in another process while the block runs, and in this one after it where that failed, or cannot be had.

    Args:
        work: knows what it refers to as it is now; what it does has to outlast its process, as files do.
    """
    pool = _forked(work)
    try:
        done = pool.submit(None) if pool else None
        yield
        failed = done is None or done.exception() is not None
    finally:
        if pool:
            pool.end()
    if failed:
        work()


def _forked(function: Callable[[], Any]) -> ForkedPool | None:
    """Return one process for the value of a function, where a process can be forked safely."""
    return ForkedPool(1, lambda _: function(), _nothing) if FORKS else None


def _nothing() -> None:
    """Report nothing in the other process."""
