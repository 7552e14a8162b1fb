"""Heights of the ground from a file: a table of points, or an image."""

from __future__ import annotations

import csv
import itertools
import math
import struct
import zlib
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fesd_robot.contact.ground.height_field import MAX_POINTS
from fesd_robot.contact.ground.profile import MAX_PIECES
from fesd_robot.errors import GroundError, nearest_file
from fesd_robot.exactness import ROUNDED
from fesd_robot.ranges import MAX_IMAGE_BYTES, MAX_TABLE_BYTES, too_large

_TABLES = {2: ("x,z", "two"), 3: ("x,y,z", "three")}
"""Number of columns -> their names, and the number in words."""

_LEVELS = {"1": 1, "L": 255, "I;16": 65535, "I;16B": 65535, "I;16L": 65535, "I": 65535}
"""Mode of a grey image -> its white."""


_NO_IMAGE = (OSError, EOFError, SyntaxError, ValueError, struct.error, zlib.error)
"""What reading a PNG file that is cut, changed or none may raise."""


class Grid(NamedTuple):
    """Heights over a grid.

    Attributes:
        x, y: m, increasing, (n_x) and (n_y).
        z: m, (n_x, n_y).
    """

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray


class _Row(NamedTuple):
    line: int
    values: tuple[float, ...]


def read_heights(path: Path) -> tuple[np.ndarray, np.ndarray] | Grid:
    """Return x and z, m, of a CSV file with two columns, or the grid of one with three.

    Its first line is ``x,z`` or ``x,y,z`` or numbers already; comments follow ``#``. Rows x,z have increasing x; rows
    x,y,z are the points of a full grid in any order.

    Raises:
        GroundError: the file cannot be read or is no such table; the message names its line.
    """
    rows = _rows(path)
    if not rows or len(rows[0].values) == 2:
        return _profile(path, rows)
    return _grid(path, rows)


def read_image(path: Path, size: tuple[float, float], height: float, origin: tuple[float, float, float] | None) -> Grid:
    """Return the heights of a grey image, whose first row of pixels is that of the largest y.

    Args:
        path: of a PNG file with 8 or 16 bits a pixel.
        size: lengths along x and y between its outermost pixels, m.
        height: of white above black, m.
        origin: x and y of its lower left pixel and the height of black, m; default: its middle is at x = y = 0.

    Raises:
        GroundError: the file cannot be read or is no such image.
    """
    from PIL.PngImagePlugin import PngImageFile

    try:
        if fault := too_large(path, MAX_IMAGE_BYTES):
            raise GroundError(f"{path}: {fault}")
        with PngImageFile(path) as image:
            mode, (columns, rows) = image.mode, image.size
            if mode not in _LEVELS:
                raise GroundError(
                    f"{path.name} is an image of mode {mode}, expected a grey one with 8 or 16 bits a pixel"
                )
            if min(rows, columns) < 2 or rows * columns > MAX_POINTS:
                raise GroundError(
                    f"{path.name} has {columns} x {rows} pixels, expected at least 2 x 2 and at most "
                    f"{MAX_POINTS} in all"
                )
            pixels = np.asarray(image, dtype=float)
    except FileNotFoundError as error:
        raise GroundError(f"there is no file {path}{nearest_file(path)}") from error
    except _NO_IMAGE as error:
        raise GroundError(f"{path} cannot be read as an image, expected a grey PNG file") from error
    x, y, z = origin if origin is not None else (-size[0] / 2, -size[1] / 2, 0.0)
    heights = z + height * pixels[::-1].T / _LEVELS[mode]
    return Grid(x + np.linspace(0, size[0], columns), y + np.linspace(0, size[1], rows), heights)


def _rows(path: Path) -> list[_Row]:
    try:
        if fault := too_large(path, MAX_TABLE_BYTES):
            raise GroundError(f"{path}: {fault}")
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except FileNotFoundError as error:
        raise GroundError(f"there is no file {path}{nearest_file(path)}") from error
    except (OSError, UnicodeDecodeError) as error:
        raise GroundError(f"{path} cannot be read as text, expected a CSV file with columns x,z or x,y,z") from error
    columns, rows = 0, list[_Row]()
    for number, line in enumerate(lines, start=1):
        text = line.split("#", 1)[0].strip()
        if not text:
            continue
        cells = [cell.strip() for cell in next(csv.reader([text]))]
        if not columns and ",".join(cells) in (names for names, _ in _TABLES.values()):
            columns = len(cells)
            continue
        columns = columns or (len(cells) if len(cells) in _TABLES else 0)
        values = tuple(_number(cell) for cell in cells)
        if len(values) != columns or not all(map(math.isfinite, values)):
            raise GroundError(f"line {number} of {path.name} is '{text[:40]}', expected {_expected(columns, rows)}")
        rows.append(_Row(number, values))
    return rows


def _expected(columns: int, rows: list[_Row]) -> str:
    if not rows:
        return "numbers x,z or x,y,z in m or the header x,z or x,y,z"
    names, count = _TABLES[columns]
    return f"{count} numbers {names} in m"


def _profile(path: Path, rows: list[_Row]) -> tuple[np.ndarray, np.ndarray]:
    for before, row in itertools.pairwise(rows):
        if row.values[0] <= before.values[0]:
            raise GroundError(
                f"line {row.line} of {path.name} has x = {row.values[0]:g} after x = {before.values[0]:g}, expected x "
                "to increase"
            )
    if not 2 <= len(rows) <= MAX_PIECES - 2:
        raise GroundError(
            f"{path.name} has {len(rows)} rows, expected 2 to {MAX_PIECES - 2} rows x,z, or a grid of rows x,y,z"
        )
    x, z = np.array([row.values for row in rows]).T
    return x, z


def _grid(path: Path, rows: list[_Row]) -> Grid:
    if len(rows) > MAX_POINTS:
        raise GroundError(f"{path.name} has {len(rows)} rows x,y,z, expected at most {MAX_POINTS}")
    points = np.array([row.values for row in rows])
    (x, i), (y, j) = (_axis(points[:, column]) for column in (0, 1))
    if len(x) < 2 or len(y) < 2:
        raise GroundError(
            f"{path.name} has {len(x)} values of x and {len(y)} of y, expected a grid of at least 2 of each"
        )
    lines = np.zeros((len(x), len(y)), dtype=int)
    z = np.zeros((len(x), len(y)))
    for row, at in zip(rows, zip(i, j, strict=True), strict=True):
        if lines[at]:
            raise GroundError(
                f"line {row.line} of {path.name} gives the height at x = {x[at[0]]:g}, y = {y[at[1]]:g} again, after "
                f"line {lines[at]}, expected every point once"
            )
        lines[at], z[at] = row.line, row.values[2]
    if not lines.all():
        k, m = np.argwhere(lines == 0)[0]
        raise GroundError(
            f"{path.name} has no height at x = {x[k]:g}, y = {y[m]:g}, one of {np.count_nonzero(lines == 0)} that are "
            f"missing, expected a row x,y,z for each of its {len(x)} values of x with each of its {len(y)} values of y"
        )
    return Grid(x, y, z)


def _axis(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the different values, increasing, and which of them each value is."""
    order = np.argsort(values, kind="stable")
    new = np.append(True, np.diff(values[order]) > ROUNDED * np.abs(values).max())
    places = np.empty(len(values), dtype=int)
    places[order] = np.cumsum(new) - 1
    return values[order][new], places


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan
