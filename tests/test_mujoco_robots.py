"""Robots of MuJoCo files from the task to the audited plan."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fesd_robot import load_task, plan

SLED = """
<mujoco>
  <worldbody>
    <body name="sled">
      <joint name="x" type="slide" axis="1 0 0" stiffness="80" springref="0.2" damping="1"/>
      <joint name="z" type="slide" axis="0 0 1"/>
      <geom type="box" size="0.1 0.1 0.05" mass="2"/>
    </body>
  </worldbody>
  <actuator><motor joint="x" gear="5" ctrlrange="-1 1"/></actuator>
  <keyframe><key name="released" qpos="0 0.05"/></keyframe>
</mujoco>
"""

TASK = """
name: sled
robot: {model: sled.xml}
ground: {friction: 0.2}
contacts:
  runner: {frame: sled, offset: [0, 0, -0.05]}
horizon: {duration: 0.6, intervals: 8}
initial: {posture: released}
goal: {configuration: {x: 0.3}}
solver: {effort: quick}
"""


@pytest.fixture
def sled(tmp_path: Path):
    """The plan of a sled on rough ground that a spring and a weak motor pull."""
    (tmp_path / "sled.xml").write_text(SLED)
    (tmp_path / "task.yaml").write_text(TASK)
    return plan(load_task(tmp_path / "task.yaml"))


def test_a_spring_moves_the_plan_and_its_replay(sled):
    """Friction, spring, damping and motor balance the planned acceleration at every sample, and the audit agrees."""
    assert sled.status.solved, sled.status.message
    assert sled.trajectory.configuration["z"] == pytest.approx([0.05] * len(sled.trajectory.time), abs=1e-6)
    x, v = (np.array(part["x"]) for part in (sled.trajectory.configuration, sled.trajectory.velocity))
    stored = 40 * (x - 0.2) ** 2 + v**2
    start, end = stored[0], stored[-1]
    assert start == pytest.approx(40 * 0.2**2) and end == pytest.approx(40 * 0.1**2, abs=0.1)
    # The spring's 8 N alone overcome 0.2 * 2 kg * 9.81 m/s2 at the start: the motor of 5 N could never do so to 0.3 m.
    assert max(sled.controls["x"]) <= 5 + 1e-6 and x.max() >= 0.29
    assert sled.audit.max_energy_error <= 1e-4 and sled.audit.max_replay_velocity_error <= 1e-3
