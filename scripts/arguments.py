"""What scripts share which plan many tasks and write a page: arguments, rows so far, what made them, and where."""

from __future__ import annotations

import argparse
import contextlib
import os
import platform
import subprocess
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import TypeVar

Planned = TypeVar("Planned")
Way = TypeVar("Way")

ROOT = Path(__file__).resolve().parent.parent
PROGRAM_IS = (
    "*Program* is the last commit that changed the program, its models or the task when a row was made, with + where "
    "the checkout differed from it."
)
"""What a page says of the column."""


def task_parser(description: str, page: Path) -> argparse.ArgumentParser:
    """Return a parser of names of tasks, a number of processes, and where the page goes.

    Args:
        description: the first line of it is shown.
        page: where the page goes unless said otherwise.
    """
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    every = sorted(file.stem for file in (ROOT / "tasks").glob("*.yaml"))
    parser.add_argument("tasks", nargs="*", default=every, help="names of tasks; default: all")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--page", type=Path, default=page)
    return parser


def planned_in_all_ways(
    planned: Callable[[str, Way], Planned], tasks: Sequence[str], ways: Iterable[Way], processes: int
) -> Iterator[tuple[str, list[Planned]]]:
    """Yield the name of each task, and what comes of planning it in each way, several at a time.

    Args:
        planned: (name, way) -> what comes of it, in a process of its own.
        tasks: names.
        ways: in which each is planned.
        processes: how many.
    """
    ways = list(ways)
    with ProcessPoolExecutor(processes) as pool:
        jobs = {name: [pool.submit(planned, name, way) for way in ways] for name in tasks}
        for name, own in jobs.items():
            yield name, [job.result() for job in own]


def earlier_rows(page: Path, header: Sequence[str]) -> dict[str, list[str]]:
    """Return the rows of a page that was written before, by task.

    Args:
        page: with one table of these columns, if it is there.
        header: the first column is the task.
    """
    if not page.exists():
        return {}
    lines = [line.strip("| \n").split(" | ") for line in page.read_text(encoding="utf-8").splitlines()]
    return {cells[0]: cells for cells in lines if len(cells) == len(header) and cells[0] not in (header[0], "---")}


def program_of(task: str, planned_at: str | None = None) -> str:
    """Return which program plans a task: the last commit that changed it, and + where the checkout differs from that.

    Args:
        task: its name; its own file counts, those of other tasks do not.
        planned_at: `Plan.provenance.git` of a plan, by default the checkout as it is now; only files of the program
            count as different.

    Returns:
        The commit, ``not known`` if the checkout does not know the plan's.
    """
    paths = ["fesd_robot", "models", f"tasks/{task}.yaml"]

    def git(*words: str) -> str:
        command = ["git", "-C", str(ROOT), *words, "--", *paths]
        return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()

    revision, differs = (planned_at or "HEAD").removesuffix("-dirty"), git("status", "--porcelain")
    commit = git("log", "-1", "--format=%h", revision)
    return commit + ("+" if differs else "") if commit else "not known"


def machine() -> str:
    """Return the processor's name and the number of its cores."""
    name = platform.machine()
    with contextlib.suppress(OSError, StopIteration):
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        name = next(line.split(":")[1].strip() for line in text.splitlines() if line.startswith("model name"))
    return f"{name}, {os.cpu_count()} cores"
