"""Progress that is shown while a task is being solved."""

from __future__ import annotations

import textwrap
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import typer

from fesd_robot.running import Activity, SearchEffort

if TYPE_CHECKING:
    from rich.console import Console

    from fesd_robot.mpcc import NlpReport
    from fesd_robot.plans import Plan

COLUMNS = {
    "sigma": 5,
    "velocity": 8,
    "status": 15,
    "iterations": 10,
    "cost": 11,
    "pairs": 7,
    "violation": 9,
    "seconds": 7,
}
"""Name and width of every column of the table of NLPs: sigma of the position and the velocity level, how IPOPT ended,
largest violation of a pair and of any other constraint."""

REFRESHES_PER_SECOND = 4

SILENCE = 2.0
"""s after which a line is printed though nothing is new."""

FIRST_LINE = 0.5
"""s after which the first line is printed: mistakes in a task are found earlier, and come without one."""

LEAST_WAIT = 0.05
"""s between two looks at the clock."""

_CONTINUED = "    "
"""Before what continues a sentence; before seconds there are fewer blanks."""

COLUMNS_OF_A_LINE = 79
"""Characters of a line at most: what a terminal of 80 columns shows without breaking it."""

STOPPING = "interrupted: stopping with the best iterate; interrupt again to abort at once"


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
    from fesd_robot.plans import settings_line

    return f"{failed.status.message} Next attempt: {settings_line(changes)}."


_OF_AN_ATTEMPT = (
    Activity.BUILDING,
    Activity.COMPILING,
    Activity.SEARCHING,
    Activity.POLISHING,
    Activity.IMPROVING,
    Activity.REFINING,
    Activity.CERTIFYING,
)
"""Activities that every fallback setting repeats."""


class Progress:
    """Says nothing; base of the kinds that do, which are told what happens.

    What is shown has to come by itself, for a solver that is busy tells nothing: the kinds that show something have a
    thread for that.

    Args:
        table: whether every NLP has a line of its own.

    """

    def __init__(self, table: bool = False) -> None:
        self._time_limit: float | None = None
        self._retries = 0
        self._table, self._begun = table, False
        self._begin = self._since = time.monotonic()
        self._activity = Activity.READING
        self._done: tuple[int, int | None] | None = None
        self._iterations = 0
        self._cost: float | None = None
        self._stopping = False

    @property
    def spent(self) -> float:
        """Seconds since the beginning."""
        return time.monotonic() - self._begin

    def limit(self, seconds: float | None) -> None:
        """Take note of how many seconds all may take, None for no limit."""
        self._time_limit = seconds

    def activity(self, activity: Activity) -> None:
        """Show an activity that begins."""
        self._activity, self._done, self._since = activity, None, time.monotonic()

    def steps(self, done: int, of: int | None) -> None:
        """Show how many steps of the activity are done, and of how many, None if that is not known."""
        self._done = (done, of)

    def nlp(self, report: NlpReport) -> None:
        """Say how an NLP ended, if there is a table, and keep the cost of an exact motion."""
        converged = report.status.converged
        if not report.sigma and converged:
            self._cost = report.residuals.objective
        if self._table:
            if not self._begun:
                self._begun = True
                self._say(aligned(list(COLUMNS)), "bold")
            self._say(aligned(cells(report)), "none" if converged else "yellow")

    def iteration(self, iteration: int, objective: float) -> None:
        """Count an iteration of the solver."""
        self._iterations += iteration > 0

    def retry(self, changes: Mapping[str, Any], failed: Plan) -> None:
        """Say why fallback settings are tried, and which."""
        self._retries, self._cost = self._retries + 1, None
        self._say(retry_line(changes, failed), "yellow")

    def early(self, plan: Plan, folder: Path) -> None:
        """Say that a first plan is there."""
        self._say(f"a first plan, of cost {plan.statistics.objective:.6g}, is in {folder}", "none")

    def stopping(self) -> None:
        """Say that the solve will stop at its next iteration."""
        self._stopping = True
        typer.echo(STOPPING, err=True)

    def close(self) -> None:
        """End what is shown and leave the screen to others."""

    def line(self) -> str:
        """Return one line: the activity, its elapsed time, its progress, and the time left.

        Where there is no room for all, the iterations are left out, and then the cost.
        """
        spent = self.spent
        doing = "stopping" if self._stopping else self._attempt() + self._activity.value + self._how_far()
        iterations = [f"{self._iterations} iterations"] if self._iterations else []
        cost = [f"cost {self._cost:.4g}"] if self._cost is not None else []
        left = [f"{max(self._time_limit - spent, 0.0):.0f} s left"] if self._time_limit is not None else []
        left = left if self._activity not in (Activity.WRITING, Activity.DRAWING) else []
        for more in (iterations + cost, cost, []):
            line = f"{spent:4.0f} s  {', '.join([doing, *more, *left])}"
            if len(line) <= COLUMNS_OF_A_LINE:
                break
        return line

    def _attempt(self) -> str:
        """Return which attempt it is, after the first."""
        if self._activity not in _OF_AN_ATTEMPT or not self._retries:
            return ""
        return f"attempt {1 + self._retries}, "

    def _how_far(self) -> str:
        """Return the progress of the activity, as far as it is known."""
        if self._activity is Activity.CERTIFYING:
            return f", {max(SearchEffort.certificate_seconds - (time.monotonic() - self._since), 0.0):.0f} s at most"
        if self._done is None:
            return ""
        done, of = self._done
        return f" {done} tried" if of is None else f" {done} of {of}"

    def _say(self, line: str, style: str) -> None:
        """Show a line that stays, in one of rich's styles."""

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class PlainProgress(Progress):
    """A line for everything new, and one as often as `SILENCE`, for files and pipes."""

    def __init__(self, table: bool = False) -> None:
        super().__init__(table)
        self._ended, self._printing = threading.Event(), threading.Lock()
        self._printed = self._begin - SILENCE + FIRST_LINE
        self._ticker = threading.Thread(target=self._tick, name="progress", daemon=True)

    def __enter__(self) -> Progress:
        self._ticker.start()
        return self

    def activity(self, activity: Activity) -> None:
        """Print an activity that begins, if it is another one."""
        if activity is not self._activity:
            super().activity(activity)
            self._say(self.line(), "none")

    def steps(self, done: int, of: int | None) -> None:
        """Print how many steps are done, if there are more, as a line of its own."""
        more = self._done is not None and done > self._done[0]
        super().steps(done, of)
        if more and of is not None:
            self._say(self.line(), "none")

    def close(self) -> None:
        """Print no more."""
        self._ended.set()
        if self._ticker.is_alive():
            self._ticker.join()

    def _tick(self) -> None:
        while not self._ended.wait(max(self._printed + SILENCE - time.monotonic(), LEAST_WAIT)):
            if time.monotonic() >= self._printed + SILENCE:
                self._say(self.line(), "none")

    def _say(self, line: str, style: str) -> None:
        """Print a line; typer.echo flushes."""
        with self._printing:
            self._printed = time.monotonic()
            typer.echo(wrapped(line))


