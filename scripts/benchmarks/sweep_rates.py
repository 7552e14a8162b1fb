"""Rows a second of a sweep whose plans take ten milliseconds, and the memory of the program that orders them.

    python scripts/benchmarks/sweep_rates.py                    # 10000 rows by processes, then by a Dask cluster
    python scripts/benchmarks/sweep_rates.py --rows 1000 --executor dask

The table goes to docs/results/sweep-rates.md. Exit code 1 if Dask does fewer than 200 rows a second, or the memory
grows by more than 20 MB between a fifth of the rows and all of them.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import psutil

from fesd_robot.plans.tables import markdown_table
from fesd_robot.sweeps import SweepSettings, Tally, load_sweep, swept
from scripts.benchmarks.sweep_stub import SECONDS, slept
from scripts.tools.arguments import ROOT

PAGE = ROOT / "docs" / "results" / "sweep-rates.md"
LEAST_RATE, MOST_GROWTH = 200.0, 20.0
"""Rows a second, and MB."""

EARLY = 0.2
"""Part of the rows after which the memory is looked at."""

HEADER = ("workers", "rows", "seconds", "rows a second", "MB after a fifth", "MB at the end", "a million rows")
EXECUTORS = {"processes": None, "dask": "local"}


def measured(executor: str, rows: int, jobs: int) -> tuple[list[str], float, float]:
    """Return the line of an executor, its rows a second, and by how much the memory grew, MB."""
    memory: list[float] = []
    first: list[tuple[float, int]] = []

    def look(tally: Tally) -> None:
        if tally.done and not first:
            first.append((time.monotonic(), tally.done))
        if tally.done > EARLY * rows:
            memory.append(psutil.Process().memory_info().rss / 1e6)

    sweep = load_sweep(
        {"task": "hopper_one_jump", "vary": {"goal.configuration.root_x": {"range": [0.9, 1.1], "count": rows}}}
    )
    with tempfile.TemporaryDirectory() as folder:
        settings = SweepSettings(jobs=jobs, scheduler=EXECUTORS[executor], keep="none")
        table = swept(sweep, Path(folder) / "sweep", settings, slept, look)
        end = time.monotonic()
        assert sorted(table.columns["number"]) == list(range(rows))
    begin, known = first[0]
    rate = (rows - known) / (end - begin)
    words = f"{1e6 / rate / 60:.0f} min"
    numbers = [f"{value:.0f}" for value in (rate, memory[0], memory[-1])]
    return [f"{jobs} {executor}", str(rows), f"{end - begin:.1f}", *numbers, words], rate, memory[-1] - memory[0]


def main() -> int:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rows", type=int, default=10_000)
    parser.add_argument("--jobs", type=int, default=2 * (os.cpu_count() or 1), help="they sleep: two a core")
    parser.add_argument("--executor", choices=list(EXECUTORS), action="append")
    parser.add_argument("--page", type=Path, default=PAGE)
    arguments = parser.parse_args()
    lines, kept = [], True
    for executor in arguments.executor or EXECUTORS:
        cells, rate, growth = measured(executor, arguments.rows, arguments.jobs)
        print(" ".join(cells), flush=True)
        lines.append(cells)
        kept = kept and growth <= MOST_GROWTH and (executor != "dask" or rate >= LEAST_RATE)
    arguments.page.write_text(
        "# Rows a second of a sweep\n\n"
        f"Made by `scripts/benchmarks/sweep_rates.py`: rows whose plan is {1e3 * SECONDS:g} ms of sleep, "
        f"{os.cpu_count()} cores, "
        "one process a row at a time. Memory is that of the program that orders them.\n\n"
        + markdown_table(HEADER, lines),
        encoding="utf-8",
    )
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
