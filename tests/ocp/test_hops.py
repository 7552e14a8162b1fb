"""The example of the README is a hop."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from fesd_robot.planning.planner import plan
from fesd_robot.task import load_task

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_the_first_hop(tmp_path: Path) -> None:
    """Ten lines are solved exactly at the first attempt: one flight, hardly a slide, and there and at rest."""
    (text,) = re.findall(r"```yaml\n(.+?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "task.yaml").write_text(text.replace("../models", str(ROOT / "models")), encoding="utf-8")
    result = plan(load_task(tmp_path / "task.yaml"))
    assert result.status.solved and result.status.exact, result.status.message
    assert [attempt.solved for attempt in result.statistics.attempts] == [True]
    assert result.outcome is not None
    foot = result.outcome.contacts["foot"]
    assert len(foot.flights) == 1 and foot.flights[0].length >= 0.4 and foot.flights[0].height > 0.05
    assert foot.slide_distance < 0.02
    assert all(entry.met for entry in result.outcome.goal) and len(result.outcome.goal) == 7
    assert max(np.abs(values[-1]) for values in result.trajectory.velocity.values()) <= 0.01 + 1e-6
