"""A cart on a rail and a puck on the ground: robots whose motions have closed forms."""

from __future__ import annotations

from pathlib import Path

from fesd_robot.fesd import Transcription
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import MpccSolution, Run, solve
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.ocp.judged import physical_motion
from fesd_robot.ocp.solver_options import homotopy_options
from fesd_robot.recovery import PhysicalMotion
from fesd_robot.task import Task, load_task

MASS, FORCE = 2.0, 3.0
"""Of the cart, kg and N; its rail is one metre above the ground."""

URDF = """\
<robot name="cart">
  <link name="world"/>
  <link name="cart">
    <inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  </link>
  <joint name="x" type="prismatic">
    <parent link="world"/><child link="cart"/><origin xyz="0 0 1"/><axis xyz="1 0 0"/>
    <limit lower="-10" upper="10" velocity="20" effort="3"/>
  </joint>
</robot>
"""

TASK = """\
name: cart
robot: {model: cart.urdf}
contacts:
  wheel: {frame: cart, friction: 0}
method: {elements: 2}
"""


WHEEL = """\
  <link name="wheel">
    <inertial><mass value="0.1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  </link>
  <joint name="spin" type="revolute">
    <parent link="cart"/><child link="wheel"/><axis xyz="0 1 0"/>
    <limit lower="-9" upper="9" velocity="9" effort="0"/>
  </joint>
"""
"""A wheel on the cart that nothing turns."""

PUCK = """\
<robot name="puck">
  <link name="world"/>
  <link name="slide"/>
  <link name="puck">
    <inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  </link>
  <joint name="x" type="prismatic">
    <parent link="world"/><child link="slide"/><axis xyz="1 0 0"/>
    <limit lower="-10" upper="10" velocity="20" effort="30"/>
  </joint>
  <joint name="z" type="prismatic">
    <parent link="slide"/><child link="puck"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="10" velocity="20" effort="30"/>
  </joint>
</robot>
"""
"""One kilogram that slides on the ground without friction, pushed and lifted with up to 30 N."""


def puck(folder: Path, text: str, *, friction: float = 0.0) -> Task:
    """The task of a puck with these further keys."""
    (folder / "puck.urdf").write_text(PUCK, encoding="utf-8")
    path = folder / "task.yaml"
    head = f"name: puck\nrobot: {{model: puck.urdf}}\ncontacts: {{foot: {{frame: puck, friction: {friction:g}}}}}\n"
    path.write_text(head + text, encoding="utf-8")
    return load_task(path, ["method.grid=uniform"])


def cart(folder: Path, text: str, links: str = "") -> Task:
    """The task of a cart with these further keys, and further links in its model."""
    (folder / "cart.urdf").write_text(URDF.replace("</robot>", f"{links}</robot>"), encoding="utf-8")
    path = folder / "task.yaml"
    path.write_text(TASK + text, encoding="utf-8")
    return load_task(path, ["method.grid=uniform"])


def solved(task: Task) -> tuple[MotionProblem, Transcription, MpccSolution, PhysicalMotion]:
    """Solve a task and return its motion in physical time."""
    motion = formulate(task)
    transcription = Transcription(motion.ocp, motion.fesd)
    solution = solve(transcription.problem, Run(homotopy_options(task)))
    branch = BranchTranscription(transcription).branch(solution.w)
    physical = physical_motion(motion, transcription.unpack(solution.w), branch)
    return motion, transcription, solution, physical
