"""Maps keyed by name, turned into vectors in the order of the robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import casadi as ca
import numpy as np
import pinocchio as pin

from fesd_robot.robot import Robot
from fesd_robot.robot.units import configuration_units
from fesd_robot.task import Task

Values = TypeVar("Values", np.ndarray, ca.SX)

_SLACK = 1e-9
"""m or rad: an end this far outside its limit is on it, rounded."""


def vector(names: Sequence[str], values: Mapping[str, float], default: float | np.ndarray) -> np.ndarray:
    """Return one value per name, `default` where the map has none."""
    base = np.broadcast_to(np.asarray(default, dtype=float), (len(names),))
    return np.array([values.get(name, base[i]) for i, name in enumerate(names)], dtype=float)


@dataclass(frozen=True)
class Endpoints:
    """Initial and goal configuration (n_q) and velocity (n_v)."""

    initial_configuration: np.ndarray
    initial_velocity: np.ndarray
    goal_configuration: np.ndarray
    goal_velocity: np.ndarray


@dataclass(frozen=True)
class StateLimits:
    """Bounds of configuration (n_q) and velocity (n_v); infinite where there is none."""

    lower_position: np.ndarray
    upper_position: np.ndarray
    lower_velocity: np.ndarray
    upper_velocity: np.ndarray


def endpoints_of(task: Task, robot: Robot) -> Endpoints:
    """Return where the motion starts and where it should end; what the task leaves out is neutral, or as it was.

    Raises:
        TaskError: a stride that leads out of the limits, or of a robot whose configurations do not add up.
    """
    velocities, q0 = robot.velocity_names, initial_configuration(task, robot)
    if task.goal.periodic is not None:
        v0, end = vector(velocities, task.initial.velocity, 0.0), _after_stride(task, robot, limits_of(task, robot), q0)
        return Endpoints(q0, v0, end, mirrored(task, velocities, v0))
    return Endpoints(
        initial_configuration=q0,
        initial_velocity=vector(velocities, task.initial.velocity, 0.0),
        goal_configuration=with_values(robot, task.goal.configuration, q0),
        goal_velocity=vector(velocities, task.goal.velocity, 0.0),
    )


def initial_configuration(task: Task, robot: Robot) -> np.ndarray:
    """Return q at time 0, (n_q): the robot's neutral configuration within the limits, with the task's values."""
    limits = limits_of(task, robot)
    neutral = np.clip(robot.neutral, limits.lower_position, limits.upper_position)
    return with_values(robot, task.initial.configuration, neutral)


def with_values(robot: Robot, values: Mapping[str, float], configuration: np.ndarray) -> np.ndarray:
    """Return a configuration (n_q) with other values by name; quaternions and (cos, sin) pairs are normalised."""
    return np.asarray(pin.normalize(robot.model, vector(robot.configuration_names, values, configuration)))


def mirrored(task: Task, names: Sequence[str], values: Values) -> Values:
    """Return S x, in which coordinates that a periodic goal mirrors have changed places; x if it mirrors none.

    Args:
        names: of the coordinates, (n).
        values: x, (n), numbers or symbols.
    """
    periodic = task.goal.periodic
    sources = [(name, 1.0) if periodic is None else periodic.source(name) for name in names]
    signs = np.array([sign for _, sign in sources])
    picked = values[[list(names).index(name) for name, _ in sources]]
    return picked * (signs if isinstance(values, np.ndarray) else ca.DM(signs))


def limits_of(task: Task, robot: Robot) -> StateLimits:
    """Return the model's limits with the task's in their place where it gives some."""
    position, velocity = task.limits.position, task.limits.velocity
    names, velocities = robot.configuration_names, robot.velocity_names
    return StateLimits(
        lower_position=vector(names, {name: bounds[0] for name, bounds in position.items()}, robot.lower_position),
        upper_position=vector(names, {name: bounds[1] for name, bounds in position.items()}, robot.upper_position),
        lower_velocity=vector(
            velocities, {name: bounds[0] for name, bounds in velocity.items()}, -robot.velocity_limit
        ),
        upper_velocity=vector(velocities, {name: bounds[1] for name, bounds in velocity.items()}, robot.velocity_limit),
    )


def _after_stride(task: Task, robot: Robot, limits: StateLimits, start: np.ndarray) -> np.ndarray:
    """Return the configuration one stride further."""
    assert task.goal.periodic is not None
    if len(robot.configuration_names) != len(robot.velocity_names):
        raise task.error(
            "goal.periodic", "found a robot with joints whose configuration is a quaternion or a cosine and sine, "
            "expected one whose every coordinate is a length or an angle"
        )  # fmt: skip
    periodic, units = task.goal.periodic, configuration_units(robot)
    for name in periodic.mirror:
        other, _ = periodic.source(name)
        if units[name] != units[other]:
            raise task.error(
                ("goal", "periodic", "mirror", name),
                f"found '{name}' in {units[name]} mirrored with '{other}' in {units[other]}, expected two lengths or "
                "two angles",
            )
    end = mirrored(task, robot.configuration_names, start) + vector(robot.configuration_names, periodic.stride, 0.0)
    for i, name in enumerate(robot.configuration_names):
        lower, upper = limits.lower_position[i], limits.upper_position[i]
        if name in task.goal.periodic.stride and not lower - _SLACK <= end[i] <= upper + _SLACK:
            raise task.error(
                ("goal", "periodic", "stride", name),
                f"found a stride that leads from {start[i]:g} to {end[i]:g}, expected an end in [{lower:g}, {upper:g}]",
            )
    return np.asarray(end)
