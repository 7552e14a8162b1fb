"""Real plans of one jump in sweeps whose workers and drivers are killed: which rows are there, and at which costs.

    python scripts/benchmarks/sweep_faults.py              # 12 rows in four ways, five minutes
    python scripts/benchmarks/sweep_faults.py --rows 3 --kills 2 --page FILE.md

Processes of this machine make the rows first; then two workers of a Dask cluster over TCP, each a program of its own;
the same cluster, one worker of which is killed after a quarter of the rows; and the command, killed again and again at
random times and resumed. The table goes to docs/results/sweep-faults.md. Exit code 1 if a row is missing or twice, or a
cost differs by more than 1e-9 of it.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import psutil
from ruamel.yaml import YAML

from fesd_robot.plans.tables import markdown_table
from fesd_robot.sweeps import SweepSettings, SweepTable, Tally, load_sweep, read_sweep, swept
from fesd_robot.sweeps import dask_workers as dask
from fesd_robot.sweeps.planned import planned
from scripts.tools.arguments import ROOT, check_counts, machine
from tests.sweeps.cluster import running

PAGE = ROOT / "docs" / "results" / "sweep-faults.md"
SAME = 1e-9
"""Part of a cost by which it may differ."""

WORKERS_COME = 60.0
"""s that workers have to come."""

LATEST = 8.0
"""s within which a kill comes, after a row or after the begin."""

HEADER = ("how", "rows", "solved", "largest difference of a cost", "iterations", "seconds", "kills")
KILLED = ("kill", "after [s]", "rows in the table", "of which interrupted", "plans that they name are there")


@dataclass(frozen=True)
class Made:
    """A sweep that was made: how, its table, its seconds, and how often something was killed meanwhile."""

    how: str
    table: SweepTable
    seconds: float
    kills: int = 0

    def right(self, first: Made) -> bool:
        """Return whether it has every row once, with the costs of another one."""
        return self.table.columns["number"] == first.table.columns["number"] and self.apart(first) <= SAME

    def apart(self, first: Made) -> float:
        """Return the largest difference of a cost from that of another one, as a part of it."""
        pairs = zip(self.table.columns["cost"], first.table.columns["cost"], strict=True)
        return max(abs(own - other) / abs(other) for own, other in pairs)

    def cells(self, first: Made) -> list[str]:
        """Return its line beside that of another one."""
        columns = self.table.columns
        solved, same = columns["verdict"].count("solved"), columns["iterations"] == first.table.columns["iterations"]
        numbers = [str(len(self.table)), str(solved), f"{self.apart(first):.1e}", "the same" if same else "others"]
        return [self.how, *numbers, f"{self.seconds:.0f}", str(self.kills or "–")]


def told(rows: int) -> dict[str, object]:
    """Return the sweep: one jump over distances."""
    return {
        "task": "hopper_one_jump",
        "set": {"solver.effort": "quick", "output.page": False, "output.figures": False},
        "vary": {"goal.configuration.root_x": {"range": [0.7, 1.1], "count": rows}},
    }


def by_processes(rows: int, folder: Path) -> Made:
    """Make the rows by one process of this machine."""
    begin = time.monotonic()
    table = swept(load_sweep(told(rows)), folder / "processes", SweepSettings(jobs=1), planned)
    return Made("one process", table, time.monotonic() - begin)


def by_cluster(rows: int, folder: Path, killed_after: int | None = None) -> Made:
    """Make the rows by two workers over TCP.

    Args:
        killed_after: rows after which one worker is killed.
    """
    out = folder / ("cluster" if killed_after is None else "killed")
    place, kills = folder / f"{out.name}-workers", list[int]()
    place.mkdir()
    dask.SECONDS_TO_ANSWER = WORKERS_COME
    with running(place) as cluster:

        def kill(tally: Tally) -> None:
            if killed_after is not None and tally.done >= killed_after and not kills:
                kills.append(cluster.workers[0].pid)
                cluster.workers[0].send_signal(signal.SIGKILL)
                cluster.workers[0].wait()

        begin = time.monotonic()
        table = swept(load_sweep(told(rows)), out, SweepSettings(scheduler=cluster.address), planned, kill)
        seconds = time.monotonic() - begin
    how = "two Dask workers over TCP" + (f", one killed after {killed_after} rows" if kills else "")
    return Made(how, table, seconds, len(kills))


def by_killed_command(rows: int, folder: Path, kills: int, seed: int) -> tuple[Made, list[list[str]]]:
    """Make the rows by the command, killed at random times; return it, and a line about what each kill has left."""
    file, out, draw, lines = folder / "jumps.yaml", folder / "command", random.Random(seed), list[list[str]]()
    YAML(typ="safe").dump(told(rows), file)
    command = [sys.executable, "-m", "fesd_robot", "sweep", str(file), "--out", str(out), "--jobs", "1", "--quiet"]
    begin = time.monotonic()
    for number in range(kills):
        before, program = _rows_in(out), subprocess.Popen([*command, *(["--resume"] if number else [])])
        # every second kill waits for a row, the others come whenever they do, also before the first
        while number % 2 and _rows_in(out) <= before and program.poll() is None:
            time.sleep(0.02)
        time.sleep(draw.uniform(0.0, LATEST))
        children = psutil.Process(program.pid).children(recursive=True) if program.poll() is None else []
        program.send_signal(signal.SIGKILL)
        program.wait()
        psutil.wait_procs(children, timeout=30.0)
        lines.append([str(number + 1), f"{time.monotonic() - begin:.0f}", *_left(out)])
    subprocess.run([*command, "--resume"], check=True)
    made = Made(f"the command, killed {kills} times", read_sweep(out), time.monotonic() - begin, kills)
    return made, lines


def _rows_in(out: Path) -> int:
    return len(read_sweep(out)) if (out / "sweep.json").is_file() else 0


def _left(out: Path) -> list[str]:
    """Return what can be read after a kill: rows, interrupted ones, and whether their plans are there."""
    if not (out / "sweep.json").is_file():
        return ["not begun", "0", "–"]
    columns = read_sweep(out).columns
    assert len(set(columns["number"])) == len(columns["number"])
    there = [(out / plan / "plan.json").is_file() for plan in columns["plan"] if plan]
    return [str(len(there)), str(columns["state"].count("interrupted")), "yes" if all(there) else "no"]


def page(made: list[Made], kills: list[list[str]]) -> str:
    """Return the page."""
    first = made[0]
    return "\n".join(
        [
            "# Sweeps that are killed",
            "",
            f"Made by `scripts/benchmarks/sweep_faults.py` beside other work: {machine()}. Each row is a real plan, "
            "a jump of the hopper with `solver.effort: quick`. Costs and iterations are held against those of the "
            "first line.",
            "",
            markdown_table(HEADER, [each.cells(first) for each in made]),
            "",
            "## What each kill of the command leaves",
            "SIGKILL at random times, every second one after another row has come; `--resume` goes on each time.",
            "",
            markdown_table(KILLED, kills),
        ]
    )


def main() -> int:
    """Make the rows in all ways, and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rows", type=int, default=12)
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0, help="of the times of kills")
    parser.add_argument("--page", type=Path, default=PAGE)
    arguments = parser.parse_args()
    check_counts(parser, arguments, "rows", "kills")
    rows, made = arguments.rows, list[Made]()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        steps: list[Callable[[], Made]] = [
            lambda: by_processes(rows, folder),
            lambda: by_cluster(rows, folder),
            lambda: by_cluster(rows, folder, max(1, rows // 4)),
        ]
        for step in steps:
            made.append(step())
            print(" ".join(made[-1].cells(made[0])), flush=True)
        last, kills = by_killed_command(rows, folder, arguments.kills, arguments.seed)
        made.append(last)
        print(" ".join(last.cells(made[0])), flush=True)
        arguments.page.write_text(page(made, kills), encoding="utf-8")
        return 0 if all(each.right(made[0]) for each in made) else 1


if __name__ == "__main__":
    sys.exit(main())
