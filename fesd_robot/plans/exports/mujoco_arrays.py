"""The motion as MuJoCo's qpos, qvel and ctrl, and the scene in which it runs."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from fesd_robot.errors import FesdRobotError
from fesd_robot.lazy import by_name
from fesd_robot.plans.exports.base_state import floating_bodies
from fesd_robot.plans.exports.format import ExportFormat
from fesd_robot.plans.plan import Plan
from fesd_robot.recovery import ModelMotion


def mujoco_arrays(plan: Plan, motion: ModelMotion) -> bytes:
    """Return an archive with time, (n,), qpos, (n, nq), qvel, (n, nv), ctrl, (n, nu), and joint_effort, (n, nv).

    They are in the order of the model that MuJoCo compiles of the robot's file. ``ctrl`` is what its motors need for
    the plan's efforts; an actuator whose ctrl is no force, as a position servo, has NaN, and ``joint_effort`` holds
    the forces on all joints for ``qfrc_applied``. Free bodies beside the robot are no part of that model: the poses of
    those that float are in ``NAME_position``, (n, 3), and ``NAME_quaternion``, w, x, y, z, (n, 4).

    Raises:
        FesdRobotError: a robot whose file is not MuJoCo's, or one to which the task gave a root that it does not have.
    """
    import mujoco  # takes long to import

    robot = motion.robot
    if robot.format != "mjcf":
        raise FesdRobotError(
            f"{plan.name}: found a robot of a {robot.format.upper()} file, {robot.source.name}, expected one of a "
            "MuJoCo file, whose order of joints is MuJoCo's; the format 'pinocchio' holds the motion of any robot"
        )
    model = mujoco.MjModel.from_xml_path(str(robot.source))
    n = len(plan.trajectory.time)
    qpos, qvel = np.tile(model.qpos0, (n, 1)), np.zeros((n, model.nv))
    effort, ctrl = np.zeros((n, model.nv)), np.full((n, model.nu), np.nan)
    floating, kinds = floating_bodies(motion), mujoco.mjtJoint
    bodies = [state for state in floating if state.body is None]
    arrays: dict[str, Any] = {"time": plan.trajectory.time}
    for state in floating:
        if state.body is not None:
            arrays |= {f"{state.body}_position": state.position, f"{state.body}_quaternion": state.quaternion}
    for joint in range(model.njnt):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, joint) or f"joint{joint}"
        at, along, kind = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint]), model.jnt_type[joint]
        if kind == kinds.mjJNT_FREE:
            if not bodies:
                raise FesdRobotError(f"{plan.name}: found a free joint '{name}' in {robot.source.name} that is held")
            body = next((each for each in bodies if each.joint == name), bodies[0])
            qpos[:, at : at + 7] = np.hstack([body.position, body.quaternion])
            qvel[:, along : along + 6] = np.hstack([body.velocity, body.turning_in_body])
            continue
        own = robot.model.joints[robot.model.getJointId(name)]
        if kind == kinds.mjJNT_BALL:
            qpos[:, at : at + 4] = motion.configuration[:, own.idx_q : own.idx_q + 4][:, [3, 0, 1, 2]]
            qvel[:, along : along + 3] = motion.velocity[:, own.idx_v : own.idx_v + 3]
            continue
        value = motion.configuration[:, own.idx_q : own.idx_q + own.nq]
        qpos[:, at] = value[:, 0] if own.nq == 1 else np.unwrap(np.arctan2(value[:, 1], value[:, 0]))
        qvel[:, along], effort[:, along] = motion.velocity[:, own.idx_v], motion.effort[:, own.idx_v]
    for index in range(model.nu):
        ctrl[:, index] = _control(model, index, effort)
    content = io.BytesIO()
    np.savez_compressed(
        content,
        qpos=qpos,
        qvel=qvel,
        ctrl=ctrl,
        joint_effort=effort,
        solved=np.array(plan.status.solved),
        **arrays,
    )
    return content.getvalue()


def mujoco_scene(plan: Plan, motion: ModelMotion) -> bytes:
    """Return the robot, ground, contacts and motors of a plan as a model of MuJoCo, in its XML, for any robot."""
    return bytes(by_name("fesd_robot.in_mujoco", "scene_file")(plan))


def _control(model: Any, index: int, effort: np.ndarray) -> np.ndarray | float:
    """Return the ctrl of a motor with a joint to itself, NaN of any other actuator, (n,)."""
    import mujoco

    joint = int(model.actuator_trnid[index][0])
    kinds = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
    same = (model.actuator_trntype == model.actuator_trntype[index]) & (model.actuator_trnid[:, 0] == joint)
    motor = (
        model.actuator_trntype[index] in [int(kind) for kind in kinds]
        and model.actuator_biastype[index] == mujoco.mjtBias.mjBIAS_NONE
        and model.actuator_gaintype[index] == mujoco.mjtGain.mjGAIN_FIXED
        and model.jnt_type[joint] in (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
        and same.sum() == 1
    )
    if not motor:
        return np.nan
    gear, gain = model.actuator_gear[index][0], model.actuator_gainprm[index][0]
    return np.asarray(effort[:, int(model.jnt_dofadr[joint])] / (gear * gain))


MUJOCO = ExportFormat(
    name="mujoco",
    stem="mujoco",
    content="qpos, qvel and ctrl as numpy arrays in the order of MuJoCo's model, for robots of MuJoCo files; in a file "
    ".xml the scene of any robot, with ground, contacts and motors",
    writers={".npz": mujoco_arrays, ".xml": mujoco_scene},
    model=True,
)
