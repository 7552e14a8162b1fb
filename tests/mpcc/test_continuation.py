"""Trials on a branch: what is kept of one that goes on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.mpcc import (
    TRIALS,
    BranchNlp,
    BranchSolver,
    HomotopyOptions,
    PairPolisher,
    PolishingReport,
    Run,
)
from fesd_robot.nlp import NlpPoint, NlpStatus

from .known import X, Y, mpcc


class At(NamedTuple):
    """A point, and its branch."""

    w: np.ndarray
    branch: Branch


PROBLEM = mpcc((X - 2) ** 2 + (Y - 1) ** 2, X, Y, [1, 1])


@pytest.mark.parametrize(
    ("violations", "costs", "kept"),
    [
        ((1e-5, 1e-2), (1, 1), 0),
        ((1e-5, np.nan), (1, 1), 0),
        ((1e-5, 1e-6), (1, 1), 1),
        ((5e-2, 1e-2), (1, 1), 1),
        ((1e-2, 1e-7), (1, 1), 1),
        ((3e-6, 1e-9), (16.6, 18.4), 0),
        ((3e-6, 1e-9), (16.6, 16.5), 1),
        ((1e-4, 1e-9), (16.6, 18.4), 1),
        ((3e-6, 1e-9), (16.6, np.nan), 0),
    ],
)
def test_a_trial_keeps_what_held_its_constraints_and_cost_less(
    monkeypatch: pytest.MonkeyPatch, violations: tuple[float, float], costs: tuple[float, float], kept: int
) -> None:
    """A trial that goes on and leaves its constraints, or to where it costs more, ends where it was before; one that
    was not near its constraints ends where it ends."""
    solver = BranchSolver(PROBLEM, PairPolisher(PROBLEM), Run(HomotopyOptions()))
    branch = Branch.of_pairs(PROBLEM.pair_labels, [ActiveFactor.G])
    ends = [
        _end(violation, cost, branch, at) for at, (violation, cost) in enumerate(zip(violations, costs, strict=True))
    ]
    coming: Iterator[PolishingReport] = iter(ends)
    monkeypatch.setattr(BranchNlp, "solve_once", lambda *_, **__: next(coming))
    assert solver.tried(At(PROBLEM.start, branch), TRIALS[0]) is ends[kept]


@pytest.mark.parametrize(("start", "nlps"), [((1e-3, 1.1), 1), ((1.0, 1.0), 2)], ids=["near", "far"])
def test_whole_steps_come_first_and_count_where_they_stay_near(start: tuple[float, float], nlps: int) -> None:
    """With x = 0 the minimum is (0, 1) at a cost of 4: one NLP from a point of that cost; where the cost was another
    one, the line search solves it again, and ends there as well."""
    solver = BranchSolver(PROBLEM, PairPolisher(PROBLEM), Run(HomotopyOptions()))
    branch = Branch.of_pairs(PROBLEM.pair_labels, [ActiveFactor.G])
    end = solver.exact(At(np.array(start), branch), near=True)
    assert end is not None and end.exact and len(solver.reports) == nlps
    np.testing.assert_allclose(end.w, [0.0, 1.0], atol=1e-6)


def _end(violation: float, cost: float, branch: Branch, at: int) -> PolishingReport:
    residuals = replace(PROBLEM.residuals(PROBLEM.start), constraint_violation=violation, objective=cost)
    w = PROBLEM.start + at
    return PolishingReport(
        NlpStatus.ITERATION_LIMIT, 40, 0.1, residuals, NlpPoint.without_multipliers(w, 0), branch, exact=False
    )
