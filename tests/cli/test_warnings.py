"""What `fesd-robot check` warns of: valid, but likely mistakes."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fesd_robot.explanation.warnings import task_warnings
from fesd_robot.ocp import formulate
from fesd_robot.task import load_task

ROOT = Path(__file__).parents[2]
ONE_JUMP = ROOT / "tasks" / "published_hopper_one_jump.yaml"
LINE = "reference={type: line}"
STILL = ["goal.configuration.root_x=0.1", LINE]
FLYING = ["initial.configuration.root_z=0.9", "goal.configuration.root_z=0.9"]

# (overrides, sentence)
WARNINGS: list[tuple[list[str], str]] = [
    (
        ["limits.position.root_pitch=[null, null]", "reference.apex.root_pitch=30"],
        "reference.apex.root_pitch is 30 rad, 4.8 turns; 30 degrees would be 0.523599 rad.",
    ),
    (
        [*FLYING, LINE],
        "Neither at the start nor at the goal is any contact near what it may touch; the nearest is 'foot', 0.4 m "
        "away.",
    ),
    (
        [
            "ground={walls: {end: {x: 3, side: left}}}",
            "contacts={foot: {frame: foot}, hub: {frame: world, surface: end}}",
        ],
        "Contact 'hub' can never touch: no joint changes its distance from what it may touch.",
    ),
    (
        ["initial.velocity={root_z: -0.5}"],
        "Contact 'foot' touches at the start and moves on into what it touches at 0.5 m/s: the motion begins with an "
        "impact.",
    ),
    (
        ["robot.actuators=null", "limits.effort={leg: 5}", "costs={}"],
        "The controls cannot hold the weight at the start: standing still takes 2.16 times their limits "
        "(leg 10.79 N), so the robot sinks.",
    ),
    (
        ["reference={type: jumps, count: 1, apex: {root_z: 0.2}}"],
        "The reference takes contact 'foot' 0.3 m below the ground; one that stays above it is a better start for the "
        "solver.",
    ),
    (
        ["constraints={ball: {type: avoid_sphere, frame: body, center: {x: 1, z: 0.5}, radius: 0.2}}"],
        "The goal itself violates constraint 'ball', distance, by 0.2 m.",
    ),
    (
        ["horizon.intervals=2"],
        "The controls are constant for 0.5 s at a time, which is long for a robot that has to balance; "
        "horizon.intervals of 5 or more make it at most 0.2 s.",
    ),
]


@pytest.mark.parametrize(("overrides", "sentence"), WARNINGS, ids=[sentence[:40] for _, sentence in WARNINGS])
def test_what_is_perhaps_not_meant_is_reported(overrides: list[str], sentence: str) -> None:
    """Each doubtful setting is one warning with its numbers, and there is no other."""
    assert task_warnings(formulate(load_task(ONE_JUMP, overrides))) == [sentence]


QUIET: list[list[str]] = [
    [*FLYING, LINE, "goal.configuration.root_z=0.55"],
    ["initial.velocity={root_z: 0.5}"],
    ["robot.actuators=null", "limits.effort={leg: 11}", "costs={}"],
    ["horizon.intervals=5"],
    ["constraints={ball: {type: avoid_sphere, frame: body, center: {x: 1, z: 0.5}, radius: 0.2}}",
     "goal={periodic: {stride: {root_x: 0.9}}}", "costs={}"],
]  # fmt: skip


@pytest.mark.parametrize("overrides", QUIET, ids=lambda value: value[0][:40])
def test_what_is_just_meant_is_not(overrides: list[str]) -> None:
    """Landing, taking off, just enough force, intervals of 0.2 s and a goal that is free are no reason to warn."""
    assert task_warnings(formulate(load_task(ONE_JUMP, overrides))) == []


@pytest.mark.parametrize("task", sorted((ROOT / "tasks").glob("*.yaml")), ids=lambda path: path.stem)
def test_the_shipped_tasks_are_meant(task: Path) -> None:
    """No ready task has a warning."""
    assert task_warnings(formulate(load_task(task))) == []


def test_warnings_come_first_and_do_not_fail(run: Callable[..., Any], task: Path) -> None:
    """`check` counts its warnings, shows them before all else, and ends with status 0."""
    outcome = run("check", task, "--set", "horizon.intervals=2", "--set", "initial.velocity={root_z: -0.5}")
    assert (outcome.code, outcome.err) == (0, "")
    lines = outcome.out.splitlines()
    assert (
        lines[0] == "published_hopper_one_jump: the task fits its robot; this is what will be solved, with 2 warnings."
    )
    assert lines[2].startswith("Warnings    Contact 'foot' touches at the start and moves on")
    assert max(map(len, lines)) <= 120


def test_the_first_task_of_the_readme_passes(run: Callable[..., Any], tmp_path: Path) -> None:
    """The block in the README, saved among the tasks, is at most ten lines and passes without a warning."""
    (text,) = re.findall(r"```yaml\n(.+?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    assert len(text.splitlines()) <= 10
    shutil.copytree(ROOT / "models", tmp_path / "models")
    (tmp_path / "tasks").mkdir()
    path = tmp_path / "tasks" / "first_hop.yaml"
    path.write_text(text, encoding="utf-8")
    outcome = run("check", path)
    assert (outcome.code, outcome.err) == (0, "")
    assert outcome.out.startswith("first_hop: the task fits its robot; this is what will be solved.\n")
