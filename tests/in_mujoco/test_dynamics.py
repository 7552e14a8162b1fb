"""MuJoCo computes with the same masses, forces and gaps as Pinocchio."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from fesd_robot.errors import RobotError
from fesd_robot.in_mujoco import MujocoScene, mujoco_scene
from fesd_robot.ocp import MotionProblem, formulate, numeric_physics
from fesd_robot.task import load_task
from tests.in_mujoco.conftest import formulated

SHIPPED = ("hopper_one_jump", "solo12_jump", "solo12_jump_in_space", "biped_step", "gripper_lift", "ball_bat",
           "wheel_hills", "pick_and_place", "table_push", "cart_pole_friction")  # fmt: skip

ARM = """<robot name="arm">
  <link name="base">
    <inertial><origin xyz="0.01 0.02 0.03"/><mass value="3.0"/>
      <inertia ixx="0.03" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="upper">
    <inertial><origin xyz="0.1 0.02 -0.2"/><mass value="2.0"/>
      <inertia ixx="0.03" iyy="0.04" izz="0.02" ixy="0.001" ixz="0.002" iyz="-0.003"/></inertial></link>
  <link name="lower">
    <inertial><origin xyz="0 0.1 -0.1"/><mass value="1.0"/>
      <inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="finger">
    <inertial><origin xyz="0.01 0 0"/><mass value="0.2"/>
      <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="thumb">
    <inertial><origin xyz="0.02 0 0"/><mass value="0.1"/>
      <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="turn" type="continuous"><parent link="base"/><child link="upper"/><origin xyz="0 0 1" rpy="0.3 0.1 0"/>
    <axis xyz="0 1 0"/></joint>
  <joint name="bend" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 -0.4"/>
    <axis xyz="0.6 0 0.8"/><limit lower="-3" upper="3" effort="20" velocity="10"/><dynamics damping="0.3"/></joint>
  <joint name="finger" type="prismatic"><parent link="lower"/><child link="finger"/><origin xyz="0 0 -0.2"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="20" velocity="10"/></joint>
  <joint name="thumb" type="prismatic"><parent link="lower"/><child link="thumb"/><origin xyz="0 0 -0.2"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="20" velocity="10"/>
    <mimic joint="finger" multiplier="-0.5" offset="0.02"/></joint>
</robot>
"""

TASK = """name: arm
robot:
  model: arm.urdf
  root: {root}
  actuators:
    {actuators}
