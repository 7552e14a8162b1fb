"""Tables of plans: rows come from a sweep, stay in a data file, and the page is drawn from that."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from scripts.tools import table as tables
from scripts.tools.table import REMARKS, Row, Table, settings_of
from tests.sweeps.stubs import named

TASKS = ["ball_bat", "block_push", "hopper_one_jump"]


def drawn(rows: list[Row]) -> str:
    """Return a page with a line a row."""
    return "\n".join(f"{row['task']} {row['case']} {row['name']} {row['program']}" for row in rows)


@pytest.fixture
def table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Table:
    """A table over three tasks and two cases, with a stub for plans."""
    monkeypatch.setattr(tables, "_program_now", lambda task: "abc")
    monkeypatch.setattr(Table, "folder", tmp_path / "sweep")
    told: dict[str, Any] = {
        "vary": {"task": TASKS},
        "cases": {"plain": {"solver.seed": 0}, "other": {"solver.seed": 1}},
    }
    return Table(tmp_path / "page.md", told, drawn, named, {"name": str})


def test_rows_of_other_tasks_stay(table: Table) -> None:
    """Tasks that are named are planned, in all cases; the others keep their rows, in the order of the sweep."""
    first = table.main("Test.", ["block_push", "--jobs", "1"])
    assert [(row["task"], row["case"], row["verdict"]) for row in first] == [
        ("block_push", "plain", "solved"), ("block_push", "other", "solved"),
    ]  # fmt: skip
    table.main("Test.", ["ball_bat", "--jobs", "1", "--set", "solver.effort=quick"])
    lines = [f"{task} {case} {task} abc" for task in ("ball_bat", "block_push") for case in ("plain", "other")]
    assert table.page.read_text().splitlines() == lines
    made = [row["made"] for row in json.loads(table.page.with_suffix(".json").read_text())]
    assert made == ["solver.effort=quick"] * 2 + [""] * 2


def test_a_page_is_drawn_from_its_data_alone(table: Table) -> None:
    """What is changed in the data file is on the page; remarks stay; rows of a task that is gone do not."""
    rows = [{"task": name, "case": "plain", "name": "x", "verdict": "solved", "program": "old"} for name in TASKS]
    table.page.with_suffix(".json").write_text(json.dumps([*rows, {**rows[0], "task": "gone"}]))
    table.page.write_text(f"before\n{REMARKS}\nA remark.\n")
    assert len(table.main("Test.", ["--redraw"])) == 3
    assert table.page.read_text() == "\n".join(f"{name} plain x old" for name in TASKS) + f"\n\n{REMARKS}\nA remark.\n"
    assert table.program({"task": "ball_bat", "program": "old"}) == "old, older"
    assert table.program({"task": "ball_bat", "program": "abc"}) == "abc"


def test_an_unknown_name_is_refused(table: Table, capsys: pytest.CaptureFixture[str]) -> None:
    """The names there are end the sentence, and nothing is written."""
    with pytest.raises(SystemExit):
        table.main("Test.", ["bal_bat"])
    assert "found 'bal_bat', expected one of ball_bat, block_push, hopper_one_jump" in capsys.readouterr().err
    assert not table.page.exists()


def test_settings_are_values() -> None:
    """Words of the command line become numbers, texts and lists, as in a task."""
    words = ["a.b=0.5", "c=quick", "d=[1, {e: 2}]", "f=true"]
    assert settings_of(words) == {"a.b": 0.5, "c": "quick", "d": [1, {"e": 2}], "f": True}
