"""Write a first task for a URDF file of one's own, and plan it: an arm of two links lowers its tip to the ground.

`propose_first_task` finds the tip and both postures, as `fesd-robot new arm.urdf` does; the task is a file to edit.

The number: the height of the tip at the end by trigonometry, 0 m.
"""

from __future__ import annotations

from math import cos
from pathlib import Path

from fesd_robot import load_task, plan
from fesd_robot.first_task import propose_first_task

LENGTH = 0.2  # m, of both links


def link(name: str, mass: float) -> str:
    """Return a rod that hangs down from its joint, kg."""
    inertia = mass * LENGTH**2 / 12
    return f"""<link name="{name}"><inertial><origin xyz="0 0 {-LENGTH / 2}"/><mass value="{mass}"/>
      <inertia ixx="{inertia}" iyy="{inertia}" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>"""


def hinge(name: str, parent: str, child: str, below: float, limits: str) -> str:
    """Return a joint about y at a distance below that of its parent, m."""
    return f"""<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><axis xyz="0 1 0"/>
      <origin xyz="0 0 {-below}"/><limit {limits} velocity="20" effort="40"/></joint>"""


ARM = f"""<robot name="arm">
  <link name="stand"/> {link("upper", 0.4)} {link("lower", 0.2)} <link name="tip"/>
  {hinge("shoulder", "stand", "upper", 0.0, 'lower="-1.5" upper="1.5"')}
  {hinge("elbow", "upper", "lower", LENGTH, 'lower="-2.4" upper="-0.1"')}
  <joint name="end" type="fixed"><parent link="lower"/><child link="tip"/><origin xyz="0 0 {-LENGTH}"/></joint>
</robot>"""

Path("arm.urdf").write_text(ARM, encoding="utf-8")
_, text = propose_first_task("arm.urdf", Path())
Path("arm.yaml").write_text(text, encoding="utf-8")
print(text)

reach = plan(load_task("arm.yaml", ["solver.effort=quick"]))
print(reach.status.message)

angle = {name: values[-1] for name, values in reach.trajectory.configuration.items()}
height = -LENGTH * (cos(angle["shoulder"]) + cos(angle["shoulder"] + angle["elbow"]))
print(f"height of the tip at the end: {1e6 * height:.3f} um")
