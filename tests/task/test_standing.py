"""Postures and contacts to stand on in the task file: what is read, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fesd_robot.errors import TaskError
from fesd_robot.task import StandOn, Task, load_task

Write = Callable[[str], Path]

TASK = """\
name: hop
robot: {model: hopper.urdf}
contacts:
  foot: {frame: foot}
horizon: {duration: 2, intervals: 8}
postures:
  crouch: {leg: 0.2}
initial:
  posture: crouch
  stand_on: [foot]
goal:
  configuration: {root_x: 1}
  stand_on: {contacts: [foot], adjust: [root_z, leg]}
waypoints:
  - posture: crouch
    stand_on: {contacts: [foot]}
    tolerance: {configuration: {root_z: 0.1}}
reference: {type: waypoints}
"""


def test_both_ways_to_write_it_are_read(write: Write) -> None:
    """A list of contacts stands for a mapping with these and the default, and both survive JSON as they are."""
    task = load_task(write(TASK))
    assert task.initial.standing == StandOn(contacts=["foot"]) == task.waypoints[0].standing
    assert task.goal.standing == StandOn(contacts=["foot"], adjust=["root_z", "leg"])
    assert (task.initial.posture, task.goal.posture) == ("crouch", None)
    stored = task.model_dump(mode="json")
    assert stored["initial"]["stand_on"] == ["foot"]
    assert Task.model_validate(stored) == task


def test_postures_may_be_unused_and_are_empty_by_default(write: Write) -> None:
    """A posture that nothing names is no mistake; without postures there are none."""
    assert load_task(write(TASK.replace("crouch: {leg: 0.2}", "crouch: {leg: 0.2}\n  low: {leg: 0.1}"))).postures == {
        "crouch": {"leg": 0.2},
        "low": {"leg": 0.1},
    }
    assert load_task(write(TASK), ["postures.low={leg: 0.1}"]).postures["low"] == {"leg": 0.1}


PERIODIC = "goal:\n  periodic: {}\n  "

# (text of the valid task, its replacement, line, key, fragments of the message)
EDITS: list[tuple[str, str, int, str, list[str]]] = [
    ("  crouch: {leg: 0.2}", "  crouch: {leg: low}", 7, "postures.crouch.leg", ["'low'", "a number"]),
    ("[foot]\ngoal", "foot\ngoal", 10, "initial.stand_on", ["found the text 'foot', expected a list"]),
    ("[foot]\ngoal", "[]\ngoal", 10, "initial.stand_on", ["an empty list", "at least one entry"]),
    ("[foot]\ngoal", "[3]\ngoal", 10, "initial.stand_on.0", ["found 3, expected text"]),
    ("[foot]\ngoal", "[foot, foot]\ngoal", 10, "initial.stand_on", ["'foot', 'foot'", "every name once"]),
    ("adjust: [root_z, leg]", "adjust: [leg, leg]", 13, "goal.stand_on.adjust", ["every name once"]),
    ("adjust: [root_z, leg]", "ajust: [leg]", 13, "goal.stand_on.ajust", ["did you mean 'adjust'?"]),
    ("{contacts: [foot]}", "{adjust: [leg]}", 16, "waypoints.0.stand_on.contacts", ["this key is missing"]),
    ("goal:\n  configuration: {root_x: 1}\n  ", PERIODIC, 13, "goal.stand_on", ["goal stand_on beside 'periodic'"]),
    ("goal:\n  configuration: {root_x: 1}\n  stand_on: {contacts: [foot], adjust: [root_z, leg]}\n",
     PERIODIC + "posture: crouch\n", 13, "goal.posture", ["goal posture beside 'periodic'"]),
    ("{root_z: 0.1}}", "{root_z: 0.1}, velocity: {leg: 0}}", 17, "waypoints.0.tolerance.velocity.leg",
     ["gives no velocity"]),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "line", "key", "fragments"), EDITS, ids=[f"{e[3]} {e[4][0]}" for e in EDITS])
def test_a_mistake_is_located(write: Write, old: str, new: str, line: int, key: str, fragments: list[str]) -> None:
    """Each mistake is one error with file, line and key that says what was found and what would be valid."""
    assert TASK.count(old) == 1
    with pytest.raises(TaskError) as caught:
        load_task(write(TASK.replace(old, new)))
    assert (caught.value.line, caught.value.key) == (line, key), str(caught.value)
    for fragment in fragments:
        assert fragment in caught.value.message
