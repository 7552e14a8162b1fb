"""Scales of model quantities as keys of a task: mass and length of the model, limits of efforts, friction."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from fesd_robot.errors import TaskError, nearest
from fesd_robot.ocp import load_task_robot
from fesd_robot.ocp.actuation import actuators_of
from fesd_robot.task import GeneralizedForceActuator, Task, load_task

PREFIX = "model."


def with_scales(task_file: Path, overrides: Sequence[str]) -> tuple[str, ...]:
    """Return overrides in which factors of model quantities have become keys of the task.

    Args:
        task_file: the task.
        overrides: ``key=value`` each; ``model.effort=0.9`` is a factor.

    Raises:
        TaskError: no such quantity, or a factor that is no positive number.
    """
    own = [one for one in overrides if not one.startswith(PREFIX)]
    for one in overrides:
        if one.startswith(PREFIX):
            key, _, text = one.partition("=")
            quantity, factor = key.removeprefix(PREFIX), _factor(key, text)
            if quantity not in QUANTITIES:
                raise TaskError(
                    f"found an unknown quantity, expected a known one{nearest(quantity, QUANTITIES)}", key=key
                )
            own += [
                f"{at}={json.dumps(value)}" for at, value in QUANTITIES[quantity](load_task(task_file, own), factor)
            ]
    return tuple(own)


def _factor(key: str, text: str) -> float:
    try:
        factor = float(text)
    except ValueError:
        factor = 0.0
    if not 0.0 < factor < float("inf"):
        raise TaskError(f"found {text}, expected a factor greater than 0", key=key)
    return factor


def _of_model(quantity: str) -> Callable[[Task, float], Iterator[tuple[str, Any]]]:
    def scaled(task: Task, factor: float) -> Iterator[tuple[str, Any]]:
        yield f"robot.scale.{quantity}", factor * getattr(task.robot.scale, quantity)

    return scaled


def _efforts(task: Task, factor: float) -> Iterator[tuple[str, Any]]:
    """Yield the limits of all controls, in the place where the task has them, or in limits.effort."""
    _, robot = load_task_robot(task)
    own = dict(zip(robot.velocity_names, zip(robot.lower_effort, robot.upper_effort, strict=True), strict=True))
    written = task.robot.actuators or {}
    for name, actuator in actuators_of(task, robot).items():
        if name in written:
            for side in ("lower", "upper"):
                if (limit := getattr(actuator, side)) is not None:
                    yield f"robot.actuators.{name}.{side}", factor * limit
        if isinstance(actuator, GeneralizedForceActuator):
            if name not in written:
                raise TaskError(
                    f"found motor '{name}' of the model file, which pushes several joints, expected it in "
                    "robot.actuators, where its limits can be scaled",
                    key="model.effort",
                )
        elif name not in written or (actuator.lower is None and actuator.upper is None):
            low, high = task.limits.effort.get(actuator.joint, own[actuator.joint])
            yield f"limits.effort.{actuator.joint}", [factor * float(low), factor * float(high)]


def _frictions(task: Task, factor: float) -> Iterator[tuple[str, Any]]:
    """Yield all coefficients of friction that a task gives."""
    yield "ground.friction", factor * task.ground.friction
    for name, wall in task.ground.walls.items():
        if wall.friction is not None:
            yield f"ground.walls.{name}.friction", factor * wall.friction
    for name, surface in task.surfaces.items():
        if surface.friction is not None:
            yield f"surfaces.{name}.friction", factor * surface.friction
    for name, contact in task.contacts.items():
        if (friction := getattr(contact, "friction", None)) is not None:
            yield f"contacts.{name}.friction", factor * friction


QUANTITIES: Mapping[str, Callable[[Task, float], Iterator[tuple[str, Any]]]] = {
    "mass": _of_model("mass"),
    "length": _of_model("length"),
    "effort": _efforts,
    "friction": _frictions,
}
"""Quantity -> the keys of a task, with their values, that scale it."""
