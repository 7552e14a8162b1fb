"""Joints that an equality of a MuJoCo model lets follow another one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError
from fesd_robot.robot.followers import Follower, set_entries
from fesd_robot.robot.mjcf.compiled import name_of
from fesd_robot.robot.model_file import Spring


def joint_equalities(path: Path, model: mujoco.MjModel) -> list[Follower]:
    """Return the joints that follow others.

    MuJoCo's condition is ``q - q0 = c0 + c1 (p - p0) + c2 (p - p0)^2 + ...`` with the reference positions q0 and p0.

    Raises:
        RobotError: an equality that holds one joint only, or one that is not linear.
    """
    followers = []
    for index in range(model.neq):
        if not model.eq_active0[index] or model.eq_type[index] != mujoco.mjtEq.mjEQ_JOINT:
            continue
        name, other = name_of(model, "joint", int(model.eq_obj1id[index])), int(model.eq_obj2id[index])
        if other < 0:
            raise RobotError(
                f"{path}: found an equality that holds joint '{name}', expected it in the task's 'locked'."
            )
        leader, terms = name_of(model, "joint", other), model.eq_data[index][:5]
        if np.any(terms[2:]) or not terms[1]:
            raise RobotError(
                f"{path}: found polycoef {' '.join(f'{term:g}' for term in terms)} between joints '{name}' and "
                f"'{leader}', expected a line: only the first two numbers, the second not zero."
            )
        q0, p0 = (float(model.qpos0[model.jnt_qposadr[joint]]) for joint in (model.eq_obj1id[index], other))
        ratio, offset = float(terms[1]), q0 + float(terms[0]) - float(terms[1]) * p0
        if other > model.eq_obj1id[index]:  # Pinocchio lets later joints follow earlier ones
            name, leader, ratio, offset = leader, name, 1 / ratio, -offset / ratio
        followers.append(Follower(name, leader, ratio, offset))
    return followers


def move_to_leaders(
    path: Path, model: pin.Model, springs: Mapping[str, Spring], followers: Sequence[Follower]
) -> dict[str, Spring]:
    """Add motors, damping, armature and dry friction of joints that follow to their leaders, in place.

    Returns:
        springs by joint, those of followers on their leaders, too.

    Raises:
        RobotError: a leader that follows another joint itself, or a joint that follows two.
    """
    combined = dict(springs)
    for one in followers:
        follower, leader = model.getJointId(one.name), model.getJointId(one.leader)
        if any(one.leader == other.name or (one.name == other.name and one is not other) for other in followers):
            raise RobotError(
                f"{path}: found equalities that make joint '{one.name}' follow '{one.leader}' and a third joint, "
                "expected every joint to follow one that follows none."
            )
        v, w = model.joints[follower].idx_v, model.joints[leader].idx_v
        for name in ("armature", "damping"):
            values = getattr(model, name)
            set_entries(model, name, w, [values[w] + one.ratio**2 * values[v]])
        for name in ("lowerDryFrictionLimit", "upperDryFrictionLimit"):
            values = getattr(model, name)
            set_entries(model, name, w, [values[w] + abs(one.ratio) * values[v]])
        efforts = sorted(one.ratio * getattr(model, name)[v] for name in ("lowerEffortLimit", "upperEffortLimit"))
        set_entries(model, "lowerEffortLimit", w, [model.lowerEffortLimit[w] + efforts[0]])
        set_entries(model, "upperEffortLimit", w, [model.upperEffortLimit[w] + efforts[1]])
        if one.name in combined:
            own = combined.get(one.leader, Spring(0.0, 0.0))
            combined[one.leader] = own.and_follower(combined.pop(one.name), one.ratio, one.offset)
    return combined
