"""The linear solver for IPOPT's KKT systems: compiled, tried out, and named to IPOPT as an HSL library."""

from __future__ import annotations

import ctypes
import logging
import weakref
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import casadi
import numpy as np

from fesd_robot.errors import SolverError
from fesd_robot.native.compiler import CompilationError, instruction_set, shared_library

logger = logging.getLogger(__name__)

SOURCES = Path(__file__).parent / "kkt"
FLAGS = ("-std=c++17", "-O3", "-DNDEBUG")
RANK_DEFICIENT = 3
"""INFO(1) of MA27 for a matrix that is rank deficient."""
FORGOTTEN = -7
"""INFO(1) of a matrix whose analysis was given up, since more systems than the library keeps have come after it."""
STOP_EARLY = 29
"""Place in ICNTL that MA27 leaves free."""


class KktSystem:
    """A sparse symmetric system A x = b behind the calls that IPOPT makes.

    Args:
        row, column: indices of the entries of one triangle, from 0; equal ones are added up.
        order: number of rows n.
        library: from `kkt_library`.
    """

    def __init__(self, row: np.ndarray, column: np.ndarray, order: int, library: Path) -> None:
        self.order, self.entries = order, len(row)
        self._library = ctypes.CDLL(str(library))
        self._row = np.ascontiguousarray(np.asarray(row) + 1, dtype=np.int32)
        self._column = np.ascontiguousarray(np.asarray(column) + 1, dtype=np.int32)
        self._keep, self._ticket = np.zeros(3 * max(order, 1), np.int32), np.zeros(16, np.int32)
        self._info, self._values = np.zeros(20, np.int32), np.zeros(self.entries)
        self._analyse()

    def _analyse(self) -> None:
        steps, operations = ctypes.c_int(0), ctypes.c_double(0)
        self._library.ma27ad_(
            *self._pattern(), None, None, _at(self._keep), None, ctypes.byref(steps), None, None, None,
            _at(self._info), ctypes.byref(operations),
        )  # fmt: skip

    def factorize(self, values: np.ndarray, threshold: float = 1e-8, *, stop_early: bool = False) -> tuple[int, int]:
        """Return the rank and the number of negative eigenvalues of A with these entries, (entries).

        Args:
            threshold: of the pivots.
            stop_early: as IPOPT has it: once a system was solved that had one negative eigenvalue for each constraint,
                a factorization ends where it finds too many, and the number is the smallest too large one.
        """
        if self._factorize(values, threshold, stop_early) == FORGOTTEN:
            self._analyse()
            self._factorize(values, threshold, stop_early)
        rank = self._info[1] if self._info[0] == RANK_DEFICIENT else self.order
        return int(rank), int(self._info[14])

    def _factorize(self, values: np.ndarray, threshold: float, stop_early: bool) -> int:
        entries = self._values = np.array(values, dtype=float)
        control, front = np.array([threshold, 0, 0, 0, 0], dtype=float), ctypes.c_int(0)
        choices = np.zeros(30, np.int32)
        choices[STOP_EARLY] = stop_early
        self._library.ma27bd_(
            *self._pattern(), _at(entries), None, _at(self._ticket), None, _at(self._keep), None,
            ctypes.byref(front), None, _at(choices), _at(control), _at(self._info),
        )  # fmt: skip
        return int(self._info[0])

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Return A^-1 b, one solution without refinement, (n)."""
        x = np.array(right, dtype=float)
        size = ctypes.c_int(self.order)
        self._library.ma27cd_(
            ctypes.byref(size), _at(self._values), None, _at(self._ticket), None, None, None, _at(x), *4 * [None]
        )
        return x

    def _pattern(self) -> tuple[Any, ...]:
        sizes = (ctypes.c_int(self.order), ctypes.c_int(self.entries))
        return (*map(ctypes.byref, sizes), _at(self._row), _at(self._column))


class RepeatedKktSystem:
    """A sparse symmetric system A x = b that is factorised again and again in a loop, and held by its maker.

    Args:
        row, column: indices of the entries of one triangle, from 0; equal ones are added up.
        order: number of rows n.
        library: from `kkt_library`.
    """

    def __init__(self, row: np.ndarray, column: np.ndarray, order: int, library: Path) -> None:
        self.order, self.entries = order, len(row)
        own = self._library = ctypes.CDLL(str(library))
        own.kkt_begin.restype = ctypes.c_void_p
        rows, columns = (np.ascontiguousarray(np.asarray(each) + 1, dtype=np.int32) for each in (row, column))
        made = own.kkt_begin(ctypes.c_int(order), ctypes.c_int(len(row)), _at(rows), _at(columns))
        self._system = ctypes.c_void_p(made)
        self._values = np.zeros(self.entries)
        weakref.finalize(self, own.kkt_end, self._system)

    def factorize(self, values: np.ndarray, threshold: float = 1e-8) -> int | None:
        """Return the number of negative eigenvalues of A with these entries, (entries); None if it is singular.

        Args:
            threshold: of the pivots.
        """
        self._values = np.array(values, dtype=float)
        negative = int(self._library.kkt_factorize(self._system, _at(self._values), ctypes.c_double(threshold)))
        return None if negative < 0 else negative

    def settle(self) -> None:
        """Choose the order of elimination for the pivots of the last factorisation, and keep it from now on.

        The next thing to do is another factorisation.
        """
        self._library.kkt_settle(self._system)

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Return A^-1 b, one solution without refinement, (n)."""
        x = np.array(right, dtype=float)
        self._library.kkt_solve(self._system, _at(self._values), _at(x))
        return x


