"""What the hopper's shipped tasks and the example of the README say about themselves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot.planner import plan
from fesd_robot.plans import Plan
from fesd_robot.task import load_task

from .conftest import HOPPER, ROOT

FIRST_HOP = f"""\
name: first_hop
robot:
  model: {HOPPER}
  armature: {{leg: 0.1}}
contacts:
  foot: {{frame: foot}}
horizon: {{duration: 1, intervals: 20}}
initial: {{configuration: {{leg: 0.5}}, stand_on: [foot]}}
goal: {{configuration: {{root_x: 0.5, leg: 0.5}}, stand_on: [foot]}}
"""
"""The README's ten lines; the model's path apart."""


def assert_one_hop(result: Plan, least: float) -> None:
    """Solved exactly, one flight of at least this length, m, hardly a slide, and there, at rest."""
    assert result.status.solved and result.status.exact, result.status.message
    assert result.outcome is not None
    foot = result.outcome.contacts["foot"]
    assert len(foot.flights) == 1 and foot.flights[0].length >= least and foot.flights[0].height > 0.05
    assert foot.slide_distance < 0.02
    assert all(entry.met for entry in result.outcome.goal)
    assert max(np.abs(values[-1]) for values in result.trajectory.velocity.values()) <= 0.01 + 1e-6


def test_the_hopper_one_jump() -> None:
    """The task to read first: it hops 0.8 m in one flight, lands without slipping, and comes to rest at its goal."""
    result = plan(load_task(ROOT / "tasks" / "hopper_one_jump.yaml"))
    assert_one_hop(result, 0.8)
    assert result.trajectory.configuration["root_x"][-1] == pytest.approx(1.0, abs=0.01 + 1e-6)


def test_the_first_hop(tmp_path: Path) -> None:
    """Ten lines without costs, reference or solver settings are a hop, at the first attempt."""
    (tmp_path / "task.yaml").write_text(FIRST_HOP, encoding="utf-8")
    result = plan(load_task(tmp_path / "task.yaml"))
    assert_one_hop(result, 0.4)
    assert [attempt.solved for attempt in result.statistics.attempts] == [True]
