"""The same task from several initial guesses, on all cores: which local optimum is reached depends on the guess."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait

from fesd_robot.plans.plan import Plan
from fesd_robot.strategies.attempts import AttemptedPlan, Stop, stop_requested
from fesd_robot.strategies.fallbacks import with_overrides
from fesd_robot.strategies.processes import end_pool, pool_of, processes_of
from fesd_robot.task import Task

_POLL = 0.2
"""s between two looks at whether to stop."""


def attempt_seeds(
    task: Task, attempt: Callable[[Task], Plan], stop: Stop | None, started: Callable[[int, Plan], None] | None
) -> list[AttemptedPlan]:
    """Return the attempts at a task from `solver.starts` initial guesses, in the order of their seeds.

    Args:
        task: the task; its seeds are `solver.seed` and the numbers after it.
        attempt: a function of a module, task -> plan.
        stop: called with (0, NaN) while attempts are waited for; True ends them, and they are left out of the result.
        started: called with the seed and the plan of every attempt as soon as it is there.

    Returns:
        one attempt per seed; none if the task has a single start, which needs no process of its own.
    """
    if task.solver.starts == 1:
        return []
    seeds = range(task.solver.seed, task.solver.seed + task.solver.starts)
    plans = solve_multistart(
        attempt,
        [with_overrides(task, {"solver.seed": seed}) for seed in seeds],
        processes_of(task),
        (lambda number, plan: started(seeds[number], plan)) if started else None,
        lambda: stop_requested(stop),
    )
    return [
        AttemptedPlan({"solver.seed": seed}, plan, plan.statistics.build_seconds + plan.statistics.solve_seconds)
        for seed, plan in zip(seeds, plans, strict=True)
        if plan is not None
    ]


def solve_multistart(
    attempt: Callable[[Task], Plan],
    tasks: list[Task],
    processes: int,
    on_result: Callable[[int, Plan], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> list[Plan | None]:
    """Return the plan of every task, each solved in a process of its own; None for those that were stopped.

    The processes are started afresh, so that a script that calls this has to guard its main part with
    ``if __name__ == "__main__"``.

    Args:
        attempt: a function of a module, task -> plan.
        tasks: what to solve.
        processes: how many at once.
        on_result: called with the number of a task and its plan when it is there.
        stop: asked again and again; True ends all that still run.
    """
    plans: list[Plan | None] = [None] * len(tasks)
    pool = pool_of(min(len(tasks), processes), "spawn")
    jobs = {pool.submit(attempt, task): number for number, task in enumerate(tasks)}
    try:
        for job in _finished(list(jobs), stop):
            plans[jobs[job]] = plan = job.result()
            if on_result:
                on_result(jobs[job], plan)
    finally:
        end_pool(pool)
    return plans


def _finished(jobs: list[Future[Plan]], stop: Callable[[], bool] | None) -> Iterator[Future[Plan]]:
    waiting = set(jobs)
    while waiting and not (stop and stop()):
        done, waiting = wait(waiting, timeout=_POLL, return_when=FIRST_COMPLETED)
        yield from done
