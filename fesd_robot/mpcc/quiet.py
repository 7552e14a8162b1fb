"""HiGHS without the lines that it prints whatever its options say."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
import tempfile
import threading
from collections.abc import Iterator

_HIGHS_LINE = b"HighsMipSolverData::"
"""Begin of the lines: HiGHS names the function that prints."""

_lock = threading.Lock()


@contextlib.contextmanager
def silent_highs() -> Iterator[None]:
    """Leave out what HiGHS prints itself; all else that is written to stdout meanwhile is written at the end.

    Where HiGHS's presolve has turned a mixed-integer program into one whose solution misses the rows of the original by
    more than its tolerance, it solves a linear program for the continuous variables and prints ``HighsMipSolverData::
    transformNewIntegerFeasibleSolution tmpSolver.run();``, by `printf` and not by its log, so that no option prevents
    it. The line goes to file descriptor 1, which is therefore another file in the meantime.
    """
    with _lock, tempfile.TemporaryFile() as file:
        try:
            stdout = os.dup(1)
        except OSError:  # a process without stdout
            yield
            return
        _flush()
        os.dup2(file.fileno(), 1)
        try:
            yield
        finally:
            _flush()
            os.dup2(stdout, 1)
            os.close(stdout)
            file.seek(0)
            kept = b"".join(line for line in file if not line.startswith(_HIGHS_LINE))
            while kept:
                kept = kept[os.write(1, kept) :]


def _flush() -> None:
    """Write what Python and C keep back."""
    with contextlib.suppress(OSError, ValueError):
        sys.stdout.flush()
    ctypes.CDLL(None).fflush(None)
