"""The robot section: what may stand beside what, and addresses of models."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fesd_robot.errors import TaskError
from fesd_robot.task import load_task

Write = Callable[[str], Path]

ARMATURE = "  armature: {leg: 0.1}\n"

# (lines in place of the armature, line, key, fragments of the message)
CONFLICTS: list[tuple[str, int, str, list[str]]] = [
    ("  passive: [leg]\n", 5, "robot.passive", ["beside 'actuators'", "one of them"]),
    ("  coupled: {a: a}\n", 5, "robot.coupled.a", ["coupled to itself"]),
    ("  coupled: {a: b}\n  locked: {b: 1}\n", 5, "robot.coupled.a", ["joint 'b', which is locked"]),
    ("  locked: {a: 1}\n  coupled: {a: b}\n", 6, "robot.coupled.a", ["joint 'a', which is locked"]),
    ("  locked: [a]\n", 5, "robot.locked", ["found the list", "a mapping of names to values"]),
    ("  locked: {a: .inf}\n", 5, "robot.locked.a", ["a finite number"]),
    ("  coupled: {a: 1}\n", 5, "robot.coupled.a", ["found 1, expected text"]),
    ("  damping: {leg: -0.1}\n", 5, "robot.damping.leg", ["found -0.1", "at least 0"]),
    ("  pasive: [leg]\n", 5, "robot.pasive", ["did you mean 'passive'?"]),
]


@pytest.mark.parametrize(("lines", "line", "key", "fragments"), CONFLICTS, ids=lambda value: str(value)[:30])
def test_keys_that_do_not_fit_are_located(
    base: str, write: Write, lines: str, line: int, key: str, fragments: list[str]
) -> None:
    """One wrong key is one error with its line, what was found and what was expected."""
    assert ARMATURE in base
    with pytest.raises(TaskError) as caught:
        load_task(write(base.replace(ARMATURE, lines)))
    assert (caught.value.line, caught.value.key) == (line, key), str(caught.value)
    for fragment in fragments:
        assert fragment in caught.value.message


def test_a_model_in_a_package_is_handed_on(base: str, write: Write) -> None:
    """Which folders hold packages is for the robot to find out."""
    task = load_task(write(base), ["robot.model=package://my_robot/urdf/my.urdf"])
    assert task.locate_model() == "package://my_robot/urdf/my.urdf"


@pytest.mark.parametrize("model", ["~/hopper.urdf", "$HOME/hopper.urdf"])
def test_home_and_variables_are_not_expanded(base: str, write: Write, model: str) -> None:
    """A task means the same for everyone, and the error says so."""
    with pytest.raises(TaskError, match="are taken literally"):
        load_task(write(base), [f"robot.model={model}"]).locate_model()


def test_the_model_does_not_depend_on_the_working_folder(
    base: str, write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A task given by a relative path finds its model once, not twice below its folder."""
    path = write(base)
    path.with_name("hopper.urdf").touch()
    monkeypatch.chdir(path.parent.parent)
    assert load_task(Path(path.parent.name) / path.name).locate_model() == path.with_name("hopper.urdf")
