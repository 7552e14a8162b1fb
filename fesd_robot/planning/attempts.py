"""Attempts at a task, each with its own settings, and which of them is kept."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from fesd_robot.mpcc import NlpStatus
from fesd_robot.planning.fallbacks import Overrides
from fesd_robot.plans import Attempt, Plan


class AttemptedPlan(NamedTuple):
    """What one attempt at a task gave.

    Attributes:
        overrides: the settings in which it differs from the task.
        plan: its result, solved or not.
        seconds: how long it took.
    """

    overrides: Overrides
    plan: Plan
    seconds: float

    @property
    def solved(self) -> bool:
        """Whether its plan can be relied on."""
        return self.plan.status.solved

    @property
    def only_misses_goal(self) -> bool:
        """Whether its plan is a motion that can be relied on but for the goal, which it does not reach."""
        plan = self.plan
        return plan.status.nlp == NlpStatus.CONVERGED and plan.audit.violations == ["max_goal_violation"]

    @property
    def nearly(self) -> bool:
        """Whether its plan misses limits of the audit by a few per cent, and nothing else."""
        return self.plan.status.near_miss

    @property
    def final(self) -> bool:
        """Whether no other attempt should follow: it is solved, or the user or the time limit ended it."""
        return self.solved or self.plan.status.nlp in (NlpStatus.INTERRUPTED, NlpStatus.TIME_LIMIT)


def best_attempt(attempts: Sequence[AttemptedPlan]) -> AttemptedPlan:
    """Return the cheapest solved attempt, else one that nearly is solved or only misses the goal, else the first."""
    solved = [attempt for attempt in attempts if attempt.solved]
    if solved:
        return min(solved, key=lambda attempt: attempt.plan.statistics.objective)
    near = [attempt for attempt in attempts if attempt.nearly]
    return next((attempt for attempt in [*near, *attempts] if attempt.nearly or attempt.only_misses_goal), attempts[0])


def best_plan(attempts: Sequence[AttemptedPlan]) -> Plan:
    """Return the plan of the best attempt, with all attempts listed in its statistics."""
    best = best_attempt(attempts)
    listed = [_listed(attempt, kept=attempt is best) for attempt in attempts]
    statistics = best.plan.statistics.model_copy(update={"attempts": listed})
    return best.plan.model_copy(update={"statistics": statistics})


def _listed(attempt: AttemptedPlan, kept: bool) -> Attempt:
    plan = attempt.plan
    return Attempt(
        changes=attempt.overrides,
        kept=kept,
        solved=attempt.solved,
        objective=plan.statistics.objective,
        iterations=plan.statistics.iterations,
        seconds=attempt.seconds,
        message=plan.status.message,
    )
