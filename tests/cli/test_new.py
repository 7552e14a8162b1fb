"""`fesd-robot new`: a task that `check` takes, and no file of the user's lost."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

HOPPER = Path(__file__).parents[2] / "models" / "hopper" / "hopper.urdf"


def test_the_new_task_can_be_checked(run: Callable[..., Any]) -> None:
    """It is called after the robot, and what comes next is said; the line for editors leads to the schema."""
    outcome = run("new", HOPPER)
    assert outcome.code == 0 and "written: hopper_first_jump.yaml" in outcome.out
    text = Path("hopper_first_jump.yaml").read_text(encoding="utf-8")
    schema = text.splitlines()[0].partition("$schema=")[2]
    assert (Path().absolute() / schema).is_file()
    outcome = run("check", "hopper_first_jump.yaml")
    assert outcome.code == 0 and "Warnings" not in outcome.out


def test_a_file_is_not_replaced_unasked(run: Callable[..., Any]) -> None:
    """Exit status 2 and the file as it was; with --force it is the new task."""
    Path("mine.yaml").write_text("mine", encoding="utf-8")
    outcome = run("new", HOPPER, "--out", "mine.yaml")
    assert outcome.code == 2 and "mine.yaml: this file exists" in outcome.err
    assert Path("mine.yaml").read_text(encoding="utf-8") == "mine" and len(list(Path().iterdir())) == 1
    assert run("new", HOPPER, "--out", "mine.yaml", "--force").code == 0


@pytest.mark.parametrize(
    ("robot", "said"),
    [
        ("nowhere.urdf", "There is no robot file nowhere.urdf"),
        ("solo13", "did you mean 'solo12'?"),
    ],
)
def test_an_unknown_robot_is_named(run: Callable[..., Any], robot: str, said: str) -> None:
    """A missing file, and a name that example-robot-data does not have."""
    outcome = run("new", robot)
    assert outcome.code == 2 and said in outcome.err and not list(Path().iterdir())
