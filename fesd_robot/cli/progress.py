"""What is shown while a task is being solved."""

from __future__ import annotations

import time
from collections.abc import Mapping
from types import TracebackType
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from fesd_robot.mpcc import NlpReport
    from fesd_robot.plans import Plan

COLUMNS = {
    "sigma": 7,
    "velocity level": 14,
    "status": 12,
    "iterations": 10,
    "cost": 12,
    "complementarity": 15,
    "violation": 9,
    "seconds": 7,
}
"""Name and width of every column of the progress table."""

REFRESH_SECONDS = 0.1


def cells(report: NlpReport) -> list[str]:
    """Return one NLP as the entries of its row."""
    residuals = report.residuals
    return [
        f"{report.sigma:.0e}" if report.sigma else "exact",
        f"{report.velocity_level_sigma:.0e}" if report.velocity_level_sigma else "exact",
        report.status.value,
        str(report.iterations),
        f"{residuals.objective:.6g}",
        f"{residuals.complementarity:.1e}",
        f"{residuals.constraint_violation:.1e}",
        f"{report.seconds:.1f}",
    ]


def retry_line(changes: Mapping[str, Any], failed: Plan) -> str:
    """Return the sentence before an attempt with fallback settings."""
    from fesd_robot.plans.tables import settings_line

    return f"{failed.status.message} Next attempt: {settings_line(changes)}."


def start_line(seed: int, result: Plan) -> str:
    """Return the sentence about the plan from one of several initial guesses."""
    return f"seed {seed}: cost {result.statistics.objective:.6g}. {result.status.message}"


class Progress:
    """Shows nothing; base of the kinds that do."""

    def nlp(self, report: NlpReport) -> None:
        """Show a finished NLP."""

    def iteration(self, iteration: int, objective: float) -> None:
        """Show where the running NLP is."""

    def retry(self, changes: Mapping[str, Any], failed: Plan) -> None:
        """Say why fallback settings are tried, and which."""

    def start(self, seed: int, result: Plan) -> None:
        """Say what came of one of several initial guesses."""

    def stopping(self) -> None:
        """Say that the solve will stop at its next iteration."""
        typer.echo("interrupted: stopping with the best iterate; interrupt again to abort at once", err=True)

    def close(self) -> None:
        """End what is shown and leave the screen to others."""

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class PlainProgress(Progress):
    """One line per NLP, for files and pipes; the header appears as soon as the solver runs."""

    def __init__(self) -> None:
        self._begun = False

    def nlp(self, report: NlpReport) -> None:
        """Show a finished NLP."""
        self._begin()
        self._print(cells(report))

    def iteration(self, iteration: int, objective: float) -> None:
        """Show the header."""
        self._begin()

    def retry(self, changes: Mapping[str, Any], failed: Plan) -> None:
        """Say why fallback settings are tried, and which."""
        typer.echo(retry_line(changes, failed))

    def start(self, seed: int, result: Plan) -> None:
        """Say what came of one of several initial guesses."""
        typer.echo(start_line(seed, result))

    def _begin(self) -> None:
        if not self._begun:
            self._begun = True
            self._print(list(COLUMNS))

    @staticmethod
    def _print(entries: list[str]) -> None:
        """Print the entries in columns; typer.echo flushes."""
        typer.echo("  ".join(f"{entry:>{width}}" for entry, width in zip(entries, COLUMNS.values(), strict=True)))


class LiveProgress(Progress):
    """A table that grows and, below it, the running iteration, for terminals."""

    def __init__(self, console: Console) -> None:
        from rich.console import Group
        from rich.live import Live
        from rich.table import Table
        from rich.text import Text

        self._table = Table(box=None, pad_edge=False, header_style="bold")
        for name in COLUMNS:
            self._table.add_column(name, justify="right", no_wrap=True)
        self._line = Text()
        self._live = Live(Group(self._table, self._line), console=console, auto_refresh=False)
        self._begin = self._shown = time.monotonic()
        self._finished, self._stopping = 0, False

    def nlp(self, report: NlpReport) -> None:
        """Show a finished NLP."""
        self._finished += 1
        self._table.add_row(*cells(report), style=None if report.status.converged else "yellow")
        self._refresh()

    def iteration(self, iteration: int, objective: float) -> None:
        """Show where the running NLP is, at most ten times a second."""
        now = time.monotonic()
        if self._stopping or now - self._shown < REFRESH_SECONDS:
            return
        self._shown = now
        text = f"NLP {self._finished + 1}: iteration {iteration}, cost {objective:.6g}, {now - self._begin:.0f} s"
        self._show(text, "dim")

    def retry(self, changes: Mapping[str, Any], failed: Plan) -> None:
        """Say why fallback settings are tried, and which."""
        self._live.console.print(retry_line(changes, failed), style="yellow", highlight=False)

    def start(self, seed: int, result: Plan) -> None:
        """Say what came of one of several initial guesses."""
        self._live.console.print(start_line(seed, result), highlight=False)

    def stopping(self) -> None:
        """Say that the solve will stop at its next iteration."""
        self._stopping = True
        self._show("stopping with the best iterate; Ctrl-C again to abort at once", "yellow")

    def close(self) -> None:
        """Leave the table and remove the line below it."""
        if self._live.is_started:
            self._live.update(self._table)
            self._live.stop()

    def _show(self, text: str, style: str) -> None:
        self._line.plain, self._line.style = text, style
        self._refresh()

    def _refresh(self) -> None:
        """Draw; the first drawing starts the display, so that an error before it leaves no empty table."""
        if not self._live.is_started:
            self._live.start()
        self._live.refresh()


def progress_for(quiet: bool) -> Progress:
    """Return the kind of progress that suits where the output goes."""
    if quiet:
        return Progress()
    from rich.console import Console

    console = Console()
    return LiveProgress(console) if console.is_terminal and not console.is_dumb_terminal else PlainProgress()
