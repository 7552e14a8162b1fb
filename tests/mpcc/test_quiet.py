"""HiGHS prints nothing on the way to a certificate, and nobody else's words are lost."""

from __future__ import annotations

import ctypes
import os
import sys
import time

import numpy as np
import pytest
from scipy import sparse

from fesd_robot.mpcc.lpcc import Lpcc
from fesd_robot.mpcc.quiet import silent_highs

TALKATIVE = 207
"""A seed of `lpcc_with` at whose solution HiGHS repairs what its presolve did to the rows, and says so."""


def lpcc_with(seed: int) -> Lpcc:
    """Return an LPCC with rows of sizes from 1e-4 to 1e4."""
    random = np.random.default_rng(seed)
    n, m, k = random.integers(4, 40), random.integers(3, 30), random.integers(3, 20)
    rows = random.normal(size=(m, n)) * (random.random((m, n)) < 0.4) * 10.0 ** random.integers(-4, 5, size=(m, 1))
    sides = random.normal(size=(2 * k, n)) * (random.random((2 * k, n)) < 0.5)
    sides *= 10.0 ** random.integers(-3, 4, size=(2 * k, 1))
    random.normal(size=n)
    equal = random.random(m) < 0.5
    row_high = np.where(equal, 0.0, random.random(m))
    cost = random.normal(size=n)
    free = np.full(2 * k, np.inf)
    return Lpcc(
        cost=cost,
        low=-np.ones(n),
        high=np.ones(n),
        matrix=sparse.csr_array(np.vstack([rows, sides])),
        row_low=np.concatenate([np.where(equal, 0.0, -np.inf), -free]),
        row_high=np.concatenate([row_high, free]),
        sides=m + np.arange(2 * k).reshape(2, k),
    )


def test_a_mixed_integer_program_prints_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    """A program whose solution HiGHS has to repair after its presolve is solved without a line on stdout or stderr."""
    _, zero = lpcc_with(TALKATIVE).mixed_integer(time.perf_counter() + 60)
    ctypes.CDLL(None).fflush(None)
    assert zero is not None
    assert capfd.readouterr() == ("", "")


def test_only_the_lines_of_highs_are_left_out(capfd: pytest.CaptureFixture[str]) -> None:
    """What Python, C, or the file descriptor itself get meanwhile appears in its order, also when something fails."""
    libc = ctypes.CDLL(None)
    sys.stdout.write("before\n")
    with pytest.raises(KeyError), silent_highs():
        sys.stdout.write("from Python\n")
        sys.stdout.flush()
        libc.printf(b"HighsMipSolverData::transformNewIntegerFeasibleSolution tmpSolver.run();\n")
        libc.printf(b"from C\n")
        libc.fflush(None)
        os.write(1, b"from the system\n")
        raise KeyError
    sys.stdout.write("after\n")
    assert capfd.readouterr().out.splitlines() == ["before", "from Python", "from C", "from the system", "after"]
