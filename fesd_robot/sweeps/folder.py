"""The folder of a sweep: which sweep it is of, its table, and the plans that are kept."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fesd_robot.arguments import checked
from fesd_robot.errors import SweepError
from fesd_robot.plans.results_folder import PAGE_FILE, PLAN_FILE
from fesd_robot.sweeps.table import PARQUET_FILE, ROWS_FILE, Columns, Journal, SweepTable
from fesd_robot.writing import write_atomically

SWEEP_FILE, SWEEP_PAGE, PLANS_FOLDER = "sweep.json", "sweep.html", "plans"

FILES = (SWEEP_FILE, ROWS_FILE, PARQUET_FILE, SWEEP_PAGE, PLANS_FOLDER, "dataset")
"""What a sweep leaves."""

_TYPES = {"float": float, "bool": bool, "str": str, "object": object, "int": int}


@dataclass(frozen=True)
class SweepRecord:
    """What a folder says of its sweep.

    Args:
        name: of the sweep.
        identity: a hash of task, values and version.
        version: of the program.
        total: number of rows.
        columns: of the table.
        told: the sweep as it is written.
    """

    name: str
    identity: str
    version: str
    total: int
    columns: Columns
    told: Mapping[str, Any]

    def text(self) -> str:
        """Return it as JSON."""
        own = {
            "sweep_version": 1,
            "name": self.name,
            "identity": self.identity,
            "version": self.version,
            "total": self.total,
            "inputs": {key: kind.__name__ for key, kind in self.columns.inputs.items()},
            "ends": list(self.columns.ends),
            "measures": {name: kind.__name__ for name, kind in self.columns.measures.items()},
            "sweep": self.told,
        }
        return json.dumps(own, indent=1) + "\n"


class SweepFolder:
    """The folder of a sweep.

    Args:
        folder: where it is.
        record: of the sweep.
    """

    def __init__(self, folder: Path, record: SweepRecord) -> None:
        self.folder, self.record = folder, record
        self.journal = Journal(folder, record.columns)

    def begun(self, resume: bool) -> None:
        """Make the folder, or check that it is this sweep's.

        Raises:
            SweepError: it holds something else, another sweep, or this one and it was not asked to go on.
        """
        if self.folder.exists() and not self.folder.is_dir():
            raise SweepError(f"{self.folder}: is a file, expected a folder; choose another --out")
        there = read_record(self.folder)
        if there is None:
            others = [name for name in _names(self.folder) if not name.endswith((".part", ".lock"))]
            if others:
                raise SweepError(f"{self.folder}: holds files but no {SWEEP_FILE}, so it is no folder of a sweep; "
                                 "choose another --out")  # fmt: skip
        elif there.identity != self.record.identity:
            what = f"of version {there.version}" if there.version != self.record.version else f"'{there.name}'"
            raise SweepError(
                f"{self.folder}: holds another sweep, {what}, whose task or values are not these; choose another --out"
            )
        elif not resume:
            raise SweepError(f"{self.folder}: holds this sweep already; --resume goes on with it")
        if there is None:
            write_atomically(self.folder / SWEEP_FILE, self.record.text().encode())

    def keep(self, number: int, files: Mapping[str, bytes]) -> str:
        """Write the files of a plan; return their folder, relative to that of the sweep."""
        place = self.place(number)
        part = place.with_name(f"{place.name}.part")
        shutil.rmtree(part, ignore_errors=True)
        for name, content in files.items():
            (part / name).parent.mkdir(parents=True, exist_ok=True)
            (part / name).write_bytes(content)
        shutil.rmtree(place, ignore_errors=True)
        os.replace(part, place)
        return place.relative_to(self.folder).as_posix()

    def place(self, number: int) -> Path:
        """Return where the plan of a row is, if it is kept: at most a thousand in a folder."""
        return self.folder / PLANS_FOLDER / f"{number // 1000:04d}" / f"{number:07d}"

    def plan_of(self, number: int) -> bytes | None:
        """Return the plan of a row as JSON, None if it is not kept."""
        with suppress(OSError):
            return (self.place(number) / PLAN_FILE).read_bytes()
        return None

    def drop(self, number: int) -> None:
        """Remove the plan of a row."""
        shutil.rmtree(self.place(number), ignore_errors=True)

    def page_of(self, number: int) -> str | None:
        """Return the page of a plan, relative to the folder, None if there is none."""
        page = self.place(number) / PAGE_FILE
        return page.relative_to(self.folder).as_posix() if page.is_file() else None


def read_record(folder: Path) -> SweepRecord | None:
    """Return what a folder says of its sweep, None if it is no folder of one.

    Raises:
        SweepError: its file is none that this program has written.
    """
    file = folder / SWEEP_FILE
    if not file.is_file():
        return None
    try:
        told = json.loads(file.read_text(encoding="utf-8"))
        inputs, measures = (
            {name: _TYPES[kind] for name, kind in told.get(part, {}).items()} for part in ("inputs", "measures")
        )
        columns = Columns(inputs, tuple(told["ends"]), measures)
        return SweepRecord(told["name"], told["identity"], told["version"], int(told["total"]), columns, told["sweep"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise SweepError(f"{file}: found no record of a sweep ({error}), expected one of fesd-robot sweep") from error


@checked
def read_sweep(folder: Path | str) -> SweepTable:
    """Return the rows of a sweep, also of one that runs or was killed.

    Args:
        folder: of the sweep.

    Raises:
        SweepError: it is no folder of a sweep.
    """
    folder = Path(folder)
    record = read_record(folder)
    if record is None:
        raise SweepError(f"{folder}: holds no {SWEEP_FILE}, expected the folder of a sweep")
    return SweepTable(Journal(folder, record.columns))


def _names(folder: Path) -> list[str]:
    return [each.name for each in folder.iterdir()] if folder.is_dir() else []
