"""The rows of a sweep on the disk: a table that is whole whenever the program is killed.

`rows.csv` is the journal: every row is appended with one write, so that of a program that is killed at most the last
line is cut off, which readers leave out. `rows.parquet` is made from it now and then, beside it, and takes its place
by renaming.
"""

from __future__ import annotations

import csv
import io
import json
import logging
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from fesd_robot.errors import SweepError

logger = logging.getLogger(__name__)

ROWS_FILE, PARQUET_FILE = "rows.csv", "rows.parquet"

RESULTS: Mapping[str, type] = {
    "state": str,
    "verdict": str,
    "cost": float,
    "work": float,
    "time": float,
    "flights": int,
    "slides": float,
    "iterations": int,
    "attempts": int,
    "seconds": float,
    "memory": float,
    "start": int,
    "abandoned": int,
    "abandoned_iterations": int,
    "message": str,
    "plan": str,
}
"""Column of what came of a row -> type; work of the controls in J, time in s of motion, slides in m, memory in MB."""

_BATCH = 2_000
"""Rows of a table that are in memory at once while it is converted."""


@dataclass(frozen=True)
class Columns:
    """Columns of a table.

    Args:
        inputs: key that varies -> type of its values; JSON of those that are neither numbers nor texts.
        ends: columns of where a motion ends, ``end.NAME`` each.
        measures: further columns that are measured in plans -> type.
    """

    inputs: Mapping[str, type]
    ends: Sequence[str] = ()
    measures: Mapping[str, type] = field(default_factory=dict)
    types: Mapping[str, type] = field(init=False)

    def __post_init__(self) -> None:
        ends = dict.fromkeys(self.ends, float)
        types = {"number": int, **self.inputs, "identity": str, **RESULTS, **self.measures, **ends}
        object.__setattr__(self, "types", types)

    @property
    def names(self) -> list[str]:
        """Names in their order."""
        return list(self.types)

    def line(self, row: Mapping[str, Any]) -> bytes:
        """Return a row as a line of the journal."""
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerow([_cell(row.get(name)) for name in self.types])
        return text.getvalue().encode()

    def read(self, cells: Sequence[str]) -> dict[str, Any]:
        """Return a line of the journal as a row."""
        return {name: _value(cell, kind) for (name, kind), cell in zip(self.types.items(), cells, strict=True)}


def type_of(values: Sequence[Any]) -> type:
    """Return the type of the column of some values: float, bool, str, or object for what is written as JSON."""
    kinds = {type(value) for value in values}
    if kinds <= {int, float}:
        return float
    return kinds.pop() if len(kinds) == 1 and kinds <= {bool, str} else object


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, str):
        return " ".join(value.split())
    return repr(value) if isinstance(value, float | int) and not isinstance(value, bool) else json.dumps(value)


def _value(cell: str, kind: type) -> Any:
    if not cell:
        return "" if kind is str else None
    if kind is str:
        return cell
    if kind in (bool, object):
        try:
            return json.loads(cell)
        except ValueError:
            return cell
    return kind(cell)


