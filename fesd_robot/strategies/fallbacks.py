"""What is changed when a task was not solved: other roads to the same goal, tried in this order."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fesd_robot.task import Task

Overrides = dict[str, Any]
"""``section.key`` of the task -> value."""


def _other_loose_iterations(iterations: int) -> int:
    """A third of a long sketch, three times a short one."""
    return iterations // 3 if iterations >= 150 else 3 * iterations


FALLBACKS: tuple[Callable[[Task], Overrides], ...] = (
    lambda task: {"solver.loose_iterations": _other_loose_iterations(task.solver.loose_iterations)},
    lambda task: {"solver.sigma_factor": round(task.solver.sigma_factor**0.5, 3)},
    lambda task: {"solver.velocity_level_ratio": max(1.0, task.solver.velocity_level_ratio / 10)},
    lambda task: {"method.step_freedom": task.method.step_freedom + 1.0},
    lambda task: {"solver.relaxation": "fischer_burmeister" if task.solver.relaxation == "scholtes" else "scholtes"},
    lambda task: {"solver.sigma_start": 10 * task.solver.sigma_start},
    lambda task: {"method.elements": task.method.elements + 1},
)
"""Another sketch, a gentler homotopy, velocity conditions that trail less, longer elements, another relaxation, a
softer start, more elements.

None changes what is asked for: goal, limits, costs and tolerances stay. A homotopy through a nonconvex problem ends
where its way leads it; a small change of the way often leads elsewhere.
"""


def with_overrides(task: Task, changes: Overrides) -> Task:
    """Return the task with keys of its sections changed, ``section.key`` each."""
    for key, value in changes.items():
        section, name = key.split(".")
        task = task.model_copy(update={section: getattr(task, section).model_copy(update={name: value})})
    return task
