"""Processes of our own: how many there may be, and how they end."""

from __future__ import annotations

import contextlib
import ctypes
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from types import FrameType
from typing import Any

import psutil

_GLANCE = 0.2
"""s for which cores are looked at; this process sleeps meanwhile, so that its own counts as free."""

FORKS = sys.platform == "linux"
"""Whether a process can be forked safely."""

_PARENT_DEATH_SIGNAL = 1
"""PR_SET_PDEATHSIG of prctl(2)."""


def free_cores() -> int:
    """Return how many cores this process may use that are not busy with others just now, at least one.

    The load average still counts what ended a minute ago, and of two plans after each other the second would find a
    single core.
    """
    busy = psutil.cpu_percent(interval=_GLANCE, percpu=True)
    own = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(len(busy))
    return max(1, round(sum(1.0 - busy[core] / 100.0 for core in own if core < len(busy))))


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


def cores_for(asked: int | None) -> Cores:
    """Return the cores on which may be worked: as many as are asked for, by default those that are free.

    A process that was started to work beside others has one.

    Args:
        asked: how many; None or zero for those that are free.
    """
    if multiprocessing.parent_process() is not None:
        return Cores(1)
    return Cores(asked or free_cores())


class ForkedPool:
    """Processes that leave Ctrl-C to this one and end with it, for values of one function.

    They are forked when the first value is asked for, and know what the function refers to then; arguments and values
    are pickled.

    Args:
        processes: how many; an attribute, too.
        function: argument -> value.
        first: called once in each process.
    """

    def __init__(self, processes: int, function: Callable[[Any], Any], first: Callable[[], None]) -> None:
        self.processes, context = processes, multiprocessing.get_context("fork")
        self._pool = ProcessPoolExecutor(processes, mp_context=context, initializer=_begin, initargs=(function, first))

    def submit(self, argument: Any) -> Future[Any]:
        """Return the value of an argument, to come."""
        with _interrupts_held():
            return self._pool.submit(_called, argument)

    def end(self) -> None:
        """End all processes at once, whatever they are doing."""
        processes = list((self._pool._processes or {}).values())  # None once the pool has ended
        self._pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.terminate()


@contextlib.contextmanager
def _interrupts_held() -> Iterator[None]:
    """Handle a Ctrl-C after the block: while Python forks, what its handler raises is printed and lost."""
    handler = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(handler):
        yield
        return
    held: list[FrameType | None] = []
    signal.signal(signal.SIGINT, lambda _, frame: held.append(frame))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
    for frame in held:
        handler(signal.SIGINT, frame)


_function: Callable[[Any], Any]


def _called(argument: Any) -> Any:
    return _function(argument)


def _begin(function: Callable[[Any], Any], first: Callable[[], None]) -> None:
    global _function  # of a process that was forked to call it
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PARENT_DEATH_SIGNAL, signal.SIGKILL)
    _function = function
    first()
