"""Tasks and tables beyond a size: refused in a sentence before they fill the memory."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fesd_robot.errors import MotionFileError, TaskError
from fesd_robot.ocp import columns_of_csv, formulate
from fesd_robot.ranges import MAX_TABLE_BYTES, MAX_TASK_BYTES, MAX_VARIABLES
from fesd_robot.task import Task, load_task


def test_a_huge_task_file_is_refused(tmp_path: Path) -> None:
    """Not more of it than the limit is read."""
    file = tmp_path / "task.yaml"
    with file.open("wb") as stream:
        stream.truncate(100 * MAX_TASK_BYTES)
    with pytest.raises(TaskError, match=r"task.yaml: found a file of more than 0.3 MB, expected a task file"):
        load_task(file)
    with pytest.raises(TaskError, match="found a file of more than"):
        load_task("/dev/zero")


def test_a_huge_table_is_refused(tmp_path: Path) -> None:
    """As of controls, or a motion."""
    with (tmp_path / "controls.csv").open("wb") as stream:
        stream.truncate(MAX_TABLE_BYTES + 1_000_000)
    with pytest.raises(MotionFileError, match="found 21 MB, expected at most 20 MB"):
        columns_of_csv(tmp_path / "controls.csv")


@pytest.mark.parametrize("grid", ["phases", "uniform"])
def test_more_intervals_than_fit_into_memory_are_refused(load_short: Callable[..., Task], grid: str) -> None:
    """The sentence says how many may be asked for, and with these the problem is formulated."""
    task = load_short("horizon.intervals=10000", f"method.grid={grid}", "horizon.duration=5")
    with pytest.raises(TaskError) as caught:
        formulate(task)
    assert caught.value.key == "horizon.intervals" and "found 10000 intervals of" in str(caught.value)
    most = int(str(caught.value).split("expected at most ")[1].split()[0])
    assert most < 10000 and most * (MAX_VARIABLES // most) <= MAX_VARIABLES
    assert formulate(load_short(f"horizon.intervals={most}", f"method.grid={grid}", "horizon.duration=5")).ocp.intervals
