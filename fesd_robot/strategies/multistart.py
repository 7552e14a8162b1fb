"""The same task from several first guesses, on all cores: where one begins decides which local optimum is reached."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait

from fesd_robot.plans.plan import Plan
from fesd_robot.task import Task

_POLL = 0.2
"""s between two looks at whether to stop."""


def solve_multistart(
    attempt: Callable[[Task], Plan],
    tasks: list[Task],
    on_result: Callable[[int, Plan], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> list[Plan | None]:
    """Return the plan of every task, each solved in a process of its own; None for those that were stopped.

    The processes are started afresh, so that a script that calls this has to guard its main part with
    ``if __name__ == "__main__"``.

    Args:
        attempt: a function of a module, task -> plan.
        tasks: what to solve.
        on_result: called with the number of a task and its plan when it is there.
        stop: asked again and again; True ends all that still run.
    """
    found: list[Plan | None] = [None] * len(tasks)
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(len(tasks), os.cpu_count() or 1), mp_context=context, initializer=_ignore_interrupts)
    jobs = {pool.submit(attempt, task): number for number, task in enumerate(tasks)}
    try:
        for job in _finished(list(jobs), stop):
            found[jobs[job]] = job.result()
            if on_result:
                on_result(jobs[job], job.result())
    finally:
        processes = list(pool._processes.values())
        pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:  # those that still run were stopped; the others are idle
            process.terminate()
    return found


def _finished(jobs: list[Future[Plan]], stop: Callable[[], bool] | None) -> Iterator[Future[Plan]]:
    waiting = set(jobs)
    while waiting and not (stop and stop()):
        done, waiting = wait(waiting, timeout=_POLL, return_when=FIRST_COMPLETED)
        yield from done


def _ignore_interrupts() -> None:
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)
