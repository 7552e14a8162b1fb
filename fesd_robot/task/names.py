"""Checks of a task against the robot it is for: names that must exist, values that must lie within limits."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

from fesd_robot.errors import nearest
from fesd_robot.task.contacts import CircleCircleContact
from fesd_robot.task.expression import expression_names
from fesd_robot.task.origins import KeyPath
from fesd_robot.task.scene import JointActuator
from fesd_robot.task.schema import Jumps, Task

_SLACK = 1e-9
"""m or rad (or per s): a value this far outside its limit is on it, rounded."""

_CONFIGURATION, _VELOCITY, _JOINT, _FRAME = "configuration coordinate", "velocity coordinate", "joint", "frame"


def check_names(
    task: Task,
    configuration_names: Collection[str],
    velocity_names: Collection[str],
    joint_names: Collection[str],
    frame_names: Collection[str],
    control_names: Collection[str] | None = None,
) -> None:
    """Raise the first error, by line, about a name that the robot does not have.

    Args:
        task: the task.
        configuration_names: the robot's configuration coordinates.
        velocity_names: the robot's velocity coordinates.
        joint_names: the robot's joints.
        frame_names: the robot's frames.
        control_names: names of the controls; default: the task's actuators, without any the joints.

    Raises:
        TaskError: some name is unknown; the error names the nearest valid one.
    """
    if control_names is None:
        control_names = joint_names if task.robot.actuators is None else list(task.robot.actuators)
    valid = {
        _CONFIGURATION: configuration_names,
        _VELOCITY: velocity_names,
        _JOINT: joint_names,
        _FRAME: frame_names,
        "control": control_names,
    }
    problems = [
        (path, f"found '{name}', expected a {kind}{nearest(name, valid[kind])}")
        for path, kind, name in _names_used(task)
        if name not in valid[kind]
    ]
    error = task.origins.first_error(problems)
    if error is not None:
        raise error


def check_values(
    task: Task,
    configuration_limits: Mapping[str, tuple[float, float]],
    velocity_limits: Mapping[str, tuple[float, float]],
) -> None:
    """Raise the first error, by line, about an initial value, goal or apex outside its limits.

    Only values that the task gives are checked; limits in the task come before those passed in.

    Args:
        task: the task, its names already checked.
        configuration_limits: name -> (lower, upper) of the robot, m or rad; a name may be missing.
        velocity_limits: name -> (lower, upper) of the robot, m/s or rad/s; a name may be missing.

    Raises:
        TaskError: some value lies outside; the error names the value and both limits.
    """
    configuration = {**configuration_limits, **task.limits.position}
    velocity = {**velocity_limits, **task.limits.velocity}
    groups = [
        (("initial", "configuration"), task.initial.configuration, configuration),
        (("initial", "velocity"), task.initial.velocity, velocity),
        (("goal", "configuration"), task.goal.configuration, configuration),
        (("goal", "velocity"), task.goal.velocity, velocity),
    ]
    if isinstance(task.reference, Jumps):
        groups.append((("reference", "apex"), task.reference.apex, configuration))
    problems: list[tuple[KeyPath, str]] = []
    for path, values, limits in groups:
        given = task.limits.velocity if limits is velocity else task.limits.position
        for name, value in values.items():
            lower, upper = limits.get(name, (-float("inf"), float("inf")))
            if not lower - _SLACK <= value <= upper + _SLACK:
                source = f"limits.{'velocity' if limits is velocity else 'position'}" if name in given else "the robot"
                problems.append(
                    (
                        (*path, name),
                        f"found {value:g}, expected a value in [{lower:g}, {upper:g}], the limits in {source}",
                    )
                )
    error = task.origins.first_error(problems)
    if error is not None:
        raise error


def _names_used(task: Task) -> Iterator[tuple[KeyPath, str, str]]:
    """Yield (key path, kind, name) of every name in a task that must exist on the robot."""
    for path, kind, names in (
        (("robot", "armature"), _JOINT, task.robot.armature),
        (("initial", "configuration"), _CONFIGURATION, task.initial.configuration),
        (("initial", "velocity"), _VELOCITY, task.initial.velocity),
        (("goal", "configuration"), _CONFIGURATION, task.goal.configuration),
        (("goal", "velocity"), _VELOCITY, task.goal.velocity),
        (("goal", "tolerance", "configuration"), _CONFIGURATION, task.goal.tolerance.configuration),
        (("goal", "tolerance", "velocity"), _VELOCITY, task.goal.tolerance.velocity),
        (("reference", "apex"), _CONFIGURATION, task.reference.apex if isinstance(task.reference, Jumps) else {}),
        (("costs", "configuration"), _CONFIGURATION, task.costs.configuration),
        (("costs", "velocity"), _VELOCITY, task.costs.velocity),
        (("costs", "control"), "control", task.costs.control),
        (("costs", "terminal_configuration"), _CONFIGURATION, task.costs.terminal_configuration),
        (("costs", "terminal_velocity"), _VELOCITY, task.costs.terminal_velocity),
        (("limits", "position"), _CONFIGURATION, task.limits.position),
        (("limits", "velocity"), _VELOCITY, task.limits.velocity),
    ):
        for name in names or ():
            yield (*path, name), kind, name
    for name, contact in task.contacts.items():
        yield ("contacts", name, "frame"), _FRAME, contact.frame
        if isinstance(contact, CircleCircleContact):
            yield ("contacts", name, "other_frame"), _FRAME, contact.other_frame
    for control, actuator in (task.robot.actuators or {}).items():
        path = ("robot", "actuators", control)
        if isinstance(actuator, JointActuator):
            yield (*path, "joint"), _JOINT, actuator.joint
            continue
        for name, force in actuator.force.items():
            yield (*path, "force", name), _VELOCITY, name
            for used in sorted(expression_names(force)):
                yield (*path, "force", name), _CONFIGURATION, used
