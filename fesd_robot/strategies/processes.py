"""Processes of our own: how many there may be, and how they end."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from typing import Any

from fesd_robot.task import Task

_PARENT_DEATH_SIGNAL = 1
"""PR_SET_PDEATHSIG of prctl(2)."""


def free_cores() -> int:
    """Return how many cores this process may use that are not busy with others, at least one."""
    own = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    others = max(os.getloadavg()[0] - 1.0, 0.0) if hasattr(os, "getloadavg") else 0.0
    return max(1, own - round(others))


def processes_of(task: Task) -> int:
    """Return how many processes may work on a task at once: those it asks for, by default one a free core.

    A process that was itself started to work beside others has no further ones.
    """
    if multiprocessing.parent_process() is not None:
        return 1
    return task.solver.processes or free_cores()


def pool_of(
    processes: int, method: str, initializer: Callable[..., None] | None = None, arguments: tuple[Any, ...] = ()
) -> ProcessPoolExecutor:
    """Return processes that leave Ctrl-C to this one and end with it.

    Args:
        processes: how many.
        method: ``spawn`` or ``fork``, see `multiprocessing`.
        initializer: called in each with the arguments; these need not be picklable if it is forked.
        arguments: of the initializer.
    """
    context = multiprocessing.get_context(method)
    return ProcessPoolExecutor(processes, mp_context=context, initializer=_begin, initargs=(initializer, arguments))


def end_pool(pool: ProcessPoolExecutor) -> None:
    """End all processes at once, whatever they are doing."""
    processes = list((pool._processes or {}).values())  # None once the pool has ended
    pool.shutdown(wait=False, cancel_futures=True)
    for process in processes:
        process.terminate()


def _begin(initializer: Callable[..., None] | None, arguments: tuple[Any, ...]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PARENT_DEATH_SIGNAL, signal.SIGKILL)
    if initializer:
        initializer(*arguments)
