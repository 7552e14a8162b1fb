"""The table of export formats: what the program, its help, the README and a folder of results derive from it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from fesd_robot.cli.export import format_names
from fesd_robot.plans import EXPORTS, Plan, PlanFileError, export

README = Path(__file__).parents[2] / "README.md"


@pytest.mark.parametrize("name", EXPORTS)
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
    assert export(plan, "joint-trajectory", joints=["leg"]).startswith(b"header:")


def test_the_readme_and_the_completion_name_every_format() -> None:
    """The README lists the formats as they are, and so does the completion of a command line."""
    (listed,) = re.findall(r"export PLAN --format ([\w|-]+)", README.read_text(encoding="utf-8"))
    assert listed.split("|") == format_names() == list(EXPORTS)


def test_a_format_that_is_not_there(plan: Plan) -> None:
    """An unknown format ends with the formats there are, joints for a fixed one with the formats that take them."""
    with pytest.raises(PlanFileError, match=r"found format 'xml', expected one of csv, npz, json, joint-trajectory"):
        export(plan, "xml")
    with pytest.raises(PlanFileError, match=r"found joints for format 'csv', .*; expected joint-trajectory"):
        export(plan, "csv", joints=["leg"])
