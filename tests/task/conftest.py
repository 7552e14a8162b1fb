"""A complete, valid task to spoil, and a way to write it to a file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

BASE = """\
name: hop
robot:
  model: hopper.urdf
  root: fixed
  armature: {leg: 0.1}
  actuators:
    torque: {type: joint, joint: root_pitch, lower: -50, upper: 50}
    push:
      type: generalized_force
      force:
        root_x: -sin(root_pitch)
        leg: 1
      lower: -50
      upper: 50
ground:
  type: plane
  slope: 0.1
  friction: 0.45
contacts:
  foot:
    frame: foot
horizon:
  duration: 1.0
  intervals: 20
initial:
  configuration: {leg: 0.5}
goal:
  configuration:
    root_x: 1.0
  tolerance:
    configuration: {root_x: 0.01}
reference:
  type: jumps
  count: 1
  apex: {leg: 0.1}
costs:
  configuration: {root_x: 100}
  control: {push: 1e-2}
limits:
  position:
    leg: [0.1, 0.5]
  velocity: {leg: 5}
  speed_of_time: {lower: 0.1, upper: 20}
method:
  stages: 2
  formulation:
    baumgarte_gain: 30
  step_equilibration: {type: mean, weight: 1}
solver:
  tolerance: 1e-8
output:
  page: true
"""


@pytest.fixture
def base() -> str:
    return BASE


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str], Path]:
    def write_task(text: str) -> Path:
        path = tmp_path / "task.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write_task
