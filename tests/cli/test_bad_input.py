"""Every kind of bad input ends the real command with status 2, one message and nothing written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

# (text in the task, its replacement, words whose line is to be blamed, key, fragments of the message)
EDITS: list[tuple[str, str, str, str, list[str]]] = [
    ("  intervals: 20", "  interval: 20", "interval: 20", "horizon.interval", ["unknown key", "'intervals'"]),
    ("duration: 1 ", "duration: fast ", "duration", "horizon.duration", ["found the text 'fast'", "a number"]),
    ("duration: 1 ", "duration: -1 ", "duration", "horizon.duration", ["found -1", "greater than 0"]),
    ("intervals: 20", "intervals: 0", "intervals", "horizon.intervals", ["found 0", "at least 1"]),
    ("intervals: 20", "intervals: -3", "intervals", "horizon.intervals", ["found -3", "at least 1"]),
    ("intervals: 20", "intervals: 2.5", "intervals", "horizon.intervals", ["found 2.5", "a whole number"]),
    ("root_x: 1.0", "root_x: .nan", ".nan", "goal.configuration.root_x", ["found NaN", "a finite number"]),
    ("{reaction_torque: 0.01", "{reaction_torque: .nan", ".nan", "costs.control.reaction_torque", ["found NaN"]),
    ("joint: root_pitch", "joint: root_pich", "root_pich", "robot.actuators.reaction_torque.joint", ["'root_pitch'"]),
    ("    leg: 0.1 # the", "    legg: 0.1 # the", "legg:", "robot.armature.legg", ["a joint", "did you mean 'leg'?"]),
    ("root_z: 0.5", "root_zz: 0.5", "root_zz", "initial.configuration.root_zz", ["did you mean 'root_z'?"]),
    ("frame: foot", "frame: foott", "foott", "contacts.foot.frame", ["a frame", "did you mean 'foot'?"]),
    ("hopper.urdf", "hoper.urdf", "hoper.urdf", "robot.model", ["there is no file", "hoper.urdf"]),
    (
        "root_z: 0.5",
        "root_z: 0.3",
        "configuration:",
        "initial.configuration",
        ["contact 'foot' 0.2 m below the ground"],
    ),
    ("root_z: 0.5", "root_z: 1.6", "root_z: 1.6", "initial.configuration.root_z", ["found 1.6", "[0, 1.5]"]),
    ("root_x: 1.0", "root_x: 1.2", "root_x: 1.2", "goal.configuration.root_x", ["found 1.2", "limits.position"]),
]


@pytest.mark.parametrize("command", ["plan", "check"])
@pytest.mark.parametrize(("old", "new", "blamed", "key", "fragments"), EDITS, ids=lambda value: str(value)[:25])
def test_a_mistake_in_the_task_names_file_line_and_key(
    run: Callable[..., Any],
    task_text: str,
    tmp_path: Path,
    command: str,
    old: str,
    new: str,
    blamed: str,
    key: str,
    fragments: list[str],
) -> None:
    """One sentence on stderr begins with file, line and key, and says what was found and what was expected."""
    assert old in task_text
    text = task_text.replace(old, new, 1)
    path = tmp_path / "task.yaml"
    path.write_text(text, encoding="utf-8")
    start = text.index("\ninitial:") if key.startswith("initial") else 0
    line = text.count("\n", 0, text.index(blamed, start)) + 1
    outcome = run(command, path)
    _assert_refused(outcome, tmp_path)
    assert outcome.err.startswith(f"error: {path}:{line}: {key}: ")
    for fragment in fragments:
        assert fragment in outcome.err


def test_an_unknown_example_robot_names_the_nearest(run: Callable[..., Any], task_text: str, tmp_path: Path) -> None:
    """A robot that the package example-robot-data does not have is a mistake in robot.model."""
    path = tmp_path / "task.yaml"
    lines = [
        "  model: example-robot-data:tallos" if line.startswith("  model:") else line for line in task_text.splitlines()
    ]
    path.write_text("\n".join(lines), encoding="utf-8")
    outcome = run("plan", path)
    _assert_refused(outcome, tmp_path)
    assert outcome.err.startswith(
        f"error: {path}:{lines.index('  model: example-robot-data:tallos') + 1}: robot.model: "
    )
    assert "did you mean 'talos'?" in outcome.err


def test_a_missing_task_file_is_named(run: Callable[..., Any], tmp_path: Path) -> None:
    """The message names the file that is not there."""
    outcome = run("plan", "none.yaml")
    _assert_refused(outcome, tmp_path)
    assert outcome.err.startswith("error: none.yaml: there is no such file")


def test_a_bad_override_is_quoted(run: Callable[..., Any], task: Path, tmp_path: Path) -> None:
    """A mistake on the command line is blamed on the command line."""
    outcome = run("plan", task, "--set", "horizon.interval=3")
    _assert_refused(outcome, tmp_path)
    assert "--set horizon.interval=3" in outcome.err and "'intervals'" in outcome.err


@pytest.mark.parametrize("content", [None, "{", "{}", '{"schema_version": 99}'])
def test_a_report_of_what_is_no_plan_is_refused(run: Callable[..., Any], tmp_path: Path, content: str | None) -> None:
    """A missing, broken or foreign plan.json is one message that names the file."""
    path = tmp_path / "plan.json"
    if content is not None:
        path.write_text(content, encoding="utf-8")
    outcome = run("report", path)
    _assert_refused(outcome, tmp_path)
    assert str(path) in outcome.err


def _assert_refused(outcome: Any, folder: Path) -> None:
    """Exit status 2, nothing on stdout, one line without traceback on stderr, nothing written."""
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err.count("\n") == 1 and "Traceback" not in outcome.err
    assert not list((folder / "work").iterdir())