def _at(array: np.ndarray) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)


def build_library(variant: str = "kkt", flags: Sequence[str] = ()) -> Path:
    """Return the library compiled, or a variant of it by name with further flags of the compiler.

    Raises:
        CompilationError: no compiler, or it failed.
    """
    return shared_library(
        variant,
        sorted(SOURCES.glob("*.cpp")),
        [*FLAGS, *flags, instruction_set()],
        headers=sorted(SOURCES.glob("*.hpp")),
        folders=[Path(casadi.__file__).parent / "include" / "eigen3"],
    )


@cache
def kkt_library() -> Path | None:
    """Return our linear solver as a shared library with MA27's calling interface, or None if it cannot be had.

    It is compiled on first use and then tried on systems whose solution and inertia are known. Without a compiler, or
    if a trial fails, one line of the log says so.
    """
    try:
        library = build_library()
        self_test(library)
    except (CompilationError, SolverError, OSError) as error:
        logger.warning("IPOPT uses MUMPS, for our own linear solver is not available: %s", error)
        return None
    return library


def self_test(library: Path) -> None:
    """Try a library on a definite, an indefinite and a singular matrix.

    Raises:
        SolverError: a wrong solution, inertia or rank.
    """
    generator = np.random.default_rng(0)
    n, m = 40, 15
    row, column = np.tril_indices(n + m)
    for size, singular in ((n, False), (n + m, False), (n + m, True)):
        matrix = np.zeros((n + m, n + m))
        matrix[:n, :n] = np.diag(generator.uniform(1e-6, 1e3, n))
        matrix[n:, :n] = generator.normal(size=(m, n))
        if singular:
            matrix[-1, :n] = matrix[-2, :n]
        matrix[:n, n:] = matrix[n:, :n].T
        chosen = (row < size) & (column < size)
        system = KktSystem(row[chosen], column[chosen], size, library)
        rank, negative = system.factorize(matrix[row[chosen], column[chosen]])
        matrix = matrix[:size, :size]
        if singular:
            if rank == size and np.abs(matrix @ system.solve(np.ones(size)) - 1).max() < 1e-6:
                raise SolverError("the linear solver calls a singular matrix regular")
            continue
        right = generator.normal(size=size)
        x = system.solve(right)
        x += system.solve(right - matrix @ x)
        error = np.abs(right - matrix @ x).max() / (np.abs(matrix).max() * np.abs(x).max())
        if rank != size or negative != size - n or not error < 1e-12:
            raise SolverError(
                f"the linear solver failed its test: rank {rank} of {size}, {negative} negative eigenvalues instead of "
                f"{size - n}, error {error:.1e}"
            )
