"""A task compared with a robot: unknown names and values outside limits point at their line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fesd_robot.errors import TaskError
from fesd_robot.task import Task, check_names, check_values, load_task

Write = Callable[[str], Path]
COORDINATES = ["root_x", "root_z", "root_pitch", "leg"]


def check(task: Task) -> None:
    check_names(task, COORDINATES, COORDINATES, COORDINATES, ["body", "foot"])


def test_known_names_pass(base: str, write: Write) -> None:
    """A task whose names all exist on the robot raises nothing."""
    check(load_task(write(base)))


# (text of the valid task, its replacement, line, key, fragments of the message)
EDITS: list[tuple[str, str, int, str, list[str]]] = [
    ("armature: {leg", "armature: {lag", 5, "robot.armature.lag", ["'lag'", "a joint", "did you mean 'leg'?"]),
    ("joint: root_pitch", "joint: pitch", 7, "robot.actuators.torque.joint", ["'pitch'", "'root_pitch'"]),
    ("        leg: 1", "        legs: 1", 12, "robot.actuators.push.force.legs", ["velocity coordinate", "'leg'"]),
    ("-sin(root_pitch)", "-sin(rot_pitch)", 11, "robot.actuators.push.force.root_x", ["'rot_pitch'", "'root_pitch'"]),
    ("    frame: foot", "    frame: food", 21, "contacts.foot.frame", ["a frame", "did you mean 'foot'?"]),
    ("{leg: 0.5}", "{knee: 0.5}", 26, "initial.configuration.knee", ["valid: leg, root_pitch, root_x, root_z"]),
    ("root_x: 1.0", "root_y: 1.0", 29, "goal.configuration.root_y", ["'root_y'", "a configuration coordinate"]),
    ("{root_x: 0.01}", "{x: 0.01}", 31, "goal.tolerance.configuration.x", ["'x'"]),
    ("apex: {leg", "apex: {leg_length", 35, "reference.apex.leg_length", ["'leg_length'"]),
    ("{root_x: 100}", "{rootx: 100}", 37, "costs.configuration.rootx", ["did you mean 'root_x'?"]),
    ("control: {push", "control: {leg", 38, "costs.control.leg", ["a control", "valid: push, torque"]),
    ("    leg: [", "    log: [", 41, "limits.position.log", ["'log'"]),
    ("velocity: {leg", "velocity: {log", 42, "limits.velocity.log", ["'log'", "a velocity coordinate"]),
]


@pytest.mark.parametrize(("old", "new", "line", "key", "fragments"), EDITS, ids=[edit[3] for edit in EDITS])
def test_an_unknown_name_is_located(
    base: str, write: Write, old: str, new: str, line: int, key: str, fragments: list[str]
) -> None:
    """Every place of a task that holds a name is checked, and the error names the nearest valid one."""
    assert old in base
    task = load_task(write(base.replace(old, new, 1)))
    with pytest.raises(TaskError) as caught:
        check(task)
    assert (caught.value.line, caught.value.key) == (line, key), str(caught.value)
    for fragment in fragments:
        assert fragment in caught.value.message


def test_the_first_unknown_name_is_reported(base: str, write: Write) -> None:
    """Of several unknown names the one nearest the top is reported, and how many more there are."""
    task = load_task(write(base))
    with pytest.raises(TaskError, match="; and 2 more errors") as caught:
        check_names(task, COORDINATES, COORDINATES, ["root_pitch"], ["leg"], ["torque"])
    assert caught.value.key == "robot.armature.leg"


def test_default_controls_are_the_joints(base: str, write: Write) -> None:
    """Without actuators the control costs may name joints, or what the caller says is driven."""
    task = load_task(write(base), ["robot.actuators=null", "costs.control={leg: 1}"])
    check(task)
    with pytest.raises(TaskError, match="expected a control") as caught:
        check_names(task, COORDINATES, COORDINATES, COORDINATES, ["foot"], ["root_pitch"])
    assert "--set costs.control" in caught.value.message


LIMITS = {"root_x": (-1.0, 2.0), "leg": (0.0, 1.0)}


def test_values_inside_limits_pass(base: str, write: Write) -> None:
    """Values on or within their limits raise nothing, also with coordinates that have no limit."""
    check_values(load_task(write(base)), LIMITS, {})


@pytest.mark.parametrize(
    ("old", "new", "line", "key", "fragments"),
    [
        ("root_x: 1.0", "root_x: 3", 29, "goal.configuration.root_x", ["found 3", "[-1, 2]", "the robot"]),
        ("{leg: 0.5}", "{leg: 0.6}", 26, "initial.configuration.leg", ["0.6", "[0.1, 0.5]", "limits.position"]),
        ("apex: {leg: 0.1}", "apex: {leg: 0.05}", 35, "reference.apex.leg", ["0.05", "[0.1, 0.5]"]),
        ("{leg: 0.5}", "{leg: 0.5}\n  velocity: {leg: 6}", 27, "initial.velocity.leg", ["6", "limits.velocity"]),
        ("goal:", "goal:\n  velocity: {root_x: -9}", 28, "goal.velocity.root_x", ["found -9", "[-8, 8]", "the robot"]),
    ],
)
def test_a_value_outside_its_limits_is_located(
    base: str, write: Write, old: str, new: str, line: int, key: str, fragments: list[str]
) -> None:
    """A start, goal or apex outside its limits names the value, the limits and where they come from."""
    task = load_task(write(base.replace(old, new, 1)))
    with pytest.raises(TaskError) as caught:
        check_values(task, LIMITS, {"root_x": (-8.0, 8.0), "leg": (-1.0, 1.0)})
    assert (caught.value.line, caught.value.key) == (line, key), str(caught.value)
    for fragment in fragments:
        assert fragment in caught.value.message
