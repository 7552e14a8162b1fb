"""A table of the documentation whose rows are plans: a sweep, the data file of its rows, and the page drawn from it."""

from __future__ import annotations

import argparse
import json
import platform
import shutil
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from fesd_robot.sweeps import Rows, SweepSettings, SweepTable, Tally, load_sweep, read_sweep, swept
from fesd_robot.sweeps.order import Verdict, Work
from fesd_robot.sweeps.planned import planned
from scripts.tools.arguments import ROOT, program_of

Row = dict[str, Any]
"""What is known of a plan: its task and case, what varies, `RESULTS`, what the table measures, how it was made."""

RESULTS = ("verdict", "cost", "flights", "slides", "iterations", "attempts", "seconds", "message")
MADE = ("made", "program")

REMARKS = "<!-- remarks -->"
"""Begins what is not drawn."""

PROGRAM_IS = (
    "*Program* is the last commit that changed the program, its models or the task when a row was made, with + where "
    "the checkout differed from it; *older* says that another one has changed them since, before the page was drawn."
)


@dataclass(frozen=True)
class Table:
    """A table of plans.

    Args:
        page: where it goes; the data file beside it ends with ``.json``.
        sweep: all that is planned, as in a sweep file.
        drawn: rows -> text of the page.
        work: makes the plan of a row.
        measures: columns that the work adds -> type.
        by: whether the command line takes names of tasks or of cases.
        written: names that are chosen -> makes the task files that they need.
    """

    page: Path
    sweep: Mapping[str, Any]
    drawn: Callable[[list[Row]], str]
    work: Work = planned
    measures: Mapping[str, type] = field(default_factory=dict)
    by: str = "task"
    written: Callable[[Sequence[str]], object] = len

    @property
    def folder(self) -> Path:
        """Where the sweep goes, with the plans that are kept."""
        return ROOT / "runs" / "tables" / self.page.stem

    def main(
        self,
        description: str,
        words: Sequence[str] | None = None,
        keep: str = "none",
        time_limit: float | None = None,
    ) -> list[Row]:
        """Do what the command line says: plan, put the rows into the data file, draw the page.

        Args:
            description: of the script; its first line is shown.
            words: of the command line.
            keep: which plans stay in the folder.
            time_limit: s for each plan, unless the command line says another one.

        Returns:
            the rows that were planned, or with ``--redraw`` all.
        """
        parser = argparse.ArgumentParser(description=description.splitlines()[0])
        parser.add_argument("names", nargs="*", metavar=self.by.upper(), help="default: all")
        parser.add_argument("--jobs", type=int, help="plans made at once; default: one a core")
        parser.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster that plans them")
        parser.add_argument("--time-limit", type=float, default=time_limit, metavar="S", help="for each plan")
        parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="a setting for all plans")
        parser.add_argument("--resume", action="store_true", help="go on with the sweep that was ended")
        parser.add_argument("--redraw", action="store_true", help="plan nothing, draw the page from its data file")
        given = parser.parse_args(words)
        every = sorted({self._name_of(number) for number in range(len(self._rows))})
        if unknown := sorted(set(given.names) - set(every)):
            parser.error(f"found '{unknown[0]}', expected one of {', '.join(every)}")
        rows = self.known() if given.redraw else self._planned(given.names or every, given, keep)
        self.draw()
        return rows

    def known(self) -> list[Row]:
        """Return the rows of the data file, in the order of the sweep; those of what it has no more are left out."""
        file = self.page.with_suffix(".json")
        return self._ordered(json.loads(file.read_text(encoding="utf-8")) if file.is_file() else [])

    def put(self, rows: Sequence[Row]) -> None:
        """Put rows in the place of those of the data file that are of the same task, case and values."""
        lines = [
            json.dumps({name: row[name] for name in self._columns if row.get(name) is not None}, ensure_ascii=False)
            for row in self._ordered([*self.known(), *rows])
        ]
        self.page.with_suffix(".json").write_text("[\n" + ",\n".join(lines) + "\n]\n", encoding="utf-8")

    def draw(self) -> None:
        """Write the page from the data file; remarks that somebody has added at its end stay."""
        before = self.page.read_text(encoding="utf-8") if self.page.is_file() else ""
        remarks = before.partition(REMARKS)[2].strip()
        text = self.drawn(self.known()).rstrip() + "\n"
        self.page.write_text(text + (f"\n{REMARKS}\n{remarks}\n" if remarks else ""), encoding="utf-8")

    def program(self, row: Row) -> str:
        """Return which program made a row, and whether it is older than what it measures."""
        return row["program"] + ("" if row["program"] == _program_now(self._task(row)) else ", older")

    def made_by(self, rows: Sequence[Row]) -> str:
        """Return the sentence with which the page says how it was made."""
        script = Path(sys.modules[self.drawn.__module__].__file__ or "").resolve().relative_to(ROOT).as_posix()
        words = "; ".join(dict.fromkeys(row["made"] for row in rows if row.get("made")))
        return (
            f"Made by `python {script}`{f' ({words})' if words else ''}, Python {platform.python_version()}, casadi "
            f"{version('casadi')}; drawn from [its rows]({self.page.with_suffix('.json').name})."
        )

    @property
    def _rows(self) -> Rows:
        return _rows_of(json.dumps(self.sweep, default=str))

    def _ordered(self, rows: Sequence[Row]) -> list[Row]:
        """Return rows in the order of the sweep, of several that are of the same the last one."""
        by_key = {self._key(row): {**dict.fromkeys(self._columns), **row} for row in rows}
        keys = [self._key(self._named(self._rows, number)) for number in range(len(self._rows))]
        return [by_key[key] for key in keys if key in by_key]

    @property
    def _columns(self) -> list[str]:
        task = ["task"] if self.by == "task" else []
        return list(dict.fromkeys((*task, *self._rows.keys, *RESULTS, *self.measures, *MADE)))

    def _name_of(self, number: int) -> str:
        return self._rows.task(number) if self.by == "task" else str(self._rows.inputs(number)["case"])

    def _named(self, rows: Rows, number: int) -> Row:
        return {**({"task": rows.task(number)} if self.by == "task" else {}), **rows.inputs(number)}

    def _key(self, row: Row) -> str:
        return json.dumps([row.get(name) for name in dict.fromkeys(("task", *self._rows.keys))])

    def _task(self, row: Row) -> str:
        return str(row["task"] if self.by == "task" else row["case"])

    def _planned(self, names: Sequence[str], given: argparse.Namespace, keep: str) -> list[Row]:
        """Plan the rows of some names; put them into the data file as they come."""
        self.written(names)
        if not given.resume:
            shutil.rmtree(self.folder, ignore_errors=True)
        told = {**self.sweep, "name": self.page.stem, "set": {**self.sweep.get("set", {}), **settings_of(given.set)}}
        if "task" in self.sweep.get("vary", {}):
            told["vary"] = {**self.sweep["vary"], "task": list(names)}
        else:
            chosen = {self._rows.inputs(n)["case"] for n in range(len(self._rows)) if self._name_of(n) in set(names)}
            told["cases"] = {name: case for name, case in self.sweep["cases"].items() if name in chosen}
        settings = SweepSettings(
            jobs=given.jobs, scheduler=given.scheduler, timeout=given.time_limit, keep=keep, resume=given.resume
        )
        loaded, seen = load_sweep(told), [0]
        own, made = (
            Rows(loaded),
            " ".join([*given.set, *([f"{given.time_limit:g} s each"] if given.time_limit else [])]),
        )

        def kept(table: SweepTable) -> list[Row]:
            rows = [self._of_sweep(own, row, made) for row in sorted(table.rows(), key=lambda row: row["number"])]
            self.put(rows)
            return rows

        def progress(tally: Tally) -> None:
            if tally.done > seen[0]:
                seen[0] = tally.done
                print(tally.line(), flush=True)
                kept(read_sweep(self.folder))

        return kept(swept(loaded, self.folder, settings, self.work, progress, self.measures))

    def _of_sweep(self, own: Rows, row: Row, made: str) -> Row:
        names = self._named(own, row["number"])
        kept = {name: row[name] for name in (*RESULTS, *self.measures)}
        return {**names, **kept, "made": made, "program": _program_now(self._task(names)), "plan": row["plan"]}


def cases_of(rows: Sequence[Row], of: str = "task") -> dict[str, list[Row]]:
    """Return task -> its rows, or what else is the same in them."""
    found: dict[str, list[Row]] = {}
    for row in rows:
        found.setdefault(row[of], []).append(row)
    return found


def solved(row: Row) -> bool:
    """Return whether a row has a plan that is solved."""
    return bool(row["verdict"] == Verdict.SOLVED)


def every_task() -> list[str]:
    """Return the names of all tasks in tasks/."""
    return sorted(file.stem for file in (ROOT / "tasks").glob("*.yaml"))


def settings_of(words: Sequence[str]) -> dict[str, Any]:
    """Return ``key=value`` of the command line as keys with values."""
    reader = YAML(typ="safe", pure=True)
    return {key: reader.load(value) for key, _, value in (word.partition("=") for word in words)}


@lru_cache
def _rows_of(sweep: str) -> Rows:
    return Rows(load_sweep(json.loads(sweep)))


@lru_cache
def _program_now(task: str) -> str:
    return program_of(task)
