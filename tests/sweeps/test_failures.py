"""A plan that crashes, hangs, eats memory or is refused is a row, and so are all others."""

from __future__ import annotations

import time
from pathlib import Path

import psutil

from fesd_robot.sweeps import SweepSettings, load_sweep, read_sweep, swept
from tests.sweeps.stubs import fragile, parabola


def sweep_of(count: int) -> object:
    return load_sweep(
        {"task": "hopper_one_jump", "vary": {"goal.configuration.root_x": {"range": [0.9, 1.1], "count": count}}}
    )


def test_every_failure_is_a_row(tmp_path: Path) -> None:
    """Rows around those that fail are as if nothing had happened, and none of the processes is left."""
    settings = SweepSettings(jobs=2, timeout=3.0, memory=700.0, keep="none")
    table = swept(sweep_of(16), tmp_path / "out", settings, fragile)  # type: ignore[arg-type]
    expected = ["solved", "crashed", "crashed", "timeout", "memory", "error", "refused", "solved"] * 2
    assert table.columns["verdict"] == expected
    states = ["completed" if verdict == "solved" else "failed" for verdict in expected]
    assert table.columns["state"] == states
    messages = table.columns["message"]
    assert "SIGSEGV" in messages[1]
    assert messages[2] == "its process ended with status 7"
    assert messages[3] == "it did not end within its time limit of 3 s"
    assert "more than 700 MB" in messages[4]
    assert messages[5] == "ZeroDivisionError: a mistake in two lines"
    assert messages[6] == "found nothing, expected something"
    assert all(
        memory > 10.0 for memory, verdict in zip(table.columns["memory"], expected, strict=True) if verdict == "solved"
    )
    time.sleep(0.2)
    assert not [each for each in psutil.Process().children(recursive=True) if each.name() == "plan"]


def test_failed_rows_are_planned_again_when_asked_for(tmp_path: Path) -> None:
    """--resume leaves them, --retry-failed does them again, each row once in the end."""
    sweep, first = sweep_of(8), SweepSettings(jobs=2, timeout=3.0, memory=700.0, keep="none")
    swept(sweep, tmp_path / "out", first, fragile)  # type: ignore[arg-type]
    untouched = swept(sweep, tmp_path / "out", SweepSettings(jobs=2, resume=True, keep="none"), parabola)  # type: ignore[arg-type]
    assert untouched.columns["verdict"].count("solved") == 2
    again = swept(sweep, tmp_path / "out", SweepSettings(jobs=2, retry_failed=True, keep="none"), parabola)  # type: ignore[arg-type]
    assert again.columns["verdict"] == ["solved"] * 8
    assert again.columns["number"] == list(range(8))
    assert read_sweep(tmp_path / "out").columns == again.columns
