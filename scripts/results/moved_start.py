"""Solves from starts whose last bits differ, as on another processor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from fesd_robot.mpcc import Mpcc, MpccSolution
from fesd_robot.mpcc.polishing import BranchNlp
from fesd_robot.nlp import NlpPoint

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


def moved_branches(seed: int) -> Callable[[BranchNlp, np.ndarray], NlpPoint]:
    """Return `BranchNlp._start` with points that are moved by `MOVED`.

    Args:
        seed: of the generator.
    """
    start = BranchNlp._start

    def moved_start(nlp: BranchNlp, w: np.ndarray) -> NlpPoint:
        noise = np.random.default_rng(seed).uniform(-1, 1, len(w))
        return start(nlp, w + MOVED * noise * (1 + np.abs(w)))

    return moved_start
