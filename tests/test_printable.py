"""Hidden characters in names, keys, paths and cells: refused, or escaped where they are shown."""

from __future__ import annotations

from pathlib import Path

import pytest

from fesd_robot.errors import RobotError, TaskError
from fesd_robot.plans.tables import markdown_table
from fesd_robot.printable import has_hidden, visible
from fesd_robot.robot import load_robot
from fesd_robot.task import load_task

HIDDEN = {
    "escape": ("\x1b[31m", "\\x1b[31m"),
    "bell": ("\x07", "\\x07"),
    "NUL": ("\x00", "\\x00"),
    "delete": ("\x7f", "\\x7f"),
    "C1": ("\x9b2J", "\\x9b2J"),
    "end of line": ("\n", "\\n"),
    "carriage return": ("\r", "\\r"),
    "line separator": ("\u2028", "\\u2028"),
    "right to left": ("\u202e", "\\u202e"),
    "isolate": ("\u2066", "\\u2066"),
    "half of a pair": ("\udc80", "\\udc80"),
}


@pytest.mark.parametrize(("character", "shown"), HIDDEN.values(), ids=HIDDEN)
def test_hidden_characters_are_escaped(character: str, shown: str) -> None:
    """What is left can be printed in any encoding that has the rest, and is what it was without them."""
    assert has_hidden(f"a{character}b") and visible(f"a{character}b") == f"a{shown}b"
    assert not has_hidden(visible(f"a{character}b"))


def test_texts_may_have_lines_and_other_scripts() -> None:
    """Neither is hidden; in a name an end of line is."""
    assert not has_hidden("Hüfte 足 π12 שלום | <b>") and has_hidden("a\nb")
    assert visible("first\n\tsecond\x1b", lines=True) == "first\n\tsecond\\x1b"


TASK = "name: a\nrobot: {{model: {model}}}\ncontacts:\n  {contact}: {{frame: {frame}}}\n"


@pytest.mark.parametrize("written", ["\\e[31m", "\\0", "\\x07", "\\u202E", "\\u2028", "\\x9b"])
@pytest.mark.parametrize(("place", "line", "key"), [("model", 2, "robot.model"), ("contact", 3, "contacts"),
                                                    ("frame", 4, "contacts.c.frame")])  # fmt: skip
def test_names_of_a_task_have_none(tmp_path: Path, written: str, place: str, line: int, key: str) -> None:
    """A key or a value with one is an error at its place, in which it is escaped."""
    values = {"model": "r.urdf", "contact": "c", "frame": "f", place: f'"x{written}y"'}
    file = tmp_path / "task.yaml"
    file.write_text(TASK.format(**values), encoding="utf-8")
    with pytest.raises(TaskError) as caught:
        load_task(file)
    assert (caught.value.line, caught.value.key) == (line, key)
    assert "without control characters" in str(caught.value) and not has_hidden(str(caught.value))


URDF = """<robot name="r"><link name="base"/><link name="{link}"><inertial><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="{joint}" type="prismatic"><parent link="base"/><child link="{link}"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>"""


@pytest.mark.parametrize("reference", ["&#x202e;", "&#10;", "&#x85;", "&#x2028;"])
@pytest.mark.parametrize("what", ["link", "joint"])
def test_names_of_a_robot_have_none(tmp_path: Path, reference: str, what: str) -> None:
    """XML allows some; the error names the file and the name, escaped."""
    file = tmp_path / "robot.urdf"
    file.write_text(URDF.format(**{"link": "l", "joint": "j", what: f"x{reference}y"}), encoding="utf-8")
    with pytest.raises(RobotError) as caught:
        load_robot(file)
    assert str(file) in str(caught.value) and not has_hidden(str(caught.value))


def test_names_in_a_table_stay_in_their_cells() -> None:
    """A bar, a tag and an end of line in a name make no cell, no element and no row."""
    table = markdown_table(["name"], [["a|b"], ["<img src=x>"], ["c\nd"]])
    assert table == "| name |\n| --- |\n| a\\|b |\n| &lt;img src=x> |\n| c\\nd |\n"
