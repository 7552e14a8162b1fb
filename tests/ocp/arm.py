"""An arm with collision shapes of all kinds, and a task of it."""

from __future__ import annotations

from pathlib import Path

ARM = """\
<mujoco model="arm">
  <worldbody>
    <body name="post" pos="0 0 1.2">
      <geom name="post" type="box" size="0.05 0.05 0.1" mass="1"/>
      <body name="upper">
        <joint name="shoulder" axis="0 -1 0" range="-170 170" damping="0.1"/>
        <geom name="upper" type="capsule" fromto="0 0 0 0 0 -0.5" size="0.03" mass="1"/>
        <body name="lower" pos="0 0 -0.5">
          <joint name="elbow" axis="0 -1 0" range="-170 170" damping="0.1"/>
          <geom name="lower" type="capsule" fromto="0 0 -0.06 0.05 0 -0.5" size="0.02" mass="1"/>
          <geom name="knob" type="sphere" pos="0 0 -0.5" size="0.04" mass="0.1"/>
          <site name="tip" pos="0 0 -0.5"/>
          <body name="hand" pos="0 0 -0.5">
            <joint name="wrist" axis="0 -1 0" range="-90 90" damping="0.1"/>
            <geom name="ball" type="sphere" pos="0 0.02 -0.1" size="0.05" mass="0.2"/>
            <body name="tool" pos="0 0 -0.15">
              <geom name="plate" type="cylinder" size="0.06 0.01" mass="0.1"/>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor joint="shoulder" ctrlrange="-30 30"/><motor joint="elbow" ctrlrange="-20 20"/>
    <motor joint="wrist" ctrlrange="-5 5"/>
  </actuator>
</mujoco>
"""

TASK = """\
name: arm
robot: {model: arm.xml}
ground: {height: -1}
contacts: {tip: {frame: tip}}
horizon: {duration: 1, intervals: 5}
initial: {configuration: {shoulder: -0.8, elbow: 0.4}}
goal: {configuration: {shoulder: 0.8, elbow: -0.4}}
"""


def write_arm(folder: Path, constraints: str = "") -> Path:
    """Write model and task into a folder and return the task file."""
    (folder / "arm.xml").write_text(ARM, encoding="utf-8")
    task = folder / "arm.yaml"
    task.write_text(f"{TASK}constraints:\n{constraints}" if constraints else TASK, encoding="utf-8")
    return task
