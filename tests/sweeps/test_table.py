"""The table of a sweep: what is in it, and who can read it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fesd_robot.sweeps import SweepSettings, SweepTable, Tally, load_sweep, read_sweep, swept
from tests.sweeps.stubs import alone_only, named, noted, parabola

SWEEP = {
    "task": "hopper_one_jump",
    "vary": {"goal.configuration.root_x": [0.9, 1.0, 1.2], "ground.friction": [0.4, 0.5]},
}


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> SweepTable:
    """A small sweep."""
    return swept(load_sweep(SWEEP), tmp_path_factory.mktemp("sweep") / "out", SweepSettings(jobs=2), parabola)


def test_rows_have_inputs_identity_and_results(table: SweepTable) -> None:
    """Every row says what it is of, what came of it, and where its plan is."""
    assert len(table) == 6
    assert table.columns["goal.configuration.root_x"] == [0.9, 0.9, 1.0, 1.0, 1.2, 1.2]
    assert table.columns["cost"] == [(x - 1.0) ** 2 for x in table.columns["goal.configuration.root_x"]]
    assert table.columns["end.root_x"] == table.columns["cost"]
    assert len(set(table.columns["identity"])) == 6
    for row in table.rows():
        content = (table.folder / row["plan"] / "plan.json").read_text()
        assert float(content) == row["goal.configuration.root_x"]


def test_identity_is_of_task_values_and_version(table: SweepTable, tmp_path: Path) -> None:
    """The same sweep elsewhere has the same identities, another value another one."""
    again = swept(load_sweep(SWEEP), tmp_path / "again", SweepSettings(jobs=1), parabola)
    assert again.columns["identity"] == table.columns["identity"]
    other = swept(
        load_sweep({**SWEEP, "set": {"horizon.intervals": 21}}), tmp_path / "other", SweepSettings(), parabola
    )
    assert not set(other.columns["identity"]) & set(table.columns["identity"])


def test_several_tasks_and_cases_are_a_table(tmp_path: Path) -> None:
    """Each row is planned with its task's file and its case's keys; ends are of all robots; measures have columns."""
    cases = {"plain": {"solver.effort": "quick"}, "wet": {"ground.friction": 0.3}}
    told = {"vary": {"task": ["hopper_one_jump", "block_push"]}, "cases": cases}
    measures = {"name": str, "first": str}
    table = swept(load_sweep(told), tmp_path / "out", SweepSettings(jobs=1), named, measures=measures)
    assert table.columns["task"] == table.columns["name"] == ["hopper_one_jump"] * 2 + ["block_push"] * 2
    assert table.columns["case"] == ["plain", "wet"] * 2
    assert table.columns["first"] == ['solver.effort="quick"', "ground.friction=0.3"] * 2
    assert {"end.leg", "end.root_x"} <= set(table.columns)
    assert read_sweep(tmp_path / "out").columns == table.columns


def test_parquet_holds_the_same(table: SweepTable) -> None:
    """Parquet and CSV have the same rows."""
    parquet = pytest.importorskip("pyarrow.parquet")
    read = parquet.read_table(table.folder / "rows.parquet").to_pylist()
    known = {row["number"]: row for row in read_sweep(table.folder).rows()}
    assert {row["number"]: row for row in read} == known


def test_libraries_read_it(table: SweepTable) -> None:
    """pandas and Polars read the columns, and the file."""
    pandas = pytest.importorskip("pandas")
    polars = pytest.importorskip("polars")
    assert pandas.DataFrame(table.columns)["cost"].tolist() == table.columns["cost"]
    assert polars.DataFrame(table.columns)["cost"].to_list() == table.columns["cost"]
    assert polars.DataFrame(table)["cost"].to_list() == table.columns["cost"]
    assert sorted(pandas.read_csv(table.folder / "rows.csv")["number"]) == list(range(6))


@pytest.mark.parametrize(("keep", "count"), [("all", 6), ("solved", 6), ("best", 1), ("none", 0)])
def test_plans_that_are_kept(tmp_path: Path, keep: str, count: int) -> None:
    """The table names the folders that are there, of the best the cheapest row's."""
    table = swept(load_sweep(SWEEP), tmp_path / "out", SweepSettings(jobs=2, keep=keep), parabola)
    plans = [plan for plan in table.columns["plan"] if plan]
    assert len(plans) == count == len(list((tmp_path / "out").rglob("plan.json")))
    assert all((tmp_path / "out" / plan / "plan.json").is_file() for plan in plans)
    if keep == "best":
        best = min(table.rows(), key=lambda row: (row["cost"], row["plan"] == ""))
        assert best["plan"] == plans[0]


def test_progress_is_told(tmp_path: Path) -> None:
    """Rate, failures and time left are in a line; in the end all rows are counted."""
    lines: list[str] = []

    def told(tally: Tally) -> None:
        lines.append(tally.line())

    swept(load_sweep(SWEEP), tmp_path / "out", SweepSettings(jobs=1), parabola, told)
    assert lines[-1].startswith("6 of 6, ") and lines[-1].endswith("6 solved")
    assert any("left" in line for line in lines[:-1]) or len(lines) < 3


def test_neighbours_begin_from_the_nearest_solved_row(tmp_path: Path) -> None:
    """The middle row begins alone, every other one from a neighbour that was solved before."""
    own = {**SWEEP, "warm": "nearest", "vary": {"goal.configuration.root_x": [0.8, 0.9, 1.0, 1.1, 1.2]}}
    table = swept(load_sweep(own), tmp_path / "out", SweepSettings(jobs=1), noted)
    begun = table.columns["start"]
    assert begun[2] is None
    assert sorted(zip([0, 1, 3, 4], [begun[at] for at in (0, 1, 3, 4)], strict=True)) == [
        (0, 1),
        (1, 2),
        (3, 2),
        (4, 3),
    ]


def test_a_row_that_fails_from_its_neighbour_is_planned_alone(tmp_path: Path) -> None:
    """A process that ends where it begins from another row costs no row: its task follows, and the row says so."""
    own = {**SWEEP, "warm": "nearest", "vary": {"goal.configuration.root_x": [0.8, 0.9, 1.0, 1.1, 1.2]}}
    table = swept(load_sweep(own), tmp_path / "out", SweepSettings(jobs=1), alone_only)
    assert table.columns["verdict"] == ["solved"] * 5 and table.columns["start"] == [None] * 5
    assert [row is None for row in table.columns["abandoned"]] == [False, False, True, False, False]
    assert "did so in vain" in (tmp_path / "out" / "sweep.html").read_text()


def test_the_record_is_plain(table: SweepTable) -> None:
    """sweep.json has the sweep as it was written."""
    record = json.loads((table.folder / "sweep.json").read_text())
    assert record["sweep"] == SWEEP
    assert record["total"] == 6
