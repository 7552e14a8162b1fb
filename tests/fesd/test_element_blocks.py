"""Stages and elements as blocks of their own are the same problem as within their intervals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot.fesd import Transcription, element_blocks
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import Mpcc
from fesd_robot.ocp import formulate
from fesd_robot.task import load_task

TASKS = Path(__file__).parents[2] / "tasks"


def _made(name: str, least: int, monkeypatch: pytest.MonkeyPatch) -> BranchTranscription:
    monkeypatch.setattr(element_blocks, "LARGE_INTERVALS", least)
    motion = formulate(load_task(TASKS / f"{name}.yaml", ["method.grid=uniform", "horizon.intervals=4"]))
    made = BranchTranscription(Transcription(motion.ocp, motion.fesd))
    assert made.transcription.element_blocks == (least == 1)
    return made


def _rows(problem: Mpcc, w: np.ndarray) -> dict[str, float]:
    values = {}
    for block in problem.blocks:
        _, g, _, _ = block.evaluate(w)
        for copy in range(block.copies):
            for row, value in enumerate(g[:, copy]):
                values[str(block.constraint_label(row, copy))] = float(value)
    return values


@pytest.mark.parametrize("name", ["hopper_in_space", "biped_step", "block_slope"])
def test_the_same_cost_rows_and_pairs(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Cost, dynamics, and both sides of every condition agree at a random point."""
    within, own = (_made(name, least, monkeypatch).transcription.problem for least in (10**9, 1))
    w = within.start + np.random.default_rng(1).uniform(0.1, 0.5, within.size)
    costs = [sum(float(block.evaluate(w)[0].sum()) for block in problem.blocks) for problem in (within, own)]
    assert costs[0] == pytest.approx(costs[1], rel=1e-12)
    assert _rows(within, w) == pytest.approx(_rows(own, w), rel=1e-10, abs=1e-11)
    sides = [
        dict(
            zip(
                problem.pair_labels, np.column_stack([_side(problem, w, 2), _side(problem, w, 3)]).tolist(), strict=True
            )
        )
        for problem in (within, own)
    ]
    assert sides[0].keys() == sides[1].keys()
    for label, values in sides[0].items():
        assert values == pytest.approx(sides[1][label], rel=1e-10, abs=1e-11), label


def _side(problem: Mpcc, w: np.ndarray, output: int) -> np.ndarray:
    return np.concatenate([block.evaluate(w)[output].ravel(order="F") for block in problem.blocks])


@pytest.mark.parametrize("name", ["hopper_in_space", "biped_step"])
def test_a_branch_holds_the_same(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bounds on variables agree, and the rows that a branch holds have the same values at a random point."""
    within, own = (_made(name, least, monkeypatch) for least in (10**9, 1))
    w = within.transcription.problem.start
    branch = within.branch(w)
    moved, found = w + np.random.default_rng(2).uniform(0.1, 0.5, len(w)), []
    for made in (within, own):
        bounds = made.bounds(branch)
        g = np.concatenate([block.evaluate(moved)[1].ravel(order="F") for block in made.problem.blocks])
        held = np.isfinite(bounds.g_lower) | np.isfinite(bounds.g_upper)
        order = np.lexsort((bounds.g_upper[held], bounds.g_lower[held], np.round(g[held], 7)))
        found.append((bounds, [part[held][order] for part in (g, bounds.g_lower, bounds.g_upper)]))
    (one, rows), (other, others) = found
    assert (one.lower == other.lower).all() and (one.upper == other.upper).all()
    assert rows[0] == pytest.approx(others[0], rel=1e-10, abs=1e-10)
    assert (rows[1] == others[1]).all() and (rows[2] == others[2]).all()