class LiveProgress(Progress):
    """A line that changes, for terminals; those that stay are above it."""

    def __init__(self, console: Console, table: bool = False) -> None:
        from rich.live import Live
        from rich.text import Text

        super().__init__(table)
        self._live = Live(
            get_renderable=lambda: Text(self.line(), style="yellow" if self._stopping else "dim", overflow="ellipsis"),
            console=console,
            refresh_per_second=REFRESHES_PER_SECOND,
            transient=True,
        )

    def __enter__(self) -> Progress:
        self._live.start(refresh=True)
        return self

    def stopping(self) -> None:
        """Say that the solve will stop at its next iteration."""
        self._stopping = True
        self._say(STOPPING, "yellow")

    def close(self) -> None:
        """Remove the line."""
        self._live.stop()

    def _say(self, line: str, style: str) -> None:
        self._live.console.print(wrapped(line), style=style, highlight=False, markup=False, soft_wrap=True)


def wrapped(line: str) -> str:
    """Return a sentence in lines that a terminal of 80 columns shows without breaking them."""
    if len(line) <= COLUMNS_OF_A_LINE:
        return line
    lines = textwrap.wrap(
        line, COLUMNS_OF_A_LINE, subsequent_indent=_CONTINUED, break_long_words=False, break_on_hyphens=False
    )
    return "\n".join(lines)


def aligned(entries: list[str]) -> str:
    """Return the entries of a row of the table of NLPs in columns."""
    return " ".join(f"{entry:>{width}}" for entry, width in zip(entries, COLUMNS.values(), strict=True))


def progress_for(quiet: bool, table: bool = False) -> Progress:
    """Return the kind of progress that suits where the output goes.

    Args:
        quiet: show nothing.
        table: show every NLP, too.
    """
    if quiet:
        return Progress()
    from rich.console import Console

    console = Console()
    return LiveProgress(console, table) if is_live(console) else PlainProgress(table)


def is_live(console: Console) -> bool:
    """Return whether a line can be changed where the output goes."""
    return console.is_terminal and not console.is_dumb_terminal
