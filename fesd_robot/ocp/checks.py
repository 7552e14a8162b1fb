"""Checks of a formulated task: inertia, contacts that move, finite forces, distances that fit into the time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np
import pinocchio as pin

from fesd_robot.contact import CompliantContact, Contact, MultibodyDynamics
from fesd_robot.exactness import ROUNDED
from fesd_robot.fesd import FesdOptions, OptimalControlProblem
from fesd_robot.fesd.layout import layout_of
from fesd_robot.ocp.actuation import Actuation
from fesd_robot.ocp.targets import waypoint_times
from fesd_robot.ocp.timing import TimeGrid
from fesd_robot.ocp.vectors import Endpoints, StateLimits
from fesd_robot.ranges import MAX_VARIABLES
from fesd_robot.robot import Robot
from fesd_robot.task import KeyPath, Task

_NO_INERTIA = 1e-12
"""Smallest fraction of the largest eigenvalue of the mass matrix that counts as inertia."""


def check_inertia(task: Task, robot: Robot, configuration: np.ndarray) -> None:
    """Raise if some motion costs no energy, M(q) being singular: a force would accelerate it without bound.

    Raises:
        TaskError: at robot.armature, naming the coordinate that takes the largest part in that motion.
    """
    upper = np.triu(pin.crba(robot.model, robot.model.createData(), configuration))
    values, vectors = np.linalg.eigh(upper + np.triu(upper, 1).T)
    if values[0] > _NO_INERTIA * values[-1]:
        return
    name = robot.velocity_names[int(np.argmax(np.abs(vectors[:, 0])))]
    raise task.error(
        ("robot", "armature", name),
        f"found coordinate '{name}' without inertia, so that a force accelerates it without bound; expected mass on "
        f"what it moves in the model, or robot.armature.{name} (kg or kg m2)",
    )


def check_size(task: Task, ocp: OptimalControlProblem, options: FesdOptions) -> None:
    """Raise if the nonlinear program of a task would not fit into the memory of a usual computer.

    Raises:
        TaskError: at horizon.intervals, with how many there may be.
    """
    elements = 1 if ocp.equations.moving else task.method.elements
    size = layout_of(ocp.system, options, elements).size
    if size * ocp.intervals > MAX_VARIABLES:
        raise task.error(
            "horizon.intervals",
            f"found {ocp.intervals} intervals of {size} variables each, expected at most {MAX_VARIABLES // size}",
        )


def check_dry_friction(task: Task, robot: Robot) -> None:
    """Raise if joints have dry friction and the task asks for the published form of contact, which has none.

    Raises:
        TaskError: at the type of the formulation.
    """
    if robot.dry_friction and task.method.formulation.type != "multipliers":
        sizes = ", ".join(f"{name} {size:g}" for name, size in robot.dry_friction.items())
        raise task.error(
            "method.formulation.type",
            f"found 'steps' for a robot with dry friction in its joints ({sizes}; N or N m), expected 'multipliers', "
            "or robot.dry_friction: false to leave that friction out",
        )


def check_compliance(task: Task, compliant: Sequence[CompliantContact]) -> None:
    """Raise if a compliant contact has friction or restitution, or is asked for in a form that does not have it.

    Raises:
        TaskError: at the contact's friction or restitution, the type of the formulation or the transcription.
    """
    for one in compliant:
        for key, value in (("friction", one.contact.friction), ("restitution", one.contact.restitution)):
            if value > 0:
                raise task.error(
                    ("contacts", one.name, key),
                    f"found {key} {value:g} of a contact with stiffness, which gives way without it, expected {key}: 0",
                )
    names = ", ".join(one.name for one in compliant)
    if compliant and task.method.formulation.type != "multipliers":
        raise task.error(
            "method.formulation.type",
            f"found 'steps' beside contacts with stiffness ({names}), expected 'multipliers'",
        )
    damped = ", ".join(one.name for one in compliant if one.damping > 0)
    if damped and task.method.contact == "impulses":
        raise task.error(
            "method.contact",
            f"found 'impulses', which make the force of contacts with damping ({damped}) jump, expected 'freezing'",
        )


def check_contacts_move(task: Task, contacts: Sequence[Contact], configuration: ca.SX) -> None:
    """Raise if a contact touches wherever the robot is: nothing moves its frame to or from the surface.

    Raises:
        TaskError: at the contact's frame.
    """
    for contact in contacts:
        if not ca.jacobian_sparsity(contact.gap, configuration).nnz() and float(ca.evalf(contact.gap)) <= ROUNDED:
            frame = task.single_contacts[contact.name].touching_frame
            raise task.error(
                ("contacts", contact.name, "frame"),
                f"found frame '{frame}', which touches wherever the robot is, expected a frame that some joint moves "
                "to and from what it may touch",
            )


def check_forces(task: Task, actuation: Actuation, configuration: np.ndarray) -> None:
    """Raise if a generalized force is not finite at the start, as 1/leg is where the leg has no length.

    Raises:
        TaskError: at the actuator's force.
    """
    matrix = np.asarray(actuation.matrix(configuration).full())
    for name, column in zip(actuation.names, matrix.T, strict=True):
        if not np.isfinite(column).all():
            raise task.error(
                ("robot", "actuators", name, "force"),
                "found an expression that is not finite at the initial configuration, expected one that is",
            )


def check_pace(task: Task, robot: Robot, ends: Endpoints, limits: StateLimits, grid: TimeGrid) -> None:
    """Raise if a hard goal, stride or waypoint is too far away: |q - q_0| - tolerance > t max |dq/dt|.

    Raises:
        TaskError: at the wanted value, with the distance that the velocity limits allow.
    """
    for target in _hard_targets(task, grid):
        if target.name not in robot.velocity_names or target.name not in robot.configuration_names:  # of a turn
            continue
        row = robot.velocity_names.index(target.name)
        start = 0.0 if target.relative else ends.initial_configuration[robot.configuration_names.index(target.name)]
        distance = target.value - start
        speed = limits.upper_velocity[row] if distance > 0 else -limits.lower_velocity[row]
        farthest = speed * target.time + target.tolerance
        if abs(distance) > farthest + ROUNDED:
            raise task.error(
                target.key,
                f"found {target.value:g}, {abs(distance):.4g} away from the start, expected at most {farthest:.4g}: "
                f"the velocity limit of '{target.name}', {speed:g} per s, for {target.time:g} s",
            )


class _HardTarget(NamedTuple):
    """A hard target: key path, coordinate, value, m or rad (`relative` to the start), tolerance, and time, s."""

    key: KeyPath
    name: str
    value: float
    tolerance: float
    time: float
    relative: bool = False


def _hard_targets(task: Task, grid: TimeGrid) -> Iterator[_HardTarget]:
    """Yield all hard goals of coordinates that the task gives a value."""
    goal = task.goal
    if goal.periodic is not None:
        for name, stride in goal.periodic.stride.items():
            yield _HardTarget(("goal", "periodic", "stride", name), name, stride, 0.0, grid.upper, relative=True)
        return  # all else of the start is free
    for name, width in goal.tolerance.configuration.items():
        if name in goal.configuration:
            yield _HardTarget(("goal", "configuration", name), name, goal.configuration[name], width, grid.upper)
    for i, (waypoint, at) in enumerate(zip(task.waypoints, waypoint_times(task, grid), strict=True)):
        for name, width in waypoint.tolerance.configuration.items():
            if name in waypoint.configuration:
                key, time = ("waypoints", str(i), "configuration", name), grid.upper * at / grid.nominal
                yield _HardTarget(key, name, waypoint.configuration[name], width, time)


def check_impulses(task: Task, dynamics: MultibodyDynamics, contacts: Sequence[Contact]) -> None:
    """Raise if the task asks for impulses where only a clock that stops knows what happens.

    Raises:
        TaskError: at the transcription of contact.
    """
    if task.method.contact != "impulses":
        return
    in_space = [contact.name for contact in contacts if contact.in_space]
    limited = [contact.name for contact in contacts if contact.limits_slip]
    for what, names in (
        ("dry friction in joints", list(dynamics.dry_friction)),
        ("contact in space", in_space),
        ("a limit of the slip distance", limited),
    ):
        if names:
            raise task.error(
                "method.contact", f"found 'impulses' for a robot with {what} ({', '.join(names)}), expected 'freezing'"
            )
