"""Heights of the ground from a file."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np

from fesd_robot.contact.ground.profile import MAX_PIECES
from fesd_robot.errors import GroundError, nearest_file

COLUMNS = ["x", "z"]


def read_heights(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return x and z, m, of a CSV file with two columns, a first line ``x,z`` or none, and comments after ``#``.

    Raises:
        GroundError: the file cannot be read or is no such table; the message names its line.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except FileNotFoundError as error:
        raise GroundError(f"there is no file {path}{nearest_file(path)}") from error
    except (OSError, UnicodeDecodeError) as error:
        raise GroundError(f"{path} cannot be read as text, expected a CSV file with columns x,z") from error
    rows: list[tuple[float, float]] = []
    for number, line in enumerate(lines, start=1):
        text = line.split("#", 1)[0].strip()
        if not text:
            continue
        cells = [cell.strip() for cell in next(csv.reader([text]))]
        if not rows and cells == COLUMNS:
            continue
        row = [_number(cell) for cell in cells]
        if len(row) != 2 or not all(map(math.isfinite, row)):
            raise GroundError(
                f"line {number} of {path.name} is '{text[:40]}', expected two numbers x,z in m"
                + (" or the header x,z" if not rows else "")
            )
        if rows and row[0] <= rows[-1][0]:
            raise GroundError(
                f"line {number} of {path.name} has x = {row[0]:g} after x = {rows[-1][0]:g}, expected x to increase"
            )
        rows.append((row[0], row[1]))
    if not 2 <= len(rows) <= MAX_PIECES - 2:
        raise GroundError(f"{path.name} has {len(rows)} rows, expected 2 to {MAX_PIECES - 2} rows x,z")
    x, z = np.array(rows).T
    return x, z


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan
