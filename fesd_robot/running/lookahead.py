"""A function's results for one argument after the other, the next ones being computed meanwhile on other cores."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NotYet
from concurrent.futures.process import BrokenProcessPool
from typing import Any, Generic, TypeVar

from fesd_robot.running.deadline import check_time
from fesd_robot.running.processes import FORKS, Cores, ForkedPool
from fesd_robot.running.stop import Stop, stop_requested

_POLL = 0.2
"""s between two looks at whether to stop."""

_AHEAD = 1
"""How many more arguments than there are processes wait for one, where all processes may work."""

Argument = TypeVar("Argument")
Result = TypeVar("Result")

logger = logging.getLogger(__name__)


class Lookahead(Generic[Argument, Result]):
    """Results of a function in the order of its arguments, whatever the number of processes.

    There are as many of these as there are cores for them, which may change from one argument to the next; with one,
    results are computed in this process. They are forked when so many may work for the first time: they know what the
    function refers to then, and it has to depend on nothing that changes later. Arguments and results are pickled. Only
    Linux can fork a process safely; elsewhere everything is computed in this process.

    Args:
        function: argument -> result.
        cores: how many processes may work.
        stop: asked while results are waited for; True ends them.
        alone: called once in every other process, where nobody looks and nothing stops.
    """

    def __init__(
        self, function: Callable[[Argument], Result], cores: Cores, stop: Stop | None, alone: Callable[[], None]
    ) -> None:
        self._function, self._stop, self._alone = function, stop, alone
        self._cores = cores if FORKS else Cores(1)
        self._pool: ForkedPool | None = None

    def results(self, arguments: Sequence[Argument]) -> Iterator[Result]:
        """Yield the results, in the order of the arguments; those that are not asked for are computed in vain.

        Raises:
            OutOfTime: the time limit came meanwhile.
        """
        done = 0
        try:
            for result in self._computed(arguments):
                yield result
                done += 1
        except BrokenProcessPool:
            logger.warning("a process that tried neighbours of the motion was ended; the search goes on in one process")
            self.close()
            self._cores = Cores(1)
            yield from map(self._function, arguments[done:])

    def close(self) -> None:
        """End the processes."""
        if self._pool:
            self._pool.end()
        self._pool = None

    def _computed(self, arguments: Sequence[Argument]) -> Iterator[Result]:
        running, waiting = deque[Future[Result]](), deque(arguments)
        try:
            while running or waiting:
                share = self._cores.share
                if share == 1 and not running:
                    yield self._function(waiting.popleft())
                    continue
                pool = self._pool_of(share, idle=not running)
                if share <= pool.processes:
                    most = share + _AHEAD if share == pool.processes else share
                    while waiting and len(running) < most:
                        running.append(pool.submit(waiting.popleft()))
                while not running[0].done():
                    if stop_requested(self._stop):
                        return
                    check_time()
                    _wait(running[0])
                yield running.popleft().result()
        finally:
            for future in running:
                future.cancel()

    def _pool_of(self, count: int, idle: bool) -> ForkedPool:
        """Return the pool, one of at least so many processes once a smaller one is idle."""
        if self._pool is None or (idle and self._pool.processes < count):
            self.close()
            self._pool = ForkedPool(count, self._function, self._alone)
        return self._pool


def _wait(future: Future[Any]) -> None:
    try:
        future.exception(timeout=_POLL)
    except NotYet:
        return
