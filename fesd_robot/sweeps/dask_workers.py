"""What runs on the workers of a Dask cluster, and how one is reached (extra `sweep`)."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Sequence
from typing import Any

import fesd_robot
from fesd_robot.errors import SweepError
from fesd_robot.sweeps.content import TaskContent, Unpacked
from fesd_robot.sweeps.order import Answer, Order, Verdict, Work
from fesd_robot.sweeps.planners import Planner

SECONDS_TO_ANSWER = 10.0
"""For a scheduler, and for its first worker."""

_LOOK_EVERY = 2.0
"""s between two looks at how many threads a cluster has."""

_here = threading.local()
_unpacked, _unpacking = Unpacked(), threading.Lock()
_threads: dict[int, tuple[float, int]] = {}


def own_version() -> str:
    """Return the version of this program here."""
    return fesd_robot.__version__


def unchanged(content: TaskContent) -> TaskContent:
    """Return tasks as they are: once on the cluster, they go from worker to worker."""
    return content


def answered(work: Work, orders: Sequence[Order], content: TaskContent, version: str) -> list[Answer]:
    """Return the answers of a process of this worker's thread.

    Args:
        work, orders, content: what to do.
        version: of the program that sends it.
    """
    if version != own_version():
        message = other_version({"a worker": own_version()}, version)
        return [Answer(order.number, Verdict.REFUSED, message=message) for order in orders]
    if not hasattr(_here, "worker") or _here.work is not work:
        if hasattr(_here, "worker"):
            _here.worker.end()
        _here.worker, _here.work = Planner(work), work
    with _unpacking:
        tasks = _unpacked.files(content)
    return [_here.worker.answer(order, tasks[order.task]) for order in orders]


def answers_of(numbers: Sequence[int], future: Any) -> list[Answer]:
    """Return the answers of a future that is done, also where its workers died of it."""
    try:
        answers: list[Answer] = future.result(timeout=SECONDS_TO_ANSWER)
        return answers
    except BaseException as error:
        name = type(error).__name__
        lost = "Cancelled" in name or "Comm" in name
        verdict = Verdict.INTERRUPTED if lost else Verdict.CRASHED
        message = f"{name}: {' '.join(str(error).split())}"[:500]
        return [Answer(number, verdict, message=message) for number in numbers]


def connected(scheduler: str | None, jobs: int) -> tuple[Any, Any]:
    """Return a client of a cluster, and the cluster if it is one of this machine, made here.

    Args:
        scheduler: its address; None for a cluster on this machine.
        jobs: workers of that.

    Raises:
        SweepError: Dask is not installed, the scheduler does not answer, has no workers, or these have another version.
    """
    try:
        import distributed
    except ImportError as error:
        raise SweepError(
            "found no package 'distributed', which Dask needs, expected it: pip install 'fesd-robot[sweep]'"
        ) from error
    cluster = None
    if scheduler is None:
        cluster = distributed.LocalCluster(
            n_workers=jobs, threads_per_worker=1, dashboard_address=None, silence_logs=logging.ERROR
        )
    logging.getLogger("distributed").setLevel(logging.ERROR)
    try:
        client = distributed.Client(
            scheduler if cluster is None else cluster, timeout=SECONDS_TO_ANSWER, set_as_default=False
        )
    except (OSError, ValueError) as error:
        raise SweepError(
            f"found no scheduler of Dask at {scheduler} within {SECONDS_TO_ANSWER:g} s, expected one that answers"
        ) from error
    try:
        client.wait_for_workers(1, timeout=SECONDS_TO_ANSWER)
    except TimeoutError as error:
        client.close()
        raise SweepError(
            f"found no workers at {scheduler} within {SECONDS_TO_ANSWER:g} s, expected at least one"
        ) from error
    _check_versions(client)
    return client, cluster


def _check_versions(client: Any) -> None:
    try:
        versions = client.run(own_version)
    except Exception as error:  # what a worker raises that has no such function
        client.close()
        raise SweepError(
            f"found workers without fesd-robot {own_version()}, expected it there ({type(error).__name__}: {error})"
        ) from error
    if others := {name: version for name, version in versions.items() if version != own_version()}:
        client.close()
        raise SweepError(other_version(others, own_version()))


def other_version(others: dict[str, str], own: str) -> str:
    """Return the sentence about workers of another version."""
    name, version = next(iter(others.items()))
    more = f" and {len(others) - 1} more" if len(others) > 1 else ""
    return f"found version {version} of fesd-robot on {name}{more}, expected {own}, that of this program"


def threads(client: Any) -> int:
    """Return how many threads the workers have just now."""
    known, now = _threads.get(id(client)), time.monotonic()
    if known is None or now - known[0] > _LOOK_EVERY:
        known = now, sum(client.nthreads().values())
        _threads[id(client)] = known
    return known[1]


def left(client: Any, cluster: Any) -> None:
    """Leave a cluster, and end it if it is one of this machine."""
    _threads.pop(id(client), None)
    client.close(timeout=2)
    if cluster is not None:
        cluster.close(timeout=5)
