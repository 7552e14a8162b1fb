"""The same task from several initial guesses at once: which local optimum is reached depends on the guess."""

from __future__ import annotations

import logging
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial

from fesd_robot.plans.plan import Plan
from fesd_robot.strategies.attempts import AttemptedPlan, NoCoarserMotion, Stop, stop_requested
from fesd_robot.strategies.deadline import Deadline
from fesd_robot.strategies.fallbacks import Overrides, time_left, with_overrides
from fesd_robot.strategies.processes import ForkedPool, grant_processes, processes_of
from fesd_robot.task import Task
from fesd_robot.task.consistency import coarser_intervals

DEFAULT_STARTS = 2
"""Initial guesses of a task that does not say how many, unless it begins from an earlier motion."""

COARSE_START = 2
"""Number, after the first, of the start that is planned on a coarser control grid first."""

AGREEING = 1e-3
"""Part of the cost: starts that end nearer to each other found the same motion, and no further one is made for a task
that does not say how many."""

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
    after it if none is. What each gives does not depend on that. Where a task leaves open how many, and these end in
    motions that cost different amounts, or not all in one, a further one begins on a coarser control grid, if there is
    one: it is made on the core that is free as soon as the first of them has ended, and dropped where they agree or the
    coarser grid leads to no motion.

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
    first, count = task.solver.seed, starts_of(task)
    made: dict[int, AttemptedPlan] = {}
    starts = _Starts(task, attempt, quietly, deadline, stop, waiting)
    if count > 1:
        open_ended = task.solver.starts is None and task.solver.coarse_to_fine == "auto"
        further = first + COARSE_START if open_ended and coarser_intervals(task) is not None else None
        for seed, one in starts.made(range(first, first + count), further):
            made[seed] = one
            if started:
                started(seed, one.plan)
    return [made[seed] for seed in sorted(made)]


def _disagree(attempts: Sequence[AttemptedPlan]) -> bool:
    """Return whether one of several starts was solved, and others were not, or end at other costs."""
    costs = [one.plan.statistics.objective for one in attempts if one.plan.status.solved]
    if not costs or len(attempts) == 1:
        return False
    return len(costs) < len(attempts) or max(costs) - min(costs) > AGREEING * abs(min(costs))


@dataclass(frozen=True)
class _Starts:
    """How starts are made; the args of `attempt_seeds`."""

    task: Task
    attempt: Attempt
    quietly: Attempt
    deadline: Deadline
    stop: Stop | None
    waiting: Callable[[], None]

    def made(self, seeds: range, further: int | None) -> Iterator[tuple[int, AttemptedPlan]]:
        """Yield seeds and their attempts, as they come, and the further one if these disagree."""
        made: list[AttemptedPlan] = []
        cores = processes_of(self.task)
        beside = min(len(seeds), cores) - 1 if sys.platform == "linux" else 0
        attempts = self._beside(seeds, further, cores, beside, made) if beside else self._in_turn(seeds, further, made)
        for seed, one in attempts:
            made.append(one)
            yield seed, one

    def _in_turn(
        self, seeds: range, further: int | None, made: list[AttemptedPlan]
    ) -> Iterator[tuple[int, AttemptedPlan]]:
        yield from self._here(self.task, seeds)
        if further is not None and not self._ended and _disagree(made):
            one = self._attempted(self.task, further, self.attempt, further=True)
            if one:
                yield further, one

    def _beside(
        self, seeds: range, further: int | None, cores: int, beside: int, made: list[AttemptedPlan]
    ) -> Iterator[tuple[int, AttemptedPlan]]:
        share = cores // (beside + 1)
        own = with_overrides(self.task, {"solver.processes": cores - beside * share})
        pool = ForkedPool(beside + (further is not None), self._elsewhere, partial(grant_processes, share))
        spare = _Spare(lambda: pool.submit((further, True)), wanted=further is not None)
        try:
            jobs = {pool.submit((seed, False)): seed for seed in seeds[1:]}
            for job in jobs:
                job.add_done_callback(spare.begin)
            yield from self._here(own, seeds[:1])
            for job, seed in reversed(jobs.items()):
                if job.cancel() and not self._ended:
                    yield from self._here(own, range(seed, seed + 1))
            spare.begin()
            yield from self._awaited({job: seed for job, seed in jobs.items() if not job.cancelled()})
            if further is not None and spare.job and not self._ended and _disagree(made):
                yield from self._awaited({spare.job: further})
        except BrokenProcessPool:
            logger.warning("a process that planned from another initial guess was ended; its plan is left out")
        finally:
            spare.close()
            pool.end()

    @property
    def _ended(self) -> bool:
        return self.deadline.left <= 0 or stop_requested(self.stop)

    def _here(self, task: Task, seeds: range) -> Iterator[tuple[int, AttemptedPlan]]:
        for number, seed in enumerate(seeds):
            if number and self._ended:
                return
            if one := self._attempted(task, seed, self.attempt):
                yield seed, one

    def _elsewhere(self, start: tuple[int, bool]) -> AttemptedPlan | None:
        seed, further = start
        return self._attempted(self.task, seed, self.quietly, further=further)

    def _attempted(self, task: Task, seed: int, attempt: Attempt, *, further: bool = False) -> AttemptedPlan | None:
        """Return the attempt from a seed, in the time that is left; none of a further start that leads nowhere."""
        begin, changes = time.perf_counter(), self._changes(seed)
        changed = with_overrides(task, {**changes, **time_left(self.deadline)})
        try:
            plan = attempt(changed, strictly=further)
        except NoCoarserMotion as nowhere:
            logger.info("%s; no further start is made", nowhere)
            return None
        return AttemptedPlan(changes, plan, time.perf_counter() - begin)

    def _changes(self, seed: int) -> Overrides:
        """Return what sets a start apart: its seed, and that one of them is planned on a coarser grid first."""
        solver = self.task.solver
        coarse = solver.coarse_to_fine == "auto" and seed == solver.seed + COARSE_START
        coarse = coarse and coarser_intervals(self.task) is not None
        return {"solver.seed": seed, **({"solver.coarse_to_fine": True} if coarse else {})}

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
        wanted: whether it ever does.
    """

    def __init__(self, submit: Callable[[], Future[AttemptedPlan | None]], *, wanted: bool) -> None:
        self.job: Future[AttemptedPlan | None] | None = None
        self._submit, self._wanted, self._lock = submit, wanted, threading.Lock()

    def begin(self, ended: Future[AttemptedPlan | None] | None = None) -> None:
        """Begin the job if it has not begun, when another has ended; a pool that is broken is asked for nothing."""
        if ended and (ended.cancelled() or ended.exception()):
            return
        with self._lock:
            if self._wanted and self.job is None:
                self.job = self._submit()

    def close(self) -> None:
        """Begin it no more."""
        with self._lock:
            self._wanted = False
