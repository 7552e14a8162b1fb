"""The same task from several initial guesses at once: which local optimum is reached depends on the guess."""

from __future__ import annotations

import logging
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from functools import cached_property, partial

from fesd_robot.plans.plan import Plan
from fesd_robot.strategies.attempts import AttemptedPlan, NoCoarserMotion, Stop, stop_requested
from fesd_robot.strategies.deadline import Deadline
from fesd_robot.strategies.fallbacks import Overrides, time_left, with_overrides
from fesd_robot.strategies.processes import ForkedPool, cores_for, share_cores
from fesd_robot.strategies.shared import SharedCores
from fesd_robot.task import Task
from fesd_robot.task.consistency import coarser_intervals

DEFAULT_STARTS = 2
"""Initial guesses of a task that does not say how many, unless it begins from an earlier motion."""

COARSE_START = 2
"""Number, after the first, of the start that is planned on a coarser control grid first. It is the second of a task
that does not say how many: that it agrees with the first says more than that another guess does."""

AGREEING = 5e-3
"""Part of the cost: starts that end nearer to each other found the same motion, but for moves that a search leaves out
because they gain less than a thousandth; no further one is made for a task that does not say how many."""

_POLL = 0.2
"""s between two looks at whether to stop."""

PATIENCE = 20.0
"""s that other processes have after a stop to hand over the best that they have found."""

Attempt = Callable[..., Plan]
"""Task -> plan; with ``strictly=True`` it raises `NoCoarserMotion` where a coarser grid leads nowhere."""

logger = logging.getLogger(__name__)


def starts_of(task: Task) -> int:
    """Return from how many initial guesses a task is solved; by default one if it begins from an earlier motion."""
    if task.solver.starts is not None:
        return task.solver.starts
    return 1 if task.solver.warm_start else DEFAULT_STARTS


def attempt_seeds(
    task: Task,
    attempt: Attempt,
    quietly: Attempt,
    *,
    deadline: Deadline,
    stop: Stop | None,
    started: Callable[[int, Plan], None] | None,
    waiting: Callable[[], None],
) -> list[AttemptedPlan]:
    """Return the attempts at a task from its initial guesses, in the order of their seeds.

    The first is made in this process; the others beside it, in processes of their own, as far as cores are free, and
    after it if none is. Which one is the cheapest does not depend on that; one that costs much more than another that
    is solved by then is given up (`LeastCost`). Where a task leaves open how many, and there is a coarser control grid,
    the second begins there, and a further one from another guess where the two end in motions that cost different
    amounts, or not both in one, or where the coarser grid leads to none: it is made on the core that is free as soon as
    the first of them has ended, and dropped where they agree.

    Args:
        task: the task; its seeds are `solver.seed` and the numbers after it.
        attempt: an attempt in this process.
        quietly: the same in another process, which is forked: it says nothing, and stops with this one (`SharedStop`).
        deadline: of all attempts.
        stop: called with (0, NaN) while others are waited for; after True those that do not end in `PATIENCE` seconds
            are left out of the result.
        started: called with the seed and the plan of every attempt as soon as it is there.
        waiting: called when nothing is left to do but wait for others.

    Returns:
        one attempt per seed; none if the task has a single start.
    """
    starts = _Starts(task, attempt, quietly, deadline, stop, waiting)
    if starts_of(task) > 1:
        for seed, one in starts.run():
            if started:
                started(seed, one.plan)
    return [starts.made[seed] for seed in sorted(starts.made)]


def _agree(attempts: Sequence[AttemptedPlan]) -> bool:
    """Return whether there are several starts, all of them are solved, and they end at one cost."""
    costs = [one.plan.statistics.objective for one in attempts if one.plan.status.solved]
    return 1 < len(costs) == len(attempts) and max(costs) - min(costs) <= AGREEING * abs(min(costs))


