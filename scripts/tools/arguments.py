"""What scripts share which plan many tasks and write a page: arguments, rows so far, what made them, and where."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROGRAM_IS = (
    "*Program* is the last commit that changed the program, its models or the task when a row was made, with + where "
    "the checkout differed from it."
)
"""What a page says of the column."""


def check_counts(parser: argparse.ArgumentParser, given: argparse.Namespace, *options: str) -> None:
    """End the program where one of these options is a number below 1."""
    for option in options:
        if (value := getattr(given, option)) < 1:
            parser.error(f"argument --{option}: found {value}, expected 1 or more")


class Rows:
    """The rows of a page, which is drawn from them: a data file beside it that keeps those of earlier runs.

    Args:
        page: the file is the one of its name that ends with ``.json``.
        header: names of the columns; the first one is what a row is called by.
    """

    def __init__(self, page: Path, header: Sequence[str]) -> None:
        self._file, self._header = page.with_suffix(".json"), list(header)
        known = json.loads(self._file.read_text(encoding="utf-8")) if self._file.exists() else []
        self._cells: dict[str, list[str]] = {row[header[0]]: [row.get(name, "") for name in header] for row in known}

    @property
    def by_name(self) -> dict[str, list[str]]:
        """Name of a row -> its cells."""
        return dict(self._cells)

    @property
    def cells(self) -> list[list[str]]:
        """The cells of all rows, by name."""
        return [self._cells[name] for name in sorted(self._cells)]

    def only(self, names: Iterable[str]) -> None:
        """Leave all other rows out, as of tasks that are gone."""
        kept = set(names)
        self._cells = {name: cells for name, cells in self._cells.items() if name in kept}

    def put(self, cells: Sequence[str]) -> None:
        """Put a row in the place of the one that is called so, and write the file."""
        self._cells[cells[0]] = list(cells)
        lines = [json.dumps(dict(zip(self._header, each, strict=True)), ensure_ascii=False) for each in self.cells]
        self._file.write_text("[\n" + ",\n".join(lines) + "\n]\n", encoding="utf-8")


def planned_by_command(
    task: str | Path, folder: Path, overrides: Sequence[str], environment: Mapping[str, str] | None = None
) -> tuple[float, subprocess.CompletedProcess[str]]:
    """Run `fesd-robot plan` in a process of its own; return its seconds, from start to end, and how it ended.

    Args:
        task: file or name.
        folder: for the results.
        overrides: ``key=value`` each.
        environment: variables in place of those of this process.
    """
    command = [sys.executable, "-m", "fesd_robot", "plan", str(task), "--quiet", "--out", str(folder)]
    command += [word for one in overrides for word in ("--set", one)]
    own, begin = {**os.environ, "OMP_NUM_THREADS": "1", **(environment or {})}, time.perf_counter()
    done = subprocess.run(command, env=own, capture_output=True, text=True, check=False)
    return time.perf_counter() - begin, done


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
