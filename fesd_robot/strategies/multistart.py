"""The same task from several initial guesses at once: which local optimum is reached depends on the guess."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from functools import partial

from fesd_robot.plans.plan import Plan
from fesd_robot.strategies.attempts import AttemptedPlan, Stop, stop_requested
from fesd_robot.strategies.deadline import Deadline
from fesd_robot.strategies.fallbacks import Overrides, time_left, with_overrides
from fesd_robot.strategies.processes import ForkedPool, grant_processes, processes_of
from fesd_robot.task import Task
from fesd_robot.task.consistency import coarser_intervals

DEFAULT_STARTS = 2
"""Initial guesses of a task that does not say how many, unless it begins from an earlier motion."""

AGREEING = 1e-3
"""Part of the cost: two starts that end nearer to each other found the same motion, and no third one is made for a task
that does not say how many."""

_POLL = 0.2
"""s between two looks at whether to stop."""

PATIENCE = 20.0
"""s that other processes have after a stop to hand over the best that they have found."""

Attempt = Callable[[Task], Plan]

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
    after it if none is. What each gives does not depend on that.

    Args:
        task: the task; its seeds are `solver.seed` and the numbers after it.
        attempt: task -> plan, in this process.
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

    def note(attempts: Iterator[tuple[int, AttemptedPlan]]) -> None:
        for seed, one in attempts:
            made[seed] = one
            if started:
                started(seed, one.plan)

    if count > 1:
        note(starts.made(range(first, first + count)))
        if task.solver.starts is None and _disagree(list(made.values())):
            note(starts.one_more(first + count))
    return [made[seed] for seed in sorted(made)]


def _disagree(attempts: Sequence[AttemptedPlan]) -> bool:
    """Return whether several starts were solved, and end in motions that cost different amounts."""
    costs = [one.plan.statistics.objective for one in attempts if one.plan.status.solved]
    return len(costs) > 1 and max(costs) - min(costs) > AGREEING * abs(min(costs))


@dataclass(frozen=True)
class _Starts:
    """How starts are made; the args of `attempt_seeds`."""

    task: Task
    attempt: Attempt
    quietly: Attempt
    deadline: Deadline
    stop: Stop | None
    waiting: Callable[[], None]

    def made(self, seeds: range) -> Iterator[tuple[int, AttemptedPlan]]:
        """Yield seeds and their attempts, as they come."""
        cores = processes_of(self.task)
        beside = min(len(seeds), cores) - 1 if sys.platform == "linux" else 0
        if not beside:
            yield from self._here(self.task, seeds)
            return
        share = cores // (beside + 1)
        own = with_overrides(self.task, {"solver.processes": cores - beside * share})
        pool = ForkedPool(beside, self._elsewhere, partial(grant_processes, share))
        try:
            jobs = {pool.submit(seed): seed for seed in seeds[1:]}
            yield from self._here(own, seeds[:1])
            for job, seed in reversed(jobs.items()):
                if job.cancel() and not self._ended:
                    yield from self._here(own, range(seed, seed + 1))
            yield from self._awaited({job: seed for job, seed in jobs.items() if not job.cancelled()})
        except BrokenProcessPool:
            logger.warning("a process that planned from another initial guess was ended; its plan is left out")
        finally:
            pool.end()

    def one_more(self, seed: int) -> Iterator[tuple[int, AttemptedPlan]]:
        """Yield a further seed and its attempt, in this process; nothing if no time is left."""
        if not self._ended:
            yield from self._here(self.task, range(seed, seed + 1))

    @property
    def _ended(self) -> bool:
        return self.deadline.left <= 0 or stop_requested(self.stop)

    def _here(self, task: Task, seeds: range) -> Iterator[tuple[int, AttemptedPlan]]:
        for number, seed in enumerate(seeds):
            if number and self._ended:
                return
            yield seed, self._attempted(task, seed, self.attempt)

    def _elsewhere(self, seed: int) -> AttemptedPlan:
        return self._attempted(self.task, seed, self.quietly)

    def _attempted(self, task: Task, seed: int, attempt: Attempt) -> AttemptedPlan:
        """Return the attempt from a seed, in the time that is left."""
        begin, changes = time.perf_counter(), self._changes(seed)
        plan = attempt(with_overrides(task, {**changes, **time_left(self.deadline)}))
        return AttemptedPlan(changes, plan, time.perf_counter() - begin)

    def _changes(self, seed: int) -> Overrides:
        """Return what sets a start apart: its seed, and that the third one is planned on a coarser grid first."""
        solver, third = self.task.solver, self.task.solver.seed + 2
        coarse = solver.coarse_to_fine == "auto" and seed == third and coarser_intervals(self.task) is not None
        return {"solver.seed": seed, **({"solver.coarse_to_fine": True} if coarse else {})}

    def _awaited(self, jobs: dict[Future[AttemptedPlan], int]) -> Iterator[tuple[int, AttemptedPlan]]:
        remaining = set(jobs)
        if remaining:
            self.waiting()
        stopping: Deadline | None = None
        while remaining and not (stopping and stopping.left <= 0):
            if stopping is None and stop_requested(self.stop):
                stopping = Deadline(PATIENCE)
            done, remaining = wait(remaining, timeout=_POLL, return_when=FIRST_COMPLETED)
            for job in done:
                yield jobs[job], job.result()
