"""What `fesd-robot check` says about where a robot stands, and about a start that floats."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from fesd_robot.explanation import explanation, task_warnings
from fesd_robot.fesd import Transcription
from fesd_robot.ocp import formulate
from fesd_robot.task import load_task

TASKS = Path(__file__).parents[2] / "tasks"
LINE = "reference={type: line}"


def warnings(name: str, *overrides: str) -> list[str]:
    return task_warnings(formulate(load_task(TASKS / f"{name}.yaml", overrides)))


def test_what_was_found_is_said() -> None:
    """Start, goal and waypoint are a sentence each, with contacts, values and units."""
    overrides = [
        "initial.stand_on=[front, hind]",
        "goal.stand_on={contacts: [hind], adjust: [HL_KFE]}",
        "waypoints=[{time: 0.2, configuration: {root_x: 0.1}}, {time: 0.4, stand_on: [front]}]",
        "method.grid=uniform",
    ]
    motion = formulate(load_task(TASKS / "solo12_jump.yaml", overrides))
    text = explanation(motion, Transcription(motion.ocp, motion.fesd).problem)
    assert "Standing    At the start standing on front, hind: root_z 0.244749 m, root_pitch 0 rad." in text
    assert "            At the goal standing on hind, all through the last control interval: HL_KFE -1.4 rad." in text
    assert "            At waypoint 2 standing on front: root_z 0.244749 m." in text


def test_preferences_are_said() -> None:
    """What is wanted stands beside what was found."""
    overrides = ["initial.stand_on={contacts: [front, hind], prefer: {FL_KFE: -1.2}}", "method.grid=uniform"]
    motion = formulate(load_task(TASKS / "solo12_jump.yaml", overrides))
    text = explanation(motion, Transcription(motion.ocp, motion.fesd).problem)
    assert "At the start standing on front, hind, as near as possible to FL_KFE -1.2 rad: " in text


def test_nothing_is_said_where_nothing_was_asked() -> None:
    """A task without `stand_on` has no such section."""
    motion = formulate(load_task(TASKS / "published_hopper_one_jump.yaml"))
    assert "tanding" not in explanation(motion, Transcription(motion.ocp, motion.fesd).problem)


@pytest.mark.parametrize(("height", "gap"), [(0.5012, "0.0012"), (0.50002, "2e-05"), (0.5099, "0.0099")])
def test_a_start_that_floats_is_reported_with_the_height(height: float, gap: str) -> None:
    """A hopper at rest up to 1 cm above the ground falls; with the height from the warning it stands."""
    overrides = [f"initial.configuration.root_z={height}", "goal.configuration.root_z=0.5", LINE]
    assert warnings("published_hopper_one_jump", *overrides) == [
        f"Contact 'foot' starts {gap} m above the ground and falls; to stand, write initial.configuration.root_z: 0.5 "
        "or initial.stand_on: [foot]."
    ]


def test_the_height_on_a_slope() -> None:
    """The gap is measured along the normal, the height along z; both ways of the advice end the warning."""
    at = ["ground.slope=0.2", "goal.configuration.root_z=0.75", LINE]
    height = 0.5 + 0.1 * math.tan(0.2)
    floating = [f"initial.configuration.root_z={height + 0.004:.6f}", *at]
    (sentence,) = warnings("published_hopper_one_jump", *floating)
    advised = re.search(r"root_z: ([\d.]+) or (initial\.stand_on: \[foot\])\.", sentence)
    assert advised is not None and float(advised[1]) == pytest.approx(height, abs=1e-6)
    assert f"starts {0.004 * math.cos(0.2):.4g} m" in sentence
    assert warnings("published_hopper_one_jump", *at, f"initial.configuration.root_z={advised[1]}") == []
    assert warnings("published_hopper_one_jump", *floating, advised[2].replace(": ", "=")) == []


def test_the_foot_that_touches_first_decides() -> None:
    """Of several feet the height is that of the lowest, and all that touch there are named."""
    level = "limits.effort={}"
    (both,) = warnings("solo12_jump", "initial.configuration.root_z=0.25", level)
    assert "Contact 'front' starts 0.005251 m" in both
    assert "root_z: 0.244749 or initial.stand_on: [front, hind]." in both
    (one,) = warnings("solo12_jump", "initial.configuration.root_z=0.25", "initial.configuration.FL_HFE=0.72", level)
    hind = 0.32 * math.cos(0.7)
    assert f"Contact 'hind' starts {0.25 - hind:.4g} m" in one
    assert one.endswith(f"root_z: {hind:.6f} or initial.stand_on: [hind].")


@pytest.mark.parametrize(
    "overrides",
    [
        ["initial.configuration.root_z=0.5", "goal.configuration.root_z=0.5"],
        ["initial.configuration.root_z=0.500008", "goal.configuration.root_z=0.5"],
        ["initial.configuration.root_z=0.52", "goal.configuration.root_z=0.5"],
        ["initial.configuration.root_z=0.505", "initial.velocity={root_z: 0.3}", "goal.configuration.root_z=0.5"],
        ["initial.configuration.root_z=0.505", "goal={periodic: {stride: {root_x: 0.9}}}", "costs={}"],
        ["initial.configuration.root_z=0.505", "contacts.hub={type: circle_circle, frame: body, radius: 0.25, "
         "other_frame: foot, other_radius: 0.25}", "goal.configuration.root_z=0.505"],
    ],
    ids=["standing", "rounded", "high", "thrown", "periodic", "held"],
)  # fmt: skip
def test_a_start_that_does_not_float_by_mistake_is_not(overrides: list[str]) -> None:
    """Standing, jumping, flying higher, a free start and a robot that touches something else are no reason to warn."""
    assert warnings("published_hopper_one_jump", LINE, *overrides) == []


def test_degrees_of_a_posture_are_reported_there_once() -> None:
    """An angle in degrees that a posture gives is reported under the posture, not where it is used."""
    goal = "goal={soft: true, posture: tilted, configuration: {root_z: 0.9}}"
    overrides = ["postures={tilted: {root_pitch: 30}}", goal]
    found = warnings("published_hopper_one_jump", "limits.position.root_pitch=[null, null]", LINE, *overrides)
    assert [sentence for sentence in found if "turns" in sentence] == [
        "postures.tilted.root_pitch is 30 rad, 4.8 turns; 30 degrees would be 0.523599 rad."
    ]