ground: {{type: plane, friction: 0.5, height: -3}}
contacts: {{tip: {{type: point, frame: finger}}}}
horizon: {{duration: 0.5, intervals: 5}}
goal: {{configuration: {{}}, soft: true}}
"""


def task_with(folder: Path, root: str, actuators: str) -> MotionProblem:
    (folder / "arm.urdf").write_text(ARM, encoding="utf-8")
    (folder / "arm.yaml").write_text(TASK.format(root=root, actuators=actuators), encoding="utf-8")
    return formulate(load_task(folder / "arm.yaml"), driven=False)


def random_state(motion: MotionProblem, seed: int) -> tuple[np.ndarray, np.ndarray]:
    robot, random = motion.robot, np.random.default_rng(seed)
    step = 0.5 * random.standard_normal(len(robot.velocity_names))
    return np.asarray(pin.integrate(robot.model, robot.neutral, step)), random.standard_normal(len(step))


def placed(scene: MujocoScene, q: np.ndarray, v: np.ndarray) -> mujoco.MjData:
    data = mujoco.MjData(scene.model)
    data.qpos[:], data.qvel[:] = scene.coordinates.to_scene(q, v)
    mujoco.mj_forward(scene.model, data)
    return data


def check_dynamics(motion: MotionProblem) -> None:
    """Compare mass matrices, bias forces and states, by qvel = T v: T^T M T, and T^T (c + M T' v)."""
    scene, physics, robot = mujoco_scene(motion), numeric_physics(motion), motion.robot
    for seed in range(5):
        q, v = random_state(motion, seed)
        data = placed(scene, q, v)
        back_q, back_v = scene.coordinates.to_plan(data.qpos, data.qvel)
        assert np.abs(pin.difference(robot.model, q, back_q)).max() < 1e-12
        assert np.abs(back_v - v).max() < 1e-12
        mass, turn, step = np.zeros((scene.model.nv,) * 2), scene.coordinates.velocity_matrix(q), 1e-6
        mujoco.mj_fullM(scene.model, data, mass)
        expected = physics.mass_matrix(q)
        assert np.abs(turn.T @ mass @ turn - expected).max() < 1e-9 * np.abs(expected).max()
        ahead, behind = (scene.coordinates.velocity_matrix(pin.integrate(robot.model, q, s * v)) for s in (step, -step))
        bias = turn.T @ (data.qfrc_bias + mass @ ((ahead - behind) / (2 * step) @ v))
        wanted = pin.rnea(robot.model, robot.model.createData(), q, v, 0 * v)
        assert np.abs(bias - wanted).max() < 1e-9 * np.abs(wanted).max()
        passive = -turn.T @ data.qfrc_passive
        assert np.abs(passive - physics.resistance(q, v)).max() < 1e-9 * (1 + np.abs(passive).max())


@pytest.mark.parametrize("name", SHIPPED)
def test_dynamics_of_shipped_robots(name: str) -> None:
    """Masses, Coriolis and gravity forces, damping and states are Pinocchio's, to 1e-9."""
    check_dynamics(formulated(name))


@pytest.mark.parametrize("root", ["fixed", "planar", "free_flyer"])
def test_dynamics_of_every_kind_of_joint(tmp_path: Path, root: str) -> None:
    """The same with a planar root, a free flyer, a joint without limits and one that mimics another."""
    check_dynamics(task_with(tmp_path, root, "bend: {type: joint, joint: bend}"))


@pytest.mark.parametrize("name", ["hopper_one_jump", "solo12_jump_in_space", "gripper_lift", "ball_bat", "puck_shot",
                                  "pick_and_place", "table_push", "block_slope", "double_pendulum_wall"])  # fmt: skip
def test_gaps(name: str) -> None:
    """Distances of the shapes of a contact, less the radius of a point, are its gap."""
    motion = formulated(name)
    scene, physics = mujoco_scene(motion), numeric_physics(motion)
    for seed in range(5):
        q, v = random_state(motion, seed)
        data, gaps = placed(scene, q, v), physics.gaps(q)
        for pair in range(scene.model.npair):
            first, second = int(scene.model.pair_geom1[pair]), int(scene.model.pair_geom2[pair])
            apart = mujoco.mj_geomDistance(scene.model, data, first, second, 100.0, None)
            assert apart - scene.model.pair_margin[pair] == pytest.approx(
                gaps[scene.pair_contacts[first, second]], abs=1e-9
            )


MOTORS = {
    "of one joint": "bend: {type: joint, joint: bend}",
    "of several": "both: {type: generalized_force, force: {turn: 1.0, bend: -2.5}, lower: -9, upper: 9}",
    "with a direction that turns": "push: {type: generalized_force, force: {bend: 'cos(bend)'}, lower: -9, upper: 9}",
    "of a root": "push: {type: generalized_force, force: {root_joint.vx: 1.0, bend: 2}, lower: -9, upper: 9}",
}


@pytest.mark.parametrize("kind", MOTORS)
def test_motors(tmp_path: Path, kind: str) -> None:
    """The generalized force of the controls is B(q) u, by motors, tendons, or forces on the joints."""
    motion = task_with(tmp_path, "free_flyer", MOTORS[kind])
    scene = mujoco_scene(motion)
    assert scene.model.nu == (1 if kind in ("of one joint", "of several") else 0)
    assert bool(scene.motors.note) == (scene.model.nu == 0)
    q, v = random_state(motion, 3)
    data = placed(scene, q, v)
    scene.motors.drive(data, scene.coordinates, np.array([1.5]))
    mujoco.mj_forward(scene.model, data)
    force = scene.coordinates.velocity_matrix(q).T @ (data.qfrc_actuator + data.qfrc_applied)
    assert force == pytest.approx(motion.actuation.numeric(q) @ np.array([1.5]), abs=1e-12)


def test_factors() -> None:
    """Masses are scaled, and so is friction, in the scene only."""
    motion = formulated("hopper_one_jump")
    plain, other = mujoco_scene(motion), mujoco_scene(motion, mass=1.1, friction=0.8)
    assert other.model.body_mass[1:].sum() == pytest.approx(1.1 * plain.model.body_mass[1:].sum())
    assert other.model.pair_friction[0, 0] == pytest.approx(0.8 * plain.model.pair_friction[0, 0])
    assert other.model.body_inertia[1:].sum() == pytest.approx(1.1 * plain.model.body_inertia[1:].sum())


def test_a_robot_that_mujoco_cannot_have(tmp_path: Path) -> None:
    """MuJoCo's words and the file are in the message."""
    motion = task_with(tmp_path, "free_flyer", "bend: {type: joint, joint: bend}")
    index = motion.robot.model.getJointId("bend")
    motion.robot.model.inertias[index] = pin.Inertia(1.0, np.zeros(3), np.diag([0.3, 0.02, 0.01]))
    with pytest.raises(RobotError, match=r"arm\.urdf: MuJoCo cannot read this robot: .*inertia"):
        mujoco_scene(motion)
