"""A cart of 2 kg on a rail one metre above the ground, pushed with up to 3 N: motions in closed form."""

from __future__ import annotations

from pathlib import Path

from fesd_robot.contact import PhysicalMotion, recover
from fesd_robot.fesd import Transcription
from fesd_robot.mpcc import MpccSolution, solve
from fesd_robot.ocp import MotionProblem, formulate, transcribe
from fesd_robot.planner import homotopy_options
from fesd_robot.task import Task, load_task

MASS, FORCE = 2.0, 3.0

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


def cart(folder: Path, text: str) -> Task:
    """The task of a cart with these further keys."""
    (folder / "cart.urdf").write_text(URDF, encoding="utf-8")
    path = folder / "task.yaml"
    path.write_text(TASK + text, encoding="utf-8")
    return load_task(path)


def solved(task: Task) -> tuple[MotionProblem, Transcription, MpccSolution, PhysicalMotion]:
    """Solve a task and return its motion in physical time."""
    motion = formulate(task)
    transcription = transcribe(motion.ocp, motion.fesd)
    solution = solve(transcription.problem, homotopy_options(task))
    physical = recover(
        transcription.unpack(solution.w),
        motion.fesd.tableau,
        motion.mechanics,
        motion.contacts,
        motion.contact_system,
        motion.auxiliary_acceleration,
    )
    return motion, transcription, solution, physical
