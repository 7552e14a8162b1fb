"""What the program's commands do, done from Python: explained, drawn, exported."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from fesd_robot import PlanFileError, TaskError, explain, export_plan, render_plan
from fesd_robot.plans import EXPORTS, Plan, export
from fesd_robot.task import Task


def test_an_explanation_has_all_sections(short_task: Task) -> None:
    """It says what will be solved, from the robot to the size of the problem."""
    text = explain(short_task)
    assert text.startswith("published_hopper_one_jump: the task fits its robot")
    for label in ("Robot", "Controls", "Ground", "Contacts", "Horizon", "Goal", "Costs", "Problem"):
        assert f"\n{label} " in text


def test_drawings_are_written(short_plan: Plan, tmp_path: Path) -> None:
    """The page comes first, then the figures, all in the folder."""
    page, *figures = render_plan(short_plan, str(tmp_path))
    assert page == tmp_path / "plan.html" and page.stat().st_size > 1e5
    assert figures and all(file.parent == tmp_path / "figures" and file.stat().st_size > 1e3 for file in figures)


def test_a_task_that_has_moved_cannot_be_drawn(short_plan: Plan, tmp_path: Path) -> None:
    """Without the robot's model there is no page; the message names the key."""
    with pytest.raises(TaskError, match=r"robot\.model"):
        render_plan(short_plan, tmp_path, task_folder=tmp_path)


PLAIN = [kind for kind, each in EXPORTS.items() if kind != "npz" and not (each.model or each.gains)]
"""Formats of which a file holds neither the time of its writing nor the motion of the model, which is read for it."""


@pytest.mark.parametrize("kind", EXPORTS)
def test_the_ending_chooses_the_format(short_plan: Plan, tmp_path: Path, kind: str) -> None:
    """The usual name of every format is enough to get it."""
    joints = ["leg"] if EXPORTS[kind].joints else None
    file = export_plan(short_plan, tmp_path / EXPORTS[kind].file, joints=joints)
    if kind in PLAIN:
        assert file.read_bytes() == export(short_plan, kind, joints=joints)
    assert file == tmp_path / EXPORTS[kind].file and file.stat().st_size > 100


def test_a_named_format_goes_into_any_file(short_plan: Plan, tmp_path: Path) -> None:
    """A ROS message is JSON in a file that ends so."""
    file = export_plan(short_plan, tmp_path / "new" / "message.json", "joint-trajectory", joints=["leg"])
    assert json.loads(file.read_text(encoding="utf-8"))["joint_names"] == ["leg"]


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("hop.cvs", {}, r"hop\.cvs: found the ending '\.cvs', expected one of .*did you mean '\.csv'"),
        ("hop", {"kind": "cvs"}, r"found format 'cvs', expected one of .*did you mean 'csv'"),
        ("hop.csv", {"joints": ["leg"]}, "found joints for format 'csv'"),
        (".", {}, "is a folder, expected the name of a file"),
    ],
)
def test_what_cannot_be_exported(
    short_plan: Plan, tmp_path: Path, name: str, options: dict[str, Any], message: str
) -> None:
    """The error names what was found and what there is, and nothing is written."""
    with pytest.raises(PlanFileError, match=message):
        export_plan(short_plan, tmp_path / name, **options)
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_the_way_is_an_error(short_plan: Plan, tmp_path: Path) -> None:
    """Where no folder can be, neither a table nor a page can be written."""
    (tmp_path / "taken").write_text("", encoding="utf-8")
    with pytest.raises(PlanFileError, match="cannot be written"):
        export_plan(short_plan, tmp_path / "taken" / "hop.csv")
    with pytest.raises(PlanFileError, match="cannot be written"):
        render_plan(short_plan, tmp_path / "taken")
