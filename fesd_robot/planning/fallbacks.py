"""Fallback settings: what is changed, in this order, for a task that was not solved."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fesd_robot.ranges import MAX_STAGES
from fesd_robot.task import Task

Overrides = dict[str, Any]
"""``section.key`` of the task -> value."""


def _other_loose_iterations(iterations: int) -> int:
    """Return a third of many iterations, or three times few."""
    return iterations // 3 if iterations >= 150 else 3 * iterations


FALLBACKS: tuple[Callable[[Task], Overrides], ...] = (
    lambda task: {"method.stages": min(task.method.stages + 1, MAX_STAGES)},
    lambda task: {"solver.loose_iterations": _other_loose_iterations(task.solver.loose_iterations)},
    lambda task: {"solver.sigma_factor": round(task.solver.sigma_factor**0.5, 3)},
    lambda task: {"solver.velocity_level_ratio": max(1.0, task.solver.velocity_level_ratio / 10)},
    lambda task: {"method.step_freedom": task.method.step_freedom + 1.0},
    lambda task: {"solver.relaxation": "fischer_burmeister" if task.solver.relaxation == "scholtes" else "scholtes"},
    lambda task: {"solver.sigma_start": 10 * task.solver.sigma_start},
    lambda task: {"method.elements": task.method.elements + 1},
)
"""Settings to try one after the other, each a function of the task.

In order: one more stage, for motions that are found too coarse to be refined, another number of iterations of the loose
homotopy, a sigma that falls more slowly, a smaller ratio between velocity and position level, longer elements, another
relaxation, a larger first sigma, more elements. Goal, limits, costs and tolerances stay as they are. Which local
optimum a homotopy through a nonconvex problem ends in depends on such settings, so that a small change often leads to
another one.
"""

SOFT_GOAL: Overrides = {"goal.soft": True}
"""How to come as near to a goal that was not reached as its weights in the cost ask for."""


def has_hard_goal(task: Task) -> bool:
    """Return whether a task has a goal that can be missed."""
    goal = task.goal
    return not goal.soft and goal.periodic is None and bool(goal.configuration or goal.velocity or goal.points)


def with_overrides(task: Task, overrides: Overrides) -> Task:
    """Return the task with some keys of its sections changed.

    Args:
        overrides: ``section.key`` -> value; values are taken as they are, without validation.
    """
    for key, value in overrides.items():
        section, name = key.split(".")
        task = task.model_copy(update={section: getattr(task, section).model_copy(update={name: value})})
    return task
