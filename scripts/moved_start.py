"""A homotopy from a start whose last bits differ, as on another processor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from fesd_robot.mpcc import Mpcc, MpccSolution

MOVED = 1e-12
"""By how much a start is moved, relative to one plus each variable's size."""


def moved(homotopy: Callable[..., MpccSolution], seed: int) -> Callable[..., MpccSolution]:
    """Return a homotopy from a start that is moved by `MOVED`.

    Args:
        homotopy: as `fesd_robot.mpcc.solve`.
        seed: of the generator.
    """

    def solve(problem: Mpcc, *arguments: Any, **named: Any) -> MpccSolution:
        noise = np.random.default_rng(seed).uniform(-1, 1, problem.size)
        start = problem.start + MOVED * noise * (1 + np.abs(problem.start))
        return homotopy(replace(problem, start=np.clip(start, problem.lower, problem.upper)), *arguments, **named)

    return solve
