"""What is shown during a solve, on a terminal and elsewhere."""

from __future__ import annotations

import io
import time
from typing import NamedTuple

import pytest
from rich.console import Console

from fesd_robot.cli.progress import (
    REFRESHES_PER_SECOND,
    SILENCE,
    LiveProgress,
    PlainProgress,
    Progress,
    progress_for,
    wrapped,
)
from fesd_robot.mpcc import NlpStatus
from fesd_robot.plans import Plan
from fesd_robot.running import SearchEffort
from fesd_robot.running.activities import Activity


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


def test_plain_progress_says_what_is_done(capsys: pytest.CaptureFixture[str]) -> None:
    """A line for every activity, and after `SILENCE` seconds one that counts; rows of NLPs only if asked for."""
    with PlainProgress() as progress:
        progress.limit(60.0)
        progress.activity(Activity.SEARCHING)
        progress.activity(Activity.SEARCHING)
        progress.steps(0, 12)
        progress.steps(7, 12)
        progress.iteration(0, 1.0)
        for number in (1, 2):
            progress.iteration(number, 3.0)
        progress.nlp(Report(sigma=0.0))  # type: ignore[arg-type]
        time.sleep(SILENCE + 0.5)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].endswith("s  searching, 60 s left")
    assert lines[1].endswith("s  searching 7 of 12, 60 s left")
    assert lines[2].endswith("s  searching 7 of 12, 2 iterations, cost 12.5, 58 s left")
    assert len(lines) == 3


def test_the_table_has_a_row_for_every_nlp(capsys: pytest.CaptureFixture[str]) -> None:
    """A header and aligned rows that fit a terminal of 80 columns."""
    with PlainProgress(table=True) as progress:
        progress.nlp(Report())  # type: ignore[arg-type]
    header, row = capsys.readouterr().out.splitlines()
    assert row.split() == ROW
    assert len(header) == len(row) < 80


def test_every_line_fits(capsys: pytest.CaptureFixture[str]) -> None:
    """80 columns are enough for every activity after hours, with many iterations, a cost and a time limit."""
    progress = Progress()
    progress.limit(9999.0)
    progress._retries = 9
    progress.nlp(Report(sigma=0.0, residuals=Residuals(objective=-1.23456789e-11)))  # type: ignore[arg-type]
    progress._iterations = 99999
    progress._begin -= 999
    for activity in Activity:
        progress.activity(activity)
        progress.steps(9999, None)
        assert activity.value in progress.line() and len(progress.line()) < 80


def test_an_attempt_with_other_settings_has_a_number(short_plan: Plan) -> None:
    """The first one has none; those that follow it do, as long as there is something that they do anew."""
    progress = Progress()
    progress.activity(Activity.BUILDING)
    assert progress.line().endswith("s  building the equations")
    progress.retry({"method.stages": 3}, short_plan)
    assert "attempt 2, building" in progress.line()
    progress.retry({"method.stages": 4}, short_plan)
    assert "attempt 3, building" in progress.line()
    progress.activity(Activity.DRAWING)
    assert progress.line().endswith("s  drawing page and figures")


def test_a_certificate_says_how_long_it_may_take() -> None:
    """Its seconds run down from its limit."""
    progress = Progress()
    progress.activity(Activity.CERTIFYING)
    assert f"certifying, {SearchEffort.certificate_seconds:.0f} s at most" in progress.line()
    progress._since -= SearchEffort.certificate_seconds - 1
    assert "certifying, 1 s at most" in progress.line()


def test_sentences_are_broken_into_lines_that_fit(capsys: pytest.CaptureFixture[str]) -> None:
    """A message is longer than a terminal is wide, and no word of it is lost."""
    message = "Not solved: the goal is missed, root_x ends 0.2 m from it; " * 5
    assert wrapped(message).split() == message.split()
    assert all(len(line) < 80 for line in wrapped(message).splitlines())
    assert wrapped("short") == "short"


def test_live_progress_is_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a terminal one line changes, rows of NLPs stand above it if asked for, and it is gone at the end."""
    screen = io.StringIO()
    with LiveProgress(Console(file=screen, force_terminal=True, width=100, color_system=None), table=True) as progress:
        progress.nlp(Report())  # type: ignore[arg-type]
        progress.activity(Activity.REFINING)
        time.sleep(2 / REFRESHES_PER_SECOND)
        assert "s  refining the motion" in screen.getvalue()
        progress.stopping()
        assert "interrupt again to abort at once" in screen.getvalue()
    lines = screen.getvalue()
    assert all(entry in lines for entry in ROW)


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
