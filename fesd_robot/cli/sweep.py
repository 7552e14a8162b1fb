"""`fesd-robot sweep`."""

from __future__ import annotations

import logging
import signal
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fesd_robot.cli.arguments import Quiet
from fesd_robot.cli.exits import ExitCode
from fesd_robot.cli.progress import LiveProgress, PlainProgress, Progress, is_live, wrapped

if TYPE_CHECKING:
    from rich.console import Console

    from fesd_robot.sweeps import SweepTable, Tally

logger = logging.getLogger(__name__)


def sweep(  # noqa: PLR0913, each is an option of the command
    sweep: Annotated[
        Path,
        typer.Argument(
            metavar="SWEEP", help="The sweep file, or the name of one that comes with the program.", show_default=False
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for table, page and plans; default: runs/<name of SWEEP>."),
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the sweep in the folder.")] = False,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Go on, and plan again what crashed, hung or was refused.")
    ] = False,
    timeout: Annotated[
        float | None, typer.Option("--timeout", metavar="SECONDS", help="For each plan.", show_default=False)
    ] = None,
    memory: Annotated[
        float | None,
        typer.Option(
            "--memory",
            metavar="MB",
            help="For the process of each plan; default: a part of this machine's.",
            show_default=False,
        ),
    ] = None,
    keep: Annotated[str, typer.Option("--keep", help="Plans that are kept: all, solved, best or none.")] = "solved",
    jobs: Annotated[
        int | None,
        typer.Option("--jobs", metavar="N", help="Plans made at once; default: one a core.", show_default=False),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            metavar="ADDRESS",
            help="Of Dask, as tcp://HOST:8786, whose workers plan; local: a cluster on this machine.",
            show_default=False,
        ),
    ] = None,
    against: Annotated[
        Path | None,
        typer.Option(
            "--against",
            metavar="DIR",
            help="Folder of a sweep with the same rows, which the page compares with.",
            show_default=False,
        ),
    ] = None,
    dataset: Annotated[
        float | None,
        typer.Option(
            "--dataset",
            metavar="HZ",
            help="Also write states and controls of solved plans at this rate, in LeRobot's columns.",
            show_default=False,
        ),
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="More than a million rows are meant.")] = False,
    quiet: Quiet = False,
) -> None:
    """Plan a family of tasks: distances, friction, masses, seeds, on all cores or a cluster.

    Every plan is a row of a table, which is written as rows arrive, also one that is not solved, crashes or takes too
    long. A page shows success and cost, and opens every plan that is kept.

    Ctrl-C ends the sweep; --resume goes on with it.
    """
    progress = _progress(quiet)
    terminated = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with progress:
            from fesd_robot.sweeps import SweepSettings, load_sweep, swept, write_dataset
            from fesd_robot.sweeps.planned import planned

            loaded = load_sweep(sweep)
            folder = out or Path("runs") / (loaded.name or "sweep")
            settings = SweepSettings(
                jobs=jobs,
                scheduler=scheduler,
                timeout=timeout,
                memory=memory,
                keep=keep,
                resume=resume,
                retry_failed=retry_failed,
                yes=yes,
                against=against,
            )
            table = swept(loaded, folder, settings, planned, progress.told)
            if dataset is not None:
                write_dataset(table, dataset)
    except KeyboardInterrupt:
        typer.echo("interrupted; --resume goes on where this stopped", err=True)
        raise typer.Exit(ExitCode.INTERRUPTED) from None
    finally:
        signal.signal(signal.SIGTERM, terminated)
    counts, lines = _summary(table, folder)
    if not quiet:
        typer.echo("\n".join(wrapped(line) for line in lines))
    if set(counts) != {"solved"}:
        raise typer.Exit(ExitCode.NOT_SOLVED)


def _summary(table: SweepTable, folder: Path) -> tuple[Counter[str], list[str]]:
    """Return how many rows have each verdict, and all in lines; rows are looked at one at a time."""
    from fesd_robot.sweeps.folder import FILES

    counts, best = Counter[str](), None
    for row in table.rows():
        counts[row["verdict"]] += 1
        if row["verdict"] == "solved" and (best is None or row["cost"] < best["cost"]):
            best = row
    words = ", ".join(f"{count} {verdict}" for verdict, count in counts.most_common())
    lines = [f"{sum(counts.values())} plans: {words}"]
    if best is not None:
        lines.append(f"cheapest: cost {best['cost']:.6g} of plan {best['number']}")
    names = [name for name in FILES if (folder / name).exists()]
    return counts, [*lines, f"written to {folder}: {', '.join(names)}"]


class _Told(Progress):
    """Progress whose line is that of a sweep."""

    _tally: Tally | None = None

    def told(self, tally: Tally) -> None:
        """Take note of how far the sweep is."""
        self._tally = tally

    def line(self) -> str:
        """Return the line."""
        told = self._tally.line() if self._tally else "reading the sweep"
        return f"{self.spent:4.0f} s  {told}"


class _Plain(_Told, PlainProgress):
    """As lines."""


class _Live(_Told, LiveProgress):
    """As a line that changes."""


def _progress(quiet: bool) -> _Told:
    if quiet:
        return _Told()
    from rich.console import Console

    console: Console = Console()
    return _Live(console) if is_live(console) else _Plain()
