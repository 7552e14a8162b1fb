"""Ranges: up to where the package computes, which tasks are held to before anything is computed."""

from __future__ import annotations

import stat
from pathlib import Path

MAX_STAGES = 9
"""Most stages of a Runge-Kutta scheme."""

STEEPEST = 20.0
"""Largest |dh/dx| of a ground: a face of 87 degrees. Steeper ones are walls, whose normals are exact."""

MAX_VARIABLES = 300_000
"""Most variables of the nonlinear program of a motion; the solver needs some kB for each."""

MAX_TASK_BYTES = 300_000
"""Largest task file; those of a hundred lines have four thousand, and a hundred thousand take a second to read."""

MAX_TABLE_BYTES = 20_000_000
"""Largest table of a motion, of controls or of heights: some million numbers."""

MAX_IMAGE_BYTES = 20_000_000
"""Largest image, as of heights or of a texture."""


def too_large(file: Path, most: int) -> str:
    """Return what is found and expected of a file that is not to be read, nothing of one that is.

    Args:
        file: that there is.
        most: bytes.

    Raises:
        OSError: there is no such file, or its size is not to be known.
    """
    status = file.stat()
    if not stat.S_ISREG(status.st_mode):
        return "found no regular file, expected one"
    if status.st_size > most:
        return f"found {status.st_size / 1e6:.4g} MB, expected at most {most / 1e6:g} MB"
    return ""
