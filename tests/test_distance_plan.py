"""A planned motion past an obstacle that its body would hit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin

from fesd_robot.ocp import load_task_robot
from fesd_robot.planning.planner import plan
from fesd_robot.plans import resampled
from fesd_robot.plans.body_distances import BodyDistances
from fesd_robot.plans.overlaps import LEAST_DEPTH
from fesd_robot.plans.report_text import report
from fesd_robot.robot import Robot
from fesd_robot.task import load_task
from fesd_robot.task.distances import DistanceConstraint

MODEL = """\
<mujoco model="arm">
  <worldbody>
    <body name="upper" pos="0 0 1.2">
      <joint name="shoulder" axis="0 -1 0" range="-170 170" damping="0.1"/>
      <geom name="upper" type="capsule" fromto="0 0 0 0 0 -0.5" size="0.03" mass="1"/>
      <body name="lower" pos="0 0 -0.5">
        <joint name="elbow" axis="0 -1 0" range="-170 170" damping="0.1"/>
        <geom name="lower" type="capsule" fromto="0 0 -0.06 0 0 -0.5" size="0.02" mass="1"/>
        <site name="tip" pos="0 0 -0.5"/>
        <body name="hook" pos="0 0 -0.62"><geom name="hook" type="sphere" size="0.05" mass="0.1"/></body>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="shoulder" ctrlrange="-30 30"/><motor joint="elbow" ctrlrange="-20 20"/></actuator>
</mujoco>
"""

TASK = """\
name: arm
robot: {model: arm.xml}
ground: {height: 0.25}
contacts: {tip: {frame: tip}}
horizon: {duration: 1, intervals: 5}
initial: {configuration: {shoulder: -0.8, elbow: 0.4}}
goal: {configuration: {shoulder: 0.8, elbow: -0.4}}
method: {elements: 2, accuracy: 1e-4}
solver: {effort: quick}
constraints:
  stone: {type: obstacle, body: lower, obstacle: {type: sphere, center: [0, 0, 0.2], radius: 0.1}, minimum: 0.01}
"""


def test_an_arm_swings_past_a_stone(tmp_path: Path) -> None:
    """The lower link keeps its distance at every stage and between them, to 1e-6 m, and comes as near as it may.

    A hook below the tip that no contact keeps above the ground goes through it: the plan says so, and how deep, and is
    solved all the same.
    """
    (tmp_path / "arm.xml").write_text(MODEL, encoding="utf-8")
    (tmp_path / "arm.yaml").write_text(TASK, encoding="utf-8")
    task, robot = load_task_robot(load_task(tmp_path / "arm.yaml", ["method.grid=uniform"]))
    stone = task.constraints["stone"]
    assert isinstance(stone, DistanceConstraint)
    measure = BodyDistances(robot, stone)
    found = plan(load_task(tmp_path / "arm.yaml", ["method.grid=uniform"]))
    assert found.status.solved, found.status.message
    assert found.audit.max_constraint_violation is not None and found.audit.max_constraint_violation <= 1e-6
    configuration = resampled(found, 1000).trajectory.configuration
    samples = np.column_stack([configuration[name] for name in robot.configuration_names])
    assert -1e-6 <= min(measure.least(q) for q in samples) - stone.minimum <= 1e-3
    hook = robot.frame_id("hook")
    deepest = max(0.25 + 0.05 - _height(robot, hook, q) for q in samples)
    (warning,) = found.warnings
    assert "body 'hook' is" in warning and warning in report(found) and deepest > LEAST_DEPTH
    depth = float(warning.partition("is ")[2].partition(" m below")[0])
    assert -1e-4 <= depth - deepest <= 3e-3  # it is measured between samples, too


def _height(robot: Robot, frame: int, q: np.ndarray) -> float:
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return float(data.oMf[frame].translation[2])
