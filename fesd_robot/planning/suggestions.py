"""What may help a task that no attempt has solved: changes of what it asks for, to be tried one after the other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from fesd_robot.task import Task

MORE_TIME, HIGHER_LIMITS = 1.25, 1.5
"""Factors on the duration, and on the limits of controls."""


def suggestions(task: Task) -> Iterator[tuple[dict[str, Any], Task]]:
    """Yield what is changed, name -> value, and the changed task: more time, then higher limits of its controls.

    A duration that is chosen stays as it is, and so do limits of the model that the task does not replace.

    Args:
        task: that was not solved.
    """
    if isinstance(task.horizon.duration, float):
        duration = MORE_TIME * task.horizon.duration
        points = [
            point if point.time is None else point.model_copy(update={"time": MORE_TIME * point.time})
            for point in task.waypoints
        ]
        horizon = task.horizon.model_copy(update={"duration": duration})
        yield {"horizon.duration": duration}, task.model_copy(update={"horizon": horizon, "waypoints": points})
    changed: dict[str, Any] = {}
    given = task.robot.actuators or {}
    actuators = {name: _stronger(actuator) for name, actuator in given.items()}
    if actuators != given:
        changed["robot"] = task.robot.model_copy(update={"actuators": actuators})
    elif task.limits.effort:
        effort = {name: (HIGHER_LIMITS * low, HIGHER_LIMITS * high) for name, (low, high) in task.limits.effort.items()}
        changed["limits"] = task.limits.model_copy(update={"effort": effort})
    if changed:
        yield {"limits of controls in the task": f"{HIGHER_LIMITS:g} times as high"}, task.model_copy(update=changed)


def _stronger(actuator: Any) -> Any:
    """Return an actuator with those limits higher that the task gives."""
    given = {name: getattr(actuator, name) for name in ("lower", "upper")}
    higher = {name: HIGHER_LIMITS * limit for name, limit in given.items() if limit is not None}
    return actuator.model_copy(update=higher)