class Journal:
    """The table of a folder, to which rows are appended.

    Args:
        folder: which exists.
        columns: of the table.
    """

    def __init__(self, folder: Path, columns: Columns) -> None:
        self.folder, self.columns = folder, columns
        self._handle: int | None = None

    @property
    def file(self) -> Path:
        """The file."""
        return self.folder / ROWS_FILE

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield the rows of the table, without a last line that is cut off."""
        if not self.file.is_file():
            return
        with self.file.open("rb") as stream:
            lines = (next(csv.reader([line.decode()])) for line in stream if line.endswith(b"\n"))
            header = next(lines, None)
            if header is not None and header != self.columns.names:
                raise SweepError(f"{self.file}: found other columns than those of this sweep, expected its table")
            yield from map(self.columns.read, lines)

    def rewritten(self, change: Callable[[dict[str, Any]], dict[str, Any] | None]) -> None:
        """Put another table in the place of this one, whole at any time.

        Args:
            change: row -> what takes its place, None for nothing.
        """
        self.close()
        part = self.folder / f"{ROWS_FILE}.part"
        with part.open("wb") as stream:
            stream.write(self.columns.line({name: name for name in self.columns.names}))
            stream.writelines(self.columns.line(row) for each in self.rows() if (row := change(each)) is not None)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(part, self.file)

    def append(self, row: Mapping[str, Any]) -> None:
        """Append a row with one write."""
        if self._handle is None:
            if not self.file.is_file():
                self.rewritten(lambda row: row)
            self._handle = os.open(self.file, os.O_WRONLY | os.O_APPEND | getattr(os, "O_BINARY", 0))
        line = self.columns.line(row)
        if os.write(self._handle, line) != len(line):
            raise SweepError(f"{self.file}: the disk is full, expected room for a row; --resume goes on later")

    def close(self) -> None:
        """Bring the table to the disk."""
        if self._handle is not None:
            os.fsync(self._handle)
            os.close(self._handle)
            self._handle = None

    def to_parquet(self) -> bool:
        """Write the rows so far as Apache Parquet, in place of the earlier file; return whether that can be done."""
        try:
            import pyarrow as pa
            import pyarrow.parquet as pq
        except ImportError:
            return False
        schema = pa.schema([(name, _ARROW[kind](pa)) for name, kind in self.columns.types.items()])
        part = self.folder / f"{PARQUET_FILE}.part"
        with pq.ParquetWriter(part, schema) as writer:
            for rows in _batches(self.rows(), _BATCH):
                writer.write_table(pa.Table.from_pylist([self._for_arrow(row) for row in rows], schema=schema))
        os.replace(part, self.folder / PARQUET_FILE)
        return True

    def _for_arrow(self, row: dict[str, Any]) -> dict[str, Any]:
        texts = {
            name: json.dumps(row[name])
            for name, kind in self.columns.types.items()
            if kind is object and row[name] is not None
        }
        return {**row, **texts}


_ARROW: Mapping[type, Callable[[Any], Any]] = {
    int: lambda pa: pa.int64(),
    float: lambda pa: pa.float64(),
    str: lambda pa: pa.string(),
    bool: lambda pa: pa.bool_(),
    object: lambda pa: pa.string(),
}


def _batches(rows: Iterable[dict[str, Any]], size: int) -> Iterator[list[dict[str, Any]]]:
    batch: list[dict[str, Any]] = []
    for row in rows:
        batch.append(row)
        if len(batch) == size:
            yield batch
            batch = []
    if batch:
        yield batch


class SweepTable:
    """The rows of a sweep, which pandas and Polars read: ``pandas.DataFrame(table.columns)``.

    Attributes:
        folder: of the sweep.
    """

    def __init__(self, journal: Journal) -> None:
        self.folder, self._journal = journal.folder, journal

    @cached_property
    def columns(self) -> dict[str, list[Any]]:
        """Name -> values of all rows, in the order of their numbers; None where there is none."""
        ordered = sorted(self.rows(), key=lambda row: row["number"])
        return {name: [row[name] for row in ordered] for name in self._journal.columns.names}

    def __len__(self) -> int:
        return len(self.columns["number"])

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield the rows one by one, as they arrived, from the disk."""
        return self._journal.rows()

    def __arrow_c_stream__(self, requested_schema: object = None) -> object:
        """Hand the rows to a library that reads Arrow (needs pyarrow)."""
        import pyarrow as pa

        return pa.table(self.columns).__arrow_c_stream__(requested_schema)

    def __repr__(self) -> str:
        """Return the sweep in a line."""
        solved = sum(verdict == "solved" for verdict in self.columns["verdict"])
        return f"<SweepTable {self.folder}: {len(self)} rows, {solved} solved>"
