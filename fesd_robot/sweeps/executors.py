"""Where plans are made: processes of this machine, or those of a Dask cluster."""

from __future__ import annotations

import os
import queue
import threading
from collections.abc import Sequence
from typing import Protocol

from fesd_robot.errors import SweepError
from fesd_robot.sweeps.content import TaskContent, Unpacked
from fesd_robot.sweeps.order import Answer, Order, Work
from fesd_robot.sweeps.planners import Planner

SECONDS_OF_A_TASK, MOST_TOGETHER = 0.2, 50
"""s for which a worker of a cluster is busy with one task at least, and most orders in it."""

_LEARNING = 0.02
"""Weight of a new row in the mean of their seconds."""


class Executor(Protocol):
    """Makes plans, several at once."""

    @property
    def workers(self) -> int:
        """How many orders are worked at just now at most; others lie ready."""

    @property
    def room(self) -> int:
        """How many more orders it takes just now."""

    @property
    def running(self) -> Sequence[int]:
        """Numbers of the orders that it has and has not answered."""

    def submit(self, order: Order) -> None:
        """Take an order."""

    def answers(self, seconds: float) -> list[Answer]:
        """Return what has been answered, after waiting for the first answer for some seconds at most."""

    def end(self) -> None:
        """End all that runs, at once."""


def usable_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class LocalProcesses:
    """Processes of this machine.

    Args:
        work: what each does.
        content: the tasks.
        jobs: how many work at once.
    """

    def __init__(self, work: Work, content: TaskContent, jobs: int) -> None:
        self._unpacked = Unpacked()
        self._tasks = self._unpacked.files(content)
        self._workers = [Planner(work) for _ in range(jobs)]
        self._orders: queue.SimpleQueue[Order | None] = queue.SimpleQueue()
        self._answers: queue.SimpleQueue[Answer] = queue.SimpleQueue()
        self._running: dict[int, Order] = {}
        self._threads = [
            threading.Thread(target=self._answer, args=(worker,), daemon=True, name="sweep") for worker in self._workers
        ]
        for thread in self._threads:
            thread.start()

    @property
    def workers(self) -> int:
        """How many orders are worked at at most."""
        return len(self._workers)

    @property
    def room(self) -> int:
        """How many more orders it takes just now: one more than work at once lies ready."""
        return len(self._workers) + 1 - len(self._running) if len(self._workers) > 1 else 1 - len(self._running)

    @property
    def running(self) -> Sequence[int]:
        """Numbers of the orders that it has and has not answered."""
        return list(self._running)

    def submit(self, order: Order) -> None:
        """Take an order."""
        self._running[order.number] = order
        self._orders.put(order)

    def answers(self, seconds: float) -> list[Answer]:
        """Return what has been answered, after waiting for the first answer for some seconds at most."""
        found = drained(self._answers, seconds)
        for answer in found:
            self._running.pop(answer.number, None)
        return found

    def end(self) -> None:
        """End all processes, and remove the files that they had."""
        self._orders = queue.SimpleQueue()
        for worker in self._workers:
            worker.end()
        self._unpacked.end()

    def _answer(self, worker: Planner) -> None:
        orders = self._orders
        while (order := orders.get()) is not None:
            if orders is not self._orders:
                return
            self._answers.put(worker.answer(order, self._tasks[order.task]))


def drained(answers: queue.SimpleQueue[Answer], seconds: float) -> list[Answer]:
    """Return all answers of a queue, after waiting for the first one for some seconds at most."""
    try:
        found = [answers.get(timeout=seconds)]
    except queue.Empty:
        return []
    while not answers.empty():
        found.append(answers.get())
    return found


class DaskCluster:
    """Workers of a Dask cluster, each of which has processes of its own, one a thread.

    Args:
        work: what each process does; a function of a module that workers can import.
        content: the tasks.
        scheduler: address of its scheduler, ``tcp://HOST:PORT``; None for a cluster on this machine.
        jobs: workers of a cluster on this machine.

    Raises:
        SweepError: Dask is not installed, the scheduler does not answer, has no workers, or these have another version.
    """

    def __init__(self, work: Work, content: TaskContent, scheduler: str | None, jobs: int) -> None:
        from fesd_robot.sweeps import dask_workers

        self._client, self._cluster = dask_workers.connected(scheduler, jobs)
        self._distributed, self._work = dask_workers, work
        self._content = self._client.submit(dask_workers.unchanged, content, key=f"task-{content.identity}")
        self._answers: queue.SimpleQueue[Answer] = queue.SimpleQueue()
        self._waiting: list[Order] = []
        self._running: dict[int, object] = {}
        self._token, self._mean, self._sent = os.urandom(4).hex(), SECONDS_OF_A_TASK, 0

    @property
    def workers(self) -> int:
        """How many threads the workers have just now."""
        return self._distributed.threads(self._client)

    @property
    def room(self) -> int:
        """How many more orders it takes just now: as many as work at once lie ready."""
        return max((2 * self.workers + 2) * self._together - len(self._running), 0)

    @property
    def running(self) -> Sequence[int]:
        """Numbers of the orders that it has and has not answered."""
        return list(self._running)

    @property
    def _together(self) -> int:
        """How many orders go to a worker at once: several where each takes less than what a task costs Dask."""
        return max(1, min(MOST_TOGETHER, round(SECONDS_OF_A_TASK / max(self._mean, 1e-6))))

    def submit(self, order: Order) -> None:
        """Take an order."""
        self._running[order.number] = None
        self._waiting.append(order)
        if len(self._waiting) >= self._together:
            self._send()

    def answers(self, seconds: float) -> list[Answer]:
        """Return what has been answered, after waiting for the first answer for some seconds at most."""
        self._send()
        found = drained(self._answers, seconds)
        for answer in found:
            self._running.pop(answer.number, None)
            self._mean += _LEARNING * (answer.seconds - self._mean)
        if not found and self._running and self._client.status not in ("running", "connecting"):
            raise SweepError("the scheduler is gone, expected one that runs; --resume goes on where this stopped")
        return found

    def end(self) -> None:
        """Leave the cluster; one on this machine ends."""
        self._distributed.left(self._client, self._cluster)

    def _send(self) -> None:
        orders, self._waiting = self._waiting, []
        if not orders:
            return
        numbers = [order.number for order in orders]
        self._sent += 1  # a row that is ordered once more is another task of Dask
        future = self._client.submit(
            self._distributed.answered,
            self._work,
            orders,
            self._content,
            self._distributed.own_version(),
            key=f"row-{numbers[0]}-{self._sent}-{self._token}",
            pure=False,
        )
        self._running.update(dict.fromkeys(numbers, future))
        future.add_done_callback(lambda done: self._done(numbers, done))

    def _done(self, numbers: Sequence[int], future: object) -> None:
        for answer in self._distributed.answers_of(numbers, future):
            self._answers.put(answer)
