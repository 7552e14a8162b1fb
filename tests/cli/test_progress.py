"""What is shown during a solve, on a terminal and elsewhere."""

from __future__ import annotations

import io
from typing import NamedTuple

import pytest
from rich.console import Console

from fesd_robot.cli.progress import REFRESH_SECONDS, LiveProgress, PlainProgress, Progress, progress_for
from fesd_robot.mpcc import NlpStatus


class Residuals(NamedTuple):
    """The residuals that a row shows."""

    objective: float = 12.5
    complementarity: float = 3e-4
    constraint_violation: float = 2e-9


class Report(NamedTuple):
    """An NLP as the homotopy reports it."""

    sigma: float = 1e-3
    velocity_level_sigma: float = 0.5
    status: NlpStatus = NlpStatus.CONVERGED
    iterations: int = 57
    seconds: float = 4.2
    residuals: Residuals = Residuals()


ROW = ["1e-03", "5e-01", "converged", "57", "12.5", "3.0e-04", "2.0e-09", "4.2"]


def test_plain_progress_is_one_line_per_nlp(capsys: pytest.CaptureFixture[str]) -> None:
    """A header and aligned rows, nothing for iterations."""
    with PlainProgress() as progress:
        progress.iteration(1, 3.0)
        progress.nlp(Report())  # type: ignore[arg-type]
    header, row = capsys.readouterr().out.splitlines()
    assert row.split() == ROW
    assert len(header) == len(row)


def test_live_progress_shows_table_and_iteration(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a terminal the running iteration stands below the table, and is gone at the end."""
    screen = io.StringIO()
    progress = LiveProgress(Console(file=screen, force_terminal=True, width=100, color_system=None))
    monkeypatch.setattr("time.monotonic", lambda: progress._shown + 2 * REFRESH_SECONDS)
    with progress:
        progress.nlp(Report())  # type: ignore[arg-type]
        progress.iteration(7, 3.25)
        assert "NLP 2: iteration 7, cost 3.25" in screen.getvalue()
        progress.stopping()
        assert "Ctrl-C again" in screen.getvalue()
        shown = screen.tell()
    last = screen.getvalue()[shown:]
    assert all(entry in last for entry in ROW)
    assert "Ctrl-C" not in last


def test_the_kind_of_progress_suits_the_output(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Rich tables are for terminals only, and --quiet is quiet everywhere."""
    for variable in ("FORCE_COLOR", "TTY_COMPATIBLE"):
        monkeypatch.delenv(variable, raising=False)
    assert type(progress_for(quiet=True)) is Progress
    assert type(progress_for(quiet=False)) is PlainProgress
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    assert type(progress_for(quiet=False)) is LiveProgress
