"""Checks of what a task says about orientations and turns: entries that are whole, angles where they have a meaning."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping

from fesd_robot.exactness import WRITTEN
from fesd_robot.orientations import angles_of, orientations_of, quaternion_of, turn_of, turns_of
from fesd_robot.task.goal import Goal, Waypoint
from fesd_robot.task.origins import KeyPath
from fesd_robot.task.reference import Jumps
from fesd_robot.task.schema import Task

WRITTEN_NORM = 1e-2
"""Difference of the norm of a quaternion, or of a cosine and sine, from one that few digits leave."""


def check_orientations(task: Task, configuration_names: Collection[str]) -> None:
    """Raise the first error, by line, about the orientation or the turn of a joint.

    Args:
        task: its names already checked.
        configuration_names: the robot's configuration coordinates.

    Raises:
        TaskError: angles beside a quaternion or beside a cosine and sine, such entries that are not whole or not of
            norm one, a weight or a tolerance or a limit of one of them, limits of an angle that no motion could break
            or keep.
    """
    problems = [
        problem
        for joint in orientations_of(configuration_names)
        for problem in (
            *(one for path, values in _configurations(task) for one in _whole(path, values, joint)),
            *(one for path, names in _deviations(task) for one in _part(path, names, joint)),
            *_limited(task, joint),
        )
    ]
    problems += [
        problem
        for joint in turns_of(configuration_names)
        for problem in (
            *(one for path, values in _configurations(task) for one in _whole_turn(path, values, joint)),
            *(one for path, names in _deviations(task) for one in _part_of_turn(path, names, joint)),
            *_part_of_turn(("limits", "position"), task.limits.position, joint),
            *_limited_turn(task, joint),
        )
    ]
    error = task.origins.first_error(problems)
    if error is not None:
        raise error


def _configurations(task: Task) -> Iterator[tuple[KeyPath, Mapping[str, float]]]:
    for name, posture in task.postures.items():
        yield ("postures", name), posture
    for path, state in task.states:
        yield (*path, "configuration"), state.configuration
    if isinstance(task.reference, Jumps):
        yield ("reference", "apex"), task.reference.apex


def _deviations(task: Task) -> Iterator[tuple[KeyPath, Mapping[str, float]]]:
    for key in ("configuration", "terminal_configuration"):
        yield ("costs", key), getattr(task.costs, key) or {}
    for path, state in task.states:
        if isinstance(state, Goal | Waypoint):
            yield (*path, "tolerance", "configuration"), state.tolerance.configuration


def _whole(path: KeyPath, values: Mapping[str, float], joint: str) -> Iterator[tuple[KeyPath, str]]:
    """Yield the mistakes in the orientation that a configuration gives a joint."""
    given = [entry for entry in quaternion_of(joint) if entry in values]
    angles = [angle for angle in angles_of(joint) if angle in values]
    if given and angles:
        yield (*path, angles[0]), f"found '{angles[0]}' beside '{given[0]}', expected angles or a quaternion, not both"
    elif given and len(given) < len(quaternion_of(joint)):
        missing = [entry for entry in quaternion_of(joint) if entry not in given]
        yield (
            (*path, given[0]),
            f"found a quaternion without {_listed(missing)}, expected all of {_listed(quaternion_of(joint))}, or some "
            f"of {_listed(angles_of(joint))} (rad)",
        )
    elif given:
        norm = math.sqrt(sum(values[entry] ** 2 for entry in given))
        if abs(norm - 1.0) > WRITTEN_NORM:
            yield (
                (*path, given[0]),
                f"found a quaternion of norm {norm:.4g}, expected one of norm 1, within {WRITTEN_NORM:g} for rounded "
                "digits",
            )


def _part(path: KeyPath, names: Collection[str], joint: str) -> Iterator[tuple[KeyPath, str]]:
    """Yield every entry of a quaternion that has a weight or a tolerance of its own."""
    for entry in quaternion_of(joint):
        if entry in names:
            yield (
                (*path, entry),
                f"found '{entry}', a part of a quaternion, expected {_listed(angles_of(joint))}: the turn from what is "
                "wanted, rad, about the x, y and z axis of the body",
            )


def _limited(task: Task, joint: str) -> Iterator[tuple[KeyPath, str]]:
    """Yield limits of a quaternion's entries, and those of angles that say nothing."""
    at, given = ("limits", "position"), task.limits.position
    roll, pitch, yaw = angles_of(joint)
    for entry in quaternion_of(joint):
        if entry in given:
            yield (*at, entry), f"found '{entry}', a part of a quaternion, expected {_listed([roll, pitch, yaw])} (rad)"
    for angle in (roll, yaw):
        if angle in given and not _within_a_turn(given[angle]):
            yield (*at, angle), _ONE_TURN
    right = math.pi / 2
    if any(math.isfinite(bound) and abs(bound) > right + WRITTEN for bound in given.get(pitch, ())):
        yield (*at, pitch), f"found a limit beyond a right angle, expected numbers in [-{right:.6g}, {right:.6g}] (rad)"


def _whole_turn(path: KeyPath, values: Mapping[str, float], joint: str) -> Iterator[tuple[KeyPath, str]]:
    """Yield the mistakes in the angle, or the cosine and sine, that a configuration gives a joint."""
    given = [entry for entry in turn_of(joint) if entry in values]
    if given and joint in values:
        yield (*path, joint), f"found '{joint}' beside '{given[0]}', expected the angle or {_listed(given)}, not both"
    elif len(given) == 1:
        (missing,) = (entry for entry in turn_of(joint) if entry not in given)
        yield (*path, given[0]), f"found '{given[0]}' without '{missing}', expected the angle '{joint}' (rad), or both"
    elif given:
        norm = math.hypot(*(values[entry] for entry in given))
        if abs(norm - 1.0) > WRITTEN_NORM:
            yield (
                (*path, given[0]),
                f"found a cosine and sine of norm {norm:.4g}, expected the angle '{joint}' (rad), or a norm of 1, "
                f"within {WRITTEN_NORM:g} for rounded digits",
            )


def _part_of_turn(path: KeyPath, names: Collection[str], joint: str) -> Iterator[tuple[KeyPath, str]]:
    """Yield every cosine or sine that has a weight, a tolerance or a limit of its own."""
    for entry in turn_of(joint):
        if entry in names:
            yield (*path, entry), f"found '{entry}', a part of an angle, expected '{joint}' (rad)"


def _limited_turn(task: Task, joint: str) -> Iterator[tuple[KeyPath, str]]:
    """Yield limits of an angle that say nothing."""
    if joint in task.limits.position and not _within_a_turn(task.limits.position[joint]):
        yield ("limits", "position", joint), _ONE_TURN


def _within_a_turn(limits: tuple[float, float]) -> bool:
    return limits[1] - limits[0] < 2 * math.pi


_ONE_TURN = (
    f"found limits that are one turn apart or more, expected two numbers less than {2 * math.pi:.6g} apart (rad)"
)


def _listed(names: Collection[str]) -> str:
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last
