"""Processes that make the plans of rows."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

from fesd_robot.sweeps.order import Answer, Order, Work
from fesd_robot.sweeps.workers import Worker


class Planner:
    """A process that makes one plan after another.

    Args:
        work: what it does.
    """

    def __init__(self, work: Work) -> None:
        self._worker = Worker(partial(_done, work))

    def answer(self, order: Order, task: Path) -> Answer:
        """Return what becomes of an order, whatever happens in the process.

        Args:
            order: what to plan.
            task: the task file.
        """
        outcome = self._worker.outcome((order, task), order.limits)
        answer = (
            outcome.value if outcome.verdict is None else Answer(order.number, outcome.verdict, message=outcome.message)
        )
        return replace(answer, seconds=outcome.seconds, megabytes=outcome.megabytes)

    def end(self) -> None:
        """End the process at once, whatever it does."""
        self._worker.end()


def _done(work: Work, argument: tuple[Order, Path]) -> Answer:
    return work(*argument)
