"""Defaults of hard constraints: the tolerances of a goal, and which feet do not slip."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from fesd_robot.ocp.scene import friction_of
from fesd_robot.ocp.vectors import StateLimits
from fesd_robot.orientations import deviation_names
from fesd_robot.robot import Robot
from fesd_robot.task import DEFAULT_TOLERANCE, GROUND, Jumps, PointTarget, Task, Tolerance


def with_default_tolerances(task: Task, robot: Robot, limits: StateLimits) -> Task:
    """Return the task with a tolerance for every value of a hard goal; such a task does not change any more.

    A hard goal reaches all that it lists, and rest where it lists positions but no velocity; a soft goal or one that
    repeats has its own tolerances only.

    Args:
        task: with the whole configuration of its goal.
        limits: of the robot in this task.

    Raises:
        TaskError: rest is required where a velocity limit forbids it.
    """
    goal = task.goal
    if goal.soft or goal.periodic is not None:
        return task
    at_rest = goal.rests
    if at_rest:
        _check_rest(task, robot, limits)
    points = {name: _with_tolerances(point) for name, point in goal.frames.items()}
    tolerance = Tolerance(
        configuration=_widths(deviation_names(goal.configuration), goal.tolerance.configuration),
        velocity=_widths(robot.velocity_names if at_rest else goal.velocity, goal.tolerance.velocity),
    )
    center = goal.center_of_mass and _with_tolerances(goal.center_of_mass)
    hard = goal.model_copy(update={"tolerance": tolerance, "frames": points, "center_of_mass": center})
    return task.model_copy(update={"goal": hard})


def with_slipping(task: Task) -> Task:
    """Return the task with the slipping of every contact allowed, forbidden or limited, where it is automatic.

    What jumps sticks or flies; sliding along the ground is cheaper than that with most costs.
    """
    jumps = isinstance(task.reference, Jumps) and task.method.formulation.type == "multipliers"
    contacts = {
        name: contact.model_copy(update={"slipping": "forbidden" if _sticks(task, name, jumps) else "allowed"})
        if contact.slipping == "auto"
        else contact
        for name, contact in task.contacts.items()
    }
    return task.model_copy(update={"contacts": contacts})


def _sticks(task: Task, name: str, jumps: bool) -> bool:
    return jumps and getattr(task.contacts[name], "surface", None) == GROUND and friction_of(task, name) > 0


def _widths(names: Iterable[str], given: Mapping[str, float]) -> dict[str, float]:
    return {**dict.fromkeys(names, DEFAULT_TOLERANCE), **given}


def _with_tolerances(point: PointTarget) -> PointTarget:
    """Return the target with a tolerance for its position and its velocity, where it has them."""
    wanted = {"tolerance": point.position, "velocity_tolerance": point.velocity}
    missing = [key for key, value in wanted.items() if value is not None and getattr(point, key) is None]
    return point.model_copy(update=dict.fromkeys(missing, DEFAULT_TOLERANCE))


def _check_rest(task: Task, robot: Robot, limits: StateLimits) -> None:
    for name, lower, upper in zip(robot.velocity_names, limits.lower_velocity, limits.upper_velocity, strict=True):
        if not lower <= 0 <= upper:
            raise task.error(
                "goal",
                f"found no velocity, which means rest, but '{name}' is limited to [{lower:g}, {upper:g}], expected "
                f"goal.velocity.{name} within its limits, or goal.soft: true",
            )
