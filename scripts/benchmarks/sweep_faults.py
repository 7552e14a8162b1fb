"""Real plans in sweeps whose workers and drivers are killed: which rows are there, and at which costs.

    python scripts/benchmarks/sweep_faults.py                # all, ten minutes
    python scripts/benchmarks/sweep_faults.py --only cluster --rows 3 --page FILE.md
    python scripts/benchmarks/sweep_faults.py --only killed --kills 2 --page FILE.md

*cluster*: a process of this machine plans jumps; then two workers of a Dask cluster over TCP, each a program of its
own. *worker*: rows sleep instead of planning, by one process, then by such a cluster, one worker of which is killed
after a quarter of the rows. *killed*: the command plans pushes of a
block, is killed again and again at random times, and resumed; a process plans the same rows without a kill. Figures go
to docs/results/sweep-faults.json, and as a table to sweep-faults.md. Exit code 1 if a row is missing or twice, or a
cost differs by more than 1e-9 of it.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import psutil
from ruamel.yaml import YAML

from fesd_robot.plans.tables import markdown_table
from fesd_robot.sweeps import SweepSettings, SweepTable, Tally, load_sweep, read_sweep, swept
from fesd_robot.sweeps import dask_workers as dask
from fesd_robot.sweeps.order import Work
from fesd_robot.sweeps.planned import planned
from scripts.benchmarks.sweep_stub import slept
from scripts.tools.arguments import ROOT, check_counts, machine
from tests.sweeps.cluster import running

PAGE = ROOT / "docs" / "results" / "sweep-faults.md"
SAME = 1e-9
"""Part of a cost by which it may differ."""

WORKERS_COME = 120.0
"""s that workers have to come."""

LATEST = 8.0
"""s within which a kill comes, after a row or after the begin."""

SET = {"solver.effort": "quick", "output.page": False, "output.figures": False}
TASKS = {
    "cluster": ("hopper_one_jump", 0.7, 1.1),
    "worker": ("hopper_one_jump", 0.7, 1.1),
    "killed": ("block_push", 0.7, 0.9),
}
"""What is measured -> task, and between which distances, m."""

ASLEEP = 600
"""Rows that sleep."""

HEADER = ("how", "task", "rows", "solved", "largest difference of a cost", "iterations", "seconds", "kills")
KILLED = ("kill", "after [s]", "rows in the table", "those in it are once, with their plans")

Line = dict[str, Any]
"""Figures of a sweep, by the columns of the table."""


def sweep_of(what: str, rows: int) -> dict[str, Any]:
    """Return the sweep of what is measured."""
    task, shortest, longest = TASKS[what]
    distances = {"range": [shortest, longest], "count": rows}
    return {"task": task, "set": SET, "vary": {"goal.configuration.root_x": distances}}


def line(how: str, table: SweepTable, first: SweepTable, seconds: float, kills: int = 0) -> Line:
    """Return the figures of a sweep, its costs and iterations held against those of another one."""
    own, other = table.columns, first.columns
    whole = own["number"] == other["number"]
    differences = (
        [abs(a - b) / max(abs(b), 1e-9) for a, b in zip(own["cost"], other["cost"], strict=True)] if whole else [1.0]
    )
    task = json.loads((table.folder / "sweep.json").read_text(encoding="utf-8"))["sweep"]["task"]
    task = task if own["message"][0] != "slept" else "10 ms of sleep"
    same = "the same" if own["iterations"] == other["iterations"] else "others"
    values = (how, task, len(table), own["verdict"].count("solved"), max(differences), same, seconds, kills)
    return dict(zip(HEADER, values, strict=True))


def by_processes(told: Mapping[str, Any], folder: Path, work: Work = planned) -> tuple[SweepTable, float]:
    """Make the rows by one process of this machine; return them, and the seconds."""
    begin = time.monotonic()
    table = swept(load_sweep(told), folder / "processes", SweepSettings(jobs=1), work)
    return table, time.monotonic() - begin


def by_cluster(
    told: Mapping[str, Any], folder: Path, work: Work = planned, killed_after: int | None = None
) -> tuple[SweepTable, float, int]:
    """Make the rows by two workers over TCP; return them, the seconds, and how many workers were killed.

    Args:
        work: of a row.
        killed_after: rows after which one worker is killed.
    """
    out = folder / ("cluster" if killed_after is None else "one-killed")
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
        table = swept(load_sweep(told), out, SweepSettings(scheduler=cluster.address), work, kill)
        return table, time.monotonic() - begin, len(kills)


def cluster_lines(what: str, rows: int, folder: Path) -> list[Line]:
    """Make jumps, or rows that sleep, by a process and by a cluster, one worker of which is killed while they sleep."""
    asleep = what == "worker"
    rows, work = (ASLEEP, slept) if asleep else (rows, planned)
    told, place = sweep_of(what, rows), folder / what
    place.mkdir()
    first, seconds = by_processes(told, place, work)
    lines = [line("one process", first, first, seconds)]
    print(lines[-1], flush=True)
    after = rows // 4 if asleep else None
    table, seconds, kills = by_cluster(told, place, work, after)
    how = "two Dask workers over TCP" + (f", one killed after {after} rows" if kills else "")
    lines.append(line(how, table, first, seconds, kills))
    print(lines[-1], flush=True)
    return lines


def killed_lines(rows: int, folder: Path, kills: int, seed: int) -> tuple[list[Line], list[list[str]]]:
    """Make pushes by the command, killed at random times; return both lines, and one about what each kill leaves."""
    told = sweep_of("killed", rows)
    file, out, draw, left = folder / "pushes.yaml", folder / "command", random.Random(seed), list[list[str]]()
    YAML(typ="safe").dump(told, file)
    command = [sys.executable, "-m", "fesd_robot", "sweep", str(file), "--out", str(out), "--jobs", "1", "--quiet"]
    begin = time.monotonic()
    for number in range(kills):
        before, program = _rows_in(out), subprocess.Popen([*command, *(["--resume"] if _begun(out) else [])])
        # every second kill waits for a row, the others come whenever they do, also before the first
        while number % 2 and _rows_in(out) <= before and program.poll() is None:
            time.sleep(0.02)
        time.sleep(draw.uniform(0.0, LATEST))
        children = psutil.Process(program.pid).children(recursive=True) if program.poll() is None else []
        program.send_signal(signal.SIGKILL)
        program.wait()
        psutil.wait_procs(children, timeout=30.0)
        left.append([str(number + 1), f"{time.monotonic() - begin:.0f}", *_left(out)])
        print(left[-1], flush=True)
    subprocess.run([*command, *(["--resume"] if _begun(out) else [])], check=True)
    seconds = time.monotonic() - begin
    first, alone = by_processes(told, folder / "alone")
    lines = [
        line("one process", first, first, alone),
        line(f"the command, killed {kills} times", read_sweep(out), first, seconds, kills),
    ]
    print(lines[-1], flush=True)
    return lines, left


def _begun(out: Path) -> bool:
    return (out / "sweep.json").is_file()


def _rows_in(out: Path) -> int:
    return len(read_sweep(out)) if _begun(out) else 0


def _left(out: Path) -> list[str]:
    """Return what can be read after a kill: how many rows, and whether each is there once, with its plan."""
    if not _begun(out):
        return ["not begun", "–"]
    columns = read_sweep(out).columns
    once = len(set(columns["number"])) == len(columns["number"])
    there = all(plan and (out / plan / "plan.json").is_file() for plan in columns["plan"])
    return [str(len(columns["number"])), "yes" if once and there else "no"]


def page(told: Mapping[str, Any]) -> str:
    """Return the page."""

    def cells(one: Line) -> list[str]:
        difference, seconds = f"{one[HEADER[4]]:.1e}", f"{one['seconds']:.0f}"
        return [one["how"], one["task"], str(one["rows"]), str(one["solved"]), difference, one["iterations"], seconds,
                str(one["kills"] or "–")]  # fmt: skip

    return "\n".join(
        [
            "# Sweeps that are killed",
            "",
            f"Made by `python scripts/benchmarks/sweep_faults.py` beside other work: {told['machine']}; drawn from "
            "[its figures](sweep-faults.json). Rows with a task are real plans with `solver.effort: quick`. "
            "Costs and iterations are held against those of one process.",
            "",
            markdown_table(HEADER, [cells(one) for what in TASKS for one in told.get(what, [])]),
            "",
            "## What each kill of the command leaves",
            "SIGKILL at random times, every second one after another row has come; `--resume` goes on each time.",
            "",
            markdown_table(KILLED, told.get("kills", [])),
        ]
    )


def main() -> int:
    """Make the rows, and write figures and page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", choices=list(TASKS), help="one of them; figures of the others stay")
    parser.add_argument("--rows", type=int, default=12)
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0, help="of the times of kills")
    parser.add_argument("--page", type=Path, default=PAGE)
    arguments = parser.parse_args()
    check_counts(parser, arguments, "rows", "kills")
    file = arguments.page.with_suffix(".json")
    told = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    told["machine"], chosen = machine(), [arguments.only] if arguments.only else list(TASKS)
    with tempfile.TemporaryDirectory() as name:
        for what in (what for what in ("cluster", "worker") if what in chosen):
            told[what] = cluster_lines(what, arguments.rows, Path(name))
        if "killed" in chosen:
            told["killed"], told["kills"] = killed_lines(arguments.rows, Path(name), arguments.kills, arguments.seed)
    file.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    arguments.page.write_text(page(told), encoding="utf-8")
    new = [one for what in chosen for one in told[what]]
    return 0 if all(one[HEADER[4]] <= SAME for one in new) else 1


if __name__ == "__main__":
    sys.exit(main())
