"""The block on the slope is held by the least push that friction needs, which is known in closed form."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot.planning.planner import attempt
from fesd_robot.task import load_task

TASK = Path(__file__).parents[2] / "tasks" / "block_slope.yaml"


def test_the_least_push_holds_it() -> None:
    """m g (sin - mu cos) / (cos + mu sin) of the slope, to 1e-5 N; the block stays where it is."""
    plan = attempt(load_task(TASK, ["solver.effort=quick"]))
    assert plan.status.solved, plan.status.message
    sine, cosine = np.sin(0.4363), np.cos(0.4363)
    least = 2 * 9.81 * (sine - 0.4 * cosine) / (cosine + 0.4 * sine)
    assert plan.controls["push"] == pytest.approx(np.full(10, least), abs=1e-5)
    assert plan.trajectory.configuration["root_x"] == pytest.approx(np.zeros(len(plan.trajectory.time)), abs=1e-6)