@dataclass(frozen=True)
class _Starts:
    """How starts are made.

    Attributes:
        task, attempt, quietly, deadline, stop, waiting: the args of `attempt_seeds`.
        made: seed -> its attempt, of those that are there.
    """

    task: Task
    attempt: Attempt
    quietly: Attempt
    deadline: Deadline
    stop: Stop | None
    waiting: Callable[[], None]
    made: dict[int, AttemptedPlan] = field(default_factory=dict)

    def run(self) -> Iterator[tuple[int, AttemptedPlan]]:
        """Yield seeds and their attempts, as they come, and the further one if these do not agree."""
        cores, seeds = cores_for(self.task).most, self._seeds
        beside = min(len(seeds), cores) - 1 if sys.platform == "linux" else 0
        for seed, one in self._beside(seeds, cores, beside) if beside else self._in_turn(seeds):
            self.made[seed] = one
            yield seed, one

    def _in_turn(self, seeds: Sequence[int]) -> Iterator[tuple[int, AttemptedPlan]]:
        yield from self._here(seeds)
        further = self._further
        if further is not None and self._undecided:
            yield from self._here([further])

    def _beside(self, seeds: Sequence[int], cores: int, beside: int) -> Iterator[tuple[int, AttemptedPlan]]:
        shared, further = SharedCores(cores), self._further
        pool = ForkedPool(
            beside + (further is not None), partial(self._elsewhere, shared), partial(share_cores, shared)
        )
        spare = None if further is None else _Spare(partial(pool.submit, further))
        try:
            jobs = {pool.submit(seed): seed for seed in seeds[1:]}
            if spare:
                for job in jobs:
                    job.add_done_callback(spare.begin)
            share_cores(shared)
            with shared.working():
                yield from self._here(seeds[:1])
                for job, seed in reversed(jobs.items()):
                    if job.cancel() and not self._ended:
                        yield from self._here([seed])
            last = spare.begin() if spare else None
            yield from self._awaited({job: seed for job, seed in jobs.items() if not job.cancelled()})
            if last and further is not None and self._undecided:
                yield from self._awaited({last: further})
        except BrokenProcessPool:
            logger.warning("a process that planned from another initial guess was ended; its plan is left out")
        finally:
            share_cores(None)
            if spare:
                spare.close()
            pool.end()

    @cached_property
    def _coarse(self) -> int | None:
        """The seed that is planned on a coarser grid first; None where there is no such grid, or the task decides."""
        solver = self.task.solver
        wanted = solver.coarse_to_fine == "auto" and coarser_intervals(self.task) is not None
        return solver.seed + COARSE_START if wanted else None

    @property
    def _second(self) -> int | None:
        """That seed, where the task leaves open how many there are: it is the second, and another one the third."""
        return self._coarse if self.task.solver.starts is None else None

    @property
    def _seeds(self) -> list[int]:
        """The seeds of the starts that are made in any case."""
        first, second = self.task.solver.seed, self._second
        return list(range(first, first + starts_of(self.task))) if second is None else [first, second]

    @property
    def _further(self) -> int | None:
        """The seed of the one that is made where these do not agree."""
        return None if self._second is None else self.task.solver.seed + 1

    @property
    def _ended(self) -> bool:
        return self.deadline.left <= 0 or stop_requested(self.stop)

    @property
    def _undecided(self) -> bool:
        return not self._ended and not _agree(list(self.made.values()))

    def _here(self, seeds: Sequence[int]) -> Iterator[tuple[int, AttemptedPlan]]:
        for number, seed in enumerate(seeds):
            if number and self._ended:
                return
            if one := self._attempted(seed, self.attempt):
                yield seed, one

    def _elsewhere(self, shared: SharedCores, seed: int) -> AttemptedPlan | None:
        with shared.working():
            return self._attempted(seed, self.quietly)

    def _attempted(self, seed: int, attempt: Attempt) -> AttemptedPlan | None:
        """Return the attempt from a seed, in the time that is left; none where the coarser grid leads nowhere."""
        begin = time.perf_counter()
        changes: Overrides = {"solver.seed": seed}
        if seed == self._coarse:
            changes["solver.coarse_to_fine"] = True
        changed = with_overrides(self.task, {**changes, **time_left(self.deadline)})
        try:
            plan = attempt(changed, strictly=seed == self._second)
        except NoCoarserMotion as nowhere:
            logger.info("%s; it begins from another guess instead", nowhere)
            return None
        return AttemptedPlan(changes, plan, time.perf_counter() - begin)

    def _awaited(self, jobs: dict[Future[AttemptedPlan | None], int]) -> Iterator[tuple[int, AttemptedPlan]]:
        remaining = set(jobs)
        if remaining:
            self.waiting()
        stopping: Deadline | None = None
        while remaining and not (stopping and stopping.left <= 0):
            if stopping is None and stop_requested(self.stop):
                stopping = Deadline(PATIENCE)
            done, remaining = wait(remaining, timeout=_POLL, return_when=FIRST_COMPLETED)
            for job in done:
                if one := job.result():
                    yield jobs[job], one


class _Spare:
    """A job that begins once, as soon as there is a core for it.

    Args:
        submit: begins it.
    """

    def __init__(self, submit: Callable[[], Future[AttemptedPlan | None]]) -> None:
        self._submit, self._lock = submit, threading.Lock()
        self._job: Future[AttemptedPlan | None] | None = None
        self._closed = False

    def begin(self, ended: Future[AttemptedPlan | None] | None = None) -> Future[AttemptedPlan | None] | None:
        """Begin the job if it has not begun, when another has ended; a pool that is broken is asked for nothing."""
        if ended and (ended.cancelled() or ended.exception()):
            return None
        with self._lock:
            if not self._closed and self._job is None:
                self._job = self._submit()
            return self._job

    def close(self) -> None:
        """Begin it no more."""
        with self._lock:
            self._closed = True
