"""The goal beside the end of a motion."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Literal

import numpy as np

from fesd_robot.orientations import lists, with_angles
from fesd_robot.plans.audit_record import ENTRIES
from fesd_robot.plans.outcome import GoalEntry
from fesd_robot.plans.points import point_motion
from fesd_robot.recovery import PhysicalMotion
from fesd_robot.robot import Robot, configuration_units, deviation_units, measured_deviation, velocity_units
from fesd_robot.task import AXES, Periodic, Task

CENTER_OF_MASS = "center of mass"


def goal_entries(
    task: Task, robot: Robot, motion: PhysicalMotion, goal: tuple[np.ndarray, np.ndarray]
) -> list[GoalEntry]:
    """Return every entry of the task's `goal`, with its value at the last sample and its miss.

    Coordinates are those with a goal or a tolerance. Of an orientation roll, pitch and yaw are shown, and the miss is
    log(R_goal^T R), its components about the body's x, y and z. All velocities are added, wanted to be zero, where the
    goal is a place to rest at: it has positions, and no velocity of a coordinate, a frame or the centre of mass. Of a
    periodic motion the changes of all configuration coordinates and velocities are compared with the stride, and what
    is mirrored with where its partner began, with tolerance zero.

    Args:
        task: what was asked for.
        robot: of the task.
        motion: the trajectory in physical time.
        goal: configuration, (n_q), and velocity, (n_v), with everything filled in that the task leaves out.
    """
    if task.goal.periodic is not None:
        entries = _changes(task.goal.periodic, robot, motion)
    else:
        entries = _coordinates(task, robot, motion, goal)
    return [*entries, *_points(task, robot, motion)]


def _entry(
    name: str,
    kind: Literal["position", "velocity"],
    unit: str,
    ends: tuple[float, float],
    tolerance: float | None,
    deviation: float | None = None,
) -> GoalEntry:
    """Compare (goal, end), whose deviation is their difference unless given; tolerances are kept to the audit's own."""
    goal, end = map(float, ends)
    missed_by = abs(end - goal if deviation is None else deviation)
    slack = ENTRIES["max_goal_violation"].tolerance
    met = None if tolerance is None else missed_by <= tolerance + slack
    return GoalEntry(
        name=name, kind=kind, unit=unit, goal=goal, end=end, missed_by=missed_by, tolerance=tolerance, met=met
    )


def _changes(periodic: Periodic, robot: Robot, motion: PhysicalMotion) -> Iterator[GoalEntry]:
    groups: list[tuple[Literal["position", "velocity"], str, dict[str, str], np.ndarray]] = [
        ("position", "", configuration_units(robot), motion.configuration),
        ("velocity", " velocity", velocity_units(robot), motion.velocity),
    ]
    for kind, what, units, values in groups:
        first, last = (dict(zip(units, values[k], strict=True)) for k in (0, -1))
        for name, unit in units.items():
            source, sign = periodic.source(name)
            if name in periodic.mirrored:
                label, ends = f"{name}{what}, mirrored", (sign * first[source], last[name])
            else:
                stride = periodic.stride.get(name, 0.0) if kind == "position" else 0.0
                label, ends = f"change of {name}{what}", (stride, last[name] - first[name])
            yield _entry(label, kind, unit, ends, 0.0)


def _coordinates(
    task: Task, robot: Robot, motion: PhysicalMotion, goal: tuple[np.ndarray, np.ndarray]
) -> Iterator[GoalEntry]:
    asked, (q, v), names = task.goal, goal, robot.configuration_names
    widths, velocity_widths = asked.tolerance.configuration, asked.tolerance.velocity
    wanted, end = (with_angles(dict(zip(names, each, strict=True))) for each in (q, motion.configuration[-1]))
    missed = measured_deviation(names, motion.configuration[-1], q)
    for name, unit in deviation_units(robot).items():
        if lists(asked.configuration, name) or name in widths:
            ends = wanted[name], end[name]
            if name not in names:
                ends = wanted[name], wanted[name] + math.remainder(end[name] - wanted[name], 2 * math.pi)
            yield _entry(name, "position", unit, ends, widths.get(name), missed[name])
    for i, (name, unit) in enumerate(velocity_units(robot).items()):
        if asked.rests or name in asked.velocity or name in velocity_widths:
            ends = v[i], motion.velocity[-1, i]
            yield _entry(f"{name} velocity", "velocity", unit, ends, velocity_widths.get(name))


def _points(task: Task, robot: Robot, motion: PhysicalMotion) -> Iterator[GoalEntry]:
    for frame, target in task.goal.targets.items():
        name = CENTER_OF_MASS if frame is None else f"frame {frame}"
        position, velocity = point_motion(robot, motion.configuration[-1], motion.velocity[-1], frame)
        for axis, goal, end in zip(AXES, target.position or (), position, strict=False):
            if goal is not None:
                yield _entry(f"{name} {axis} position", "position", "m", (goal, end), target.tolerance)
        for axis, goal, end in zip(AXES, target.velocity or (), velocity, strict=False):
            if goal is not None:
                yield _entry(f"{name} {axis} velocity", "velocity", "m/s", (goal, end), target.velocity_tolerance)
