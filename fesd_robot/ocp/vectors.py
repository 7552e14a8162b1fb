"""Maps keyed by name, turned into vectors in the order of the robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import casadi as ca
import numpy as np
import pinocchio as pin

from fesd_robot.exactness import ROUNDED
from fesd_robot.orientations import (
    angles_of,
    orientations_of,
    quaternion_entries,
    quaternion_of,
    turn_entries,
    turn_of,
    turns_of,
)
from fesd_robot.robot import Robot, configuration_units, turned
from fesd_robot.task import Task

Values = TypeVar("Values", np.ndarray, ca.SX)

_UNIT = 1e-14
"""Squared length of a quaternion, or of a cosine and sine, whose difference from one is rounding: it stays."""


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
    """Return start and goal of the motion; coordinates left out are neutral at the start, unchanged at the goal.

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
    """Return a configuration (n_q) with other values by name; quaternions and (cos, sin) pairs are normalised.

    Of roll, pitch and yaw those that have no value are of the orientation that the other values, else the configuration
    give.
    """
    names = robot.configuration_names
    q = vector(names, values, configuration)
    for joint, at in quaternion_entries(names).items():
        angles = [values.get(angle) for angle in angles_of(joint)]
        if any(angle is not None for angle in angles):
            q[at] = turned(q[at], angles)
    for joint, at in turn_entries(names).items():
        if joint in values:
            q[at] = np.cos(values[joint]), np.sin(values[joint])
    return np.asarray(pin.normalize(robot.model, q))


def with_unit_entries(robot: Robot, values: Mapping[str, float], configuration: np.ndarray) -> dict[str, float]:
    """Return values by name with a unit quaternion for every orientation, and cosine and sine for every turn, in them.

    Args:
        values: name -> m or rad.
        configuration: which gives what of roll, pitch and yaw they leave out, (n_q).
    """
    found, names = dict(values), robot.configuration_names
    own = [(angles_of(joint), quaternion_of(joint)) for joint in orientations_of(names)]
    own += [([joint], turn_of(joint)) for joint in turns_of(names)]
    for angles, entries in own:
        length = sum(found.get(entry, 0.0) ** 2 for entry in entries)
        if any(angle in found for angle in angles) or (length and abs(length - 1.0) > _UNIT):
            q = with_values(robot, values, configuration)
            found = {name: value for name, value in found.items() if name not in angles}
            found |= {entry: float(q[names.index(entry)]) for entry in entries}
    return found


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
            velocities, {name: bounds[0] for name, bounds in velocity.items()}, 0.0 - robot.velocity_limit
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
        if name in task.goal.periodic.stride and not lower - ROUNDED <= end[i] <= upper + ROUNDED:
            raise task.error(
                ("goal", "periodic", "stride", name),
                f"found a stride that leads from {start[i]:g} to {end[i]:g}, expected an end in [{lower:g}, {upper:g}]",
            )
    return np.asarray(end)
