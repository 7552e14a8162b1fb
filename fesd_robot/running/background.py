"""A value that another process works out while this one goes on."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable
from concurrent.futures.process import BrokenProcessPool
from typing import Generic, TypeVar

from fesd_robot.errors import FesdRobotError
from fesd_robot.running.processes import ForkedPool

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
        self._pool = ForkedPool(1, lambda _: function(), _nothing) if sys.platform == "linux" else None
        self._value = self._pool.submit(None) if self._pool else None

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


def _nothing() -> None:
    """Nothing is to be said in the other process."""
