"""The table of export formats: what the program, its help, its pages and a folder of results derive from it."""

from __future__ import annotations

import io
import json
import re
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.actions import exported
from fesd_robot.cli.export import format_names
from fesd_robot.errors import TaskError
from fesd_robot.plans import EXPORTS, Plan, PlanFileError, export
from fesd_robot.plans.columns import CONTROL_CONVENTION, columns_of, control_interval

COMMANDS = Path(__file__).parents[2] / "docs" / "commands.md"


WITHOUT_MODEL = [name for name, each in EXPORTS.items() if not (each.model or each.gains)]
"""Formats that need nothing but the plan; the others are read back in `test_readers.py` and `tests/tracking`."""


@pytest.mark.parametrize("name", WITHOUT_MODEL)
def test_every_format_writes_its_files(plan: Plan, name: str) -> None:
    """A format is listed under its name, says what it holds, and writes something for each of its suffixes."""
    each = EXPORTS[name]
    joints = ["leg"] if each.joints else None
    assert each.name == name and each.content and each.file.startswith(each.stem)
    for suffix in each.writers:
        assert export(plan, name, joints=joints, suffix=suffix)
    assert export(plan, name, joints=joints, suffix=".txt") == export(plan, name, joints=joints)


def test_usual_files_do_not_collide() -> None:
    """No two formats have the same usual file, so that all can lie beside one plan."""
    assert len({each.file for each in EXPORTS.values()}) == len(EXPORTS)


def test_the_suffix_chooses_the_writing(plan: Plan) -> None:
    """A joint trajectory is YAML, or JSON with the same content."""
    text = export(plan, "joint-trajectory", joints=["leg"], suffix=".json")
    assert json.loads(text)["joint_names"] == ["leg"]
    assert b"\nheader:" in export(plan, "joint-trajectory", joints=["leg"])


def test_every_table_says_how_all_joints_move(plan: Plan) -> None:
    """The archive of arrays and the JSON file hold the joints of the model file as the CSV file does."""
    columns, archive = columns_of(plan), np.load(io.BytesIO(export(plan, "npz")))
    content = json.loads(export(plan, "json"))
    assert list(archive["joint_names"]) == ["root_x", "root_z", "root_pitch", "leg"]
    assert archive["joint_effort"][:, 3].tolist() == content["columns"]["joint leg effort [N]"]
    np.testing.assert_array_equal(archive["joint_velocity"][:, 2], columns["joint root_pitch velocity [rad/s]"])
    assert content["controls"] == CONTROL_CONVENTION
    held = archive["control"][archive["control_interval"]]
    np.testing.assert_array_equal(held[:, 1], columns["leg_force [N]"])


def test_a_plan_that_does_not_say_how_all_joints_move(plan: Plan) -> None:
    """The tables of a plan of an earlier version hold its own coordinates; `export_plan` adds what is missing."""
    folder = Path(__file__).parents[2] / "tasks"
    old = plan.model_copy(
        update={"full_model": None, "provenance": plan.provenance.model_copy(update={"folder": str(folder)})}
    )
    assert not any(name.startswith("joint ") for name in columns_of(old))
    for kind in WITHOUT_MODEL:
        assert exported(old, kind) == export(plan, kind)


def test_a_plan_of_an_earlier_version_whose_robot_is_gone(plan: Plan, caplog: pytest.LogCaptureFixture) -> None:
    """Its tables hold its own coordinates, with a warning that names the file; a joint trajectory cannot be written."""
    nowhere = plan.provenance.model_copy(update={"folder": "/nowhere/tasks"})
    old = plan.model_copy(update={"full_model": None, "provenance": nowhere})
    assert exported(old, "csv") == export(old, "csv")
    (record,) = caplog.records
    assert "all joints of the model file are left out" in record.getMessage() and "/nowhere/" in record.getMessage()
    with pytest.raises(TaskError, match="/nowhere/"):
        exported(old, "joint-trajectory")


@pytest.mark.parametrize(
    ("time", "expected"),
    [
        ([0.0, 0.05, 0.1, 0.15, 0.2], [0, 0, 0, 1, 1]),
        ([0.0, 0.1, 0.1, 0.2, 0.2], [0, 0, 1, 1, 1]),
        ([0.0, 0.0, 0.1 + 1e-10, 0.15, 0.2], [0, 0, 0, 1, 1]),
        ([0.0, 0.05, 0.05, 0.1 - 1e-10, 0.2], [0, 0, 0, 0, 1]),
    ],
)
def test_which_controls_a_sample_has(plan: Plan, time: list[float], expected: list[int]) -> None:
    """At an interval's end they are those that end there, after an impact those that act from then on."""
    trajectory = plan.trajectory.model_copy(update={"time": np.array(time)})
    controls = {**plan.controls, "time": np.array([0.0, 0.1])}
    at = plan.model_copy(update={"trajectory": trajectory, "controls": controls})
    assert control_interval(at).tolist() == expected


def test_the_page_and_the_completion_name_every_format() -> None:
    """The page of commands lists the formats as they are, and so does the completion of a command line."""
    (listed,) = re.findall(r"export PLAN --format ([\w|-]+)", COMMANDS.read_text(encoding="utf-8"))
    assert listed.split("|") == format_names() == list(EXPORTS)


def test_a_format_that_is_not_there(plan: Plan) -> None:
    """An unknown format ends with the formats there are, joints for a fixed one with the formats that take them."""
    with pytest.raises(PlanFileError, match=r"found format 'xml', expected one of csv, npz, json, joint-trajectory"):
        export(plan, "xml")
    with pytest.raises(PlanFileError, match=r"found joints for format 'csv', .*; expected joint-trajectory"):
        export(plan, "csv", joints=["leg"])
