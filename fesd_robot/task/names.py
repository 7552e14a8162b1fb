"""Checks of a task against the robot it is for: names that must exist, values that must lie within limits."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import Literal

from fesd_robot.errors import nearest
from fesd_robot.exactness import ROUNDED
from fesd_robot.orientations import angle_names, value_names
from fesd_robot.task.constraints import BodyPoint, SwingClearance
from fesd_robot.task.contacts import BodyContact, TwoBodyContact
from fesd_robot.task.costs import COST_TERMS
from fesd_robot.task.distances import DistanceConstraint
from fesd_robot.task.endpoints import Initial
from fesd_robot.task.expression import expression_names
from fesd_robot.task.fields import AXES, NameKind
from fesd_robot.task.goal import Goal, Waypoint
from fesd_robot.task.origins import KeyPath
from fesd_robot.task.reference import Jumps
from fesd_robot.task.robot import JointActuator
from fesd_robot.task.schema import Task

_CONFIGURATION: NameKind = "configuration coordinate"
_VELOCITY: NameKind = "velocity coordinate"


def check_names(
    task: Task,
    configuration_names: Collection[str],
    velocity_names: Collection[str],
    joint_names: Collection[str],
    frame_names: Collection[str],
    control_names: Collection[str] | None = None,
    posture_names: Collection[str] = (),
) -> None:
    """Raise the first error, by line, about a name that the robot does not have.

    Args:
        task: the task.
        configuration_names: the robot's configuration coordinates.
        velocity_names: the robot's velocity coordinates.
        joint_names: the robot's joints.
        frame_names: the robot's frames.
        control_names: names of the controls; default: the task's actuators, without any the joints.
        posture_names: postures that the robot's model file gives, beside those of the task.

    Raises:
        TaskError: some name is unknown; the error names the nearest valid one.
    """
    if control_names is None:
        control_names = joint_names if task.robot.actuators is None else list(task.robot.actuators)
    valid: dict[NameKind, Collection[str]] = {
        _CONFIGURATION: value_names(configuration_names),
        _VELOCITY: velocity_names,
        "joint": joint_names,
        "frame": frame_names,
        "control": control_names,
        "group of controls": list(task.robot.one_at_a_time),
        "contact": list(task.contacts),
        "posture": [*task.postures, *posture_names],
        "axis": AXES,
    }
    problems = [
        (path, _unknown(task, kind, name, valid[kind]))
        for path, kind, name in _names_used(task)
        if name not in valid[kind]
    ]
    error = task.origins.first_error(problems)
    if error is not None:
        raise error


def _unknown(task: Task, kind: NameKind, name: str, valid: Collection[str]) -> str:
    """Explain why a name is not valid, perhaps only because the task has taken it away."""
    if kind in (_CONFIGURATION, _VELOCITY, "joint"):
        if name in task.robot.locked:
            return f"found '{name}', which robot.locked holds, expected a {kind}: one that moves"
        if name in task.robot.coupled:
            leader = task.robot.coupled[name]
            return f"found '{name}', which robot.coupled lets move with '{leader}', expected '{leader}' for both"
    return f"found '{name}', expected a {kind}{nearest(name, valid)}"


def check_values(
    task: Task,
    configuration_limits: Mapping[str, tuple[float, float]],
    velocity_limits: Mapping[str, tuple[float, float]],
    units: Mapping[str, str] | None = None,
    postures: Mapping[str, Mapping[str, float]] = MappingProxyType({}),
    limit_notes: Mapping[tuple[Literal["position", "velocity"], str], str] = MappingProxyType({}),
) -> None:
    """Raise the first error, by line, about an initial value, goal, waypoint or apex outside its limits.

    Values that the task gives are checked, and velocities of the start that it leaves at 0; limits in the task come
    before those passed in. An angle of an orientation or a turn is one turn at most, as limits that nothing else gives.

    Args:
        task: the task, its names already checked.
        configuration_limits: name -> (lower, upper) of the robot, m or rad; a name may be missing.
        velocity_limits: name -> (lower, upper) of the robot, m/s or rad/s; a name may be missing.
        units: name of a configuration coordinate -> ``m`` or ``rad``; with it the error says what the value would be
            in another unit, if that lies within the limits.
        postures: those of the robot's model file; values of one that the task uses are checked, too.
        limit_notes: ``position`` or ``velocity``, and name -> where the robot's limit is from.

    Raises:
        TaskError: some value lies outside; the error names the value and both limits.
    """
    turns = dict.fromkeys(angle_names(configuration_limits), (-2 * math.pi, 2 * math.pi))
    configuration = {**turns, **configuration_limits, **task.limits.position}
    velocity = {**velocity_limits, **task.limits.velocity}
    groups: list[tuple[KeyPath, Mapping[str, float], Mapping[str, tuple[float, float]]]] = []
    for name, posture in task.postures.items():
        groups.append((("postures", name), posture, configuration))
    for path, state in task.states:
        if state.posture is not None and state.posture not in task.postures:
            own = {**postures[state.posture], **state.configuration}
            groups.append(((*path, "posture"), own, configuration))
        groups.append(((*path, "configuration"), state.configuration, configuration))
        groups.append(((*path, "velocity"), state.velocity, velocity))
        if state.standing is not None:
            groups.append(((*path, "stand_on", "prefer"), state.standing.prefer, configuration))
    if isinstance(task.reference, Jumps):
        groups.append((("reference", "apex"), task.reference.apex, configuration))
    problems: list[tuple[KeyPath, str]] = []
    for path, values, limits in groups:
        given = task.limits.velocity if limits is velocity else task.limits.position
        for name, value in values.items():
            lower, upper = limits.get(name, (-float("inf"), float("inf")))
            if not lower - ROUNDED <= value <= upper + ROUNDED:
                kind: Literal["position", "velocity"] = "velocity" if limits is velocity else "position"
                source = f"limits.{kind}" if name in given else "the robot"
                why = limit_notes.get((kind, name), "") if name not in given else ""
                words = "one turn in rad" if name in turns and name not in given else f"the limits in {source}"
                unit = None if limits is velocity else "rad" if name in turns else (units or {}).get(name)
                problems.append(
                    (
                        (*path, name),
                        f"found {value:g}, expected a value in [{lower:g}, {upper:g}], {words}"
                        f"{_in_another_unit(value, unit, lower, upper)}{f' ({_as_part(why)})' if why else ''}",
                    )
                )
    for name, (lower, upper) in task.limits.velocity.items():
        at_rest = name not in task.initial.velocity and task.goal.periodic is None
        if at_rest and not lower - ROUNDED <= 0 <= upper + ROUNDED:
            problems.append(
                (
                    ("limits", "velocity", name),
                    f"found [{lower:g}, {upper:g}], but the motion starts at rest, expected limits with 0 between them "
                    f"or initial.velocity.{name}",
                )
            )
    error = task.origins.first_error(problems)
    if error is not None:
        raise error


def _as_part(sentence: str) -> str:
    return sentence[:1].lower() + sentence[1:].rstrip(".")


_FOREIGN = {"rad": ("degrees", math.pi / 180), "m": ("mm", 1e-3)}
"""Unit of a coordinate -> the unit that is written in its place by mistake, and how much it is."""

_LARGE = 10.0
"""m or rad; nobody means a smaller number in degrees or millimetres."""


def _in_another_unit(value: float, unit: str | None, lower: float, upper: float) -> str:
    """Convert a value to the unit that was perhaps meant, if it lies within the limits there."""
    if unit not in _FOREIGN or abs(value) < _LARGE:
        return ""
    foreign, size = _FOREIGN[unit]
    return f" ({value:g} {foreign} are {value * size:.6g} {unit})" if lower <= value * size <= upper else ""


def _names_used(task: Task) -> Iterator[tuple[KeyPath, NameKind, str]]:
    """Yield (key path, kind, name) of every name in a task that must exist on the robot."""
    yield from _maps(
        ("robot", "armature", "joint", task.robot.armature),
        ("robot", "damping", "joint", task.robot.damping),
        ("robot", "dry_friction", "joint", task.robot.dry_friction or {}),
        ("limits", "effort", "joint", task.limits.effort),
        ("initial", "configuration", _CONFIGURATION, task.initial.configuration),
        ("initial", "velocity", _VELOCITY, task.initial.velocity),
        ("reference", "apex", _CONFIGURATION, task.reference.apex if isinstance(task.reference, Jumps) else None),
        *(("costs", key, term.names, getattr(task.costs, key)) for key, term in COST_TERMS.items() if term.names),
        ("limits", "position", _CONFIGURATION, task.limits.position),
        ("limits", "velocity", _VELOCITY, task.limits.velocity),
    )
    yield from _body_names(task)
    for i, name in enumerate(task.robot.passive):
        yield ("robot", "passive", str(i)), "joint", name
    if task.goal.periodic is not None:
        for name in task.goal.periodic.stride:
            yield ("goal", "periodic", "stride", name), _CONFIGURATION, name
        for name in task.goal.periodic.mirror:
            for one in dict.fromkeys((name, task.goal.periodic.source(name)[0])):
                yield ("goal", "periodic", "mirror", name), _CONFIGURATION, one
    for posture, values in task.postures.items():
        for name in values:
            yield ("postures", posture, name), _CONFIGURATION, name
    for at, state in task.states:
        if state.posture is not None:
            yield (*at, "posture"), "posture", state.posture
        for path, kind, name in state.standing_names():
            yield (*at, *path), kind, name
        if not isinstance(state, Initial):
            yield from _target_names(at, state)
    yield from _constraint_names(task)
    for name, contact in task.contacts.items():
        key = "body" if isinstance(contact, BodyContact) else "frame"
        yield ("contacts", name, key), "frame", getattr(contact, key)
        if isinstance(contact, TwoBodyContact):
            yield ("contacts", name, "other_frame"), "frame", contact.other_frame
    yield from _actuator_names(task)


def _body_names(task: Task) -> Iterator[tuple[KeyPath, NameKind, str]]:
    """Yield (key path, kind, name beside the robot) of every joint that a task names in a body."""
    for body, section in task.bodies.items():
        for key in ("armature", "damping", "dry_friction"):
            for name in getattr(section, key, None) or ():
                yield ("bodies", body, key, name), "joint", f"{body}.{name}"


def _maps(
    *maps: tuple[str, str, NameKind, Mapping[str, object] | None],
) -> Iterator[tuple[KeyPath, NameKind, str]]:
    """Yield (key path, kind, name) of all names in maps, given as (section, key, kind of its names, map)."""
    for section, key, kind, names in maps:
        for name in names or ():
            yield (section, key, name), kind, name


def _constraint_names(task: Task) -> Iterator[tuple[KeyPath, NameKind, str]]:
    for name, constraint in task.constraints.items():
        if isinstance(constraint, BodyPoint):
            yield ("constraints", name, "frame"), "frame", constraint.frame
        elif isinstance(constraint, SwingClearance):
            for i, contact in enumerate(constraint.contacts):
                yield ("constraints", name, "contacts", str(i)), "contact", contact
        elif isinstance(constraint, DistanceConstraint):
            for key, body in constraint.body_names.items():
                yield ("constraints", name, *key), "frame", body
        else:
            yield ("constraints", name, "contact"), "contact", constraint.contact


def _actuator_names(task: Task) -> Iterator[tuple[KeyPath, NameKind, str]]:
    for control, actuator in (task.robot.actuators or {}).items():
        at = ("robot", "actuators", control)
        if isinstance(actuator, JointActuator):
            yield (*at, "joint"), "joint", actuator.joint
            continue
        for name, force in actuator.force.items():
            yield (*at, "force", name), _VELOCITY, name
            for used in sorted(expression_names(force)):
                yield (*at, "force", name), _CONFIGURATION, used
    for group, sets in task.robot.one_at_a_time.items():
        for one, controls in sets.items():
            for i, control in enumerate(controls):
                yield ("robot", "one_at_a_time", group, one, str(i)), "control", control


def _target_names(path: KeyPath, target: Goal | Waypoint) -> Iterator[tuple[KeyPath, NameKind, str]]:
    """Yield (key path, kind, name) of every name in a goal or waypoint."""
    groups: tuple[tuple[KeyPath, NameKind, Iterable[str]], ...] = (
        (("configuration",), _CONFIGURATION, target.configuration),
        (("velocity",), _VELOCITY, target.velocity),
        (("tolerance", "configuration"), _CONFIGURATION, target.tolerance.configuration),
        (("tolerance", "velocity"), _VELOCITY, target.tolerance.velocity),
        (("frames",), "frame", target.frames),
    )
    for keys, kind, names in groups:
        for name in names:
            yield (*path, *keys, name), kind, name
