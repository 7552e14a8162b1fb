"""A planned motion as states of the model of its file, in Pinocchio's order, with what touches where."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from fesd_robot.recovery.full_model import FullModel, acceleration_under
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.robot import Robot, continuous_quaternions


@dataclass(frozen=True)
class ModelMotion:
    """A motion along n samples of a model with all joints of its file; a robot that is not fixed has a free flyer.

    Attributes:
        robot: the model of the file, `robot.model` that of Pinocchio.
        configuration: Pinocchio's q, (n, n_q): of a free flyer position and quaternion x, y, z, w.
        velocity, acceleration: Pinocchio's v and a, (n, n_v): of a free flyer in the axes of its body.
        effort: of the motors, N or N m, (n, n_v); zero on a free flyer.
        feet: names of all feet.
        foot_position: where they touch in the world, m, (n, n_f, 3).
        foot_force: force on them in the axes of the world, N, (n, n_f, 3).
    """

    robot: Robot
    configuration: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    effort: np.ndarray
    feet: list[str]
    foot_position: np.ndarray
    foot_force: np.ndarray


def model_motion(
    full: FullModel,
    free: Robot,
    physics: NumericPhysics,
    samples: Sequence[tuple[np.ndarray, ...]],
    dry_friction: np.ndarray,
    efforts: Mapping[str, np.ndarray],
) -> ModelMotion:
    """Return a motion of the reduced robot as states of the model of its file.

    Args:
        full: the model with the task's root joint, and how the reduced robot moves it.
        free: the same model with a free flyer under its first link, or that of `full` if it is fixed.
        physics: of the reduced robot.
        samples: q_r, v_r, u and f, (n_c, rows), of every sample.
        dry_friction: of the reduced robot's joints, N or N m, (n, n_v).
        efforts: name of a joint with one degree of freedom -> effort, N or N m, (n,).
    """
    model, target = full.robot.model, free.model
    data, n = model.createData(), len(samples)
    q_all, v_all, a_all = np.empty((n, target.nq)), np.empty((n, target.nv)), np.empty((n, target.nv))
    place, force = np.empty((n, len(full.feet), 3)), np.empty((n, len(full.feet), 3))
    for k, (q_r, v_r, u, f) in enumerate(samples):
        a_r = acceleration_under(physics, q_r, v_r, u, f[: len(physics.friction)], dry_friction[k])
        q, v, a = full.configuration(q_r), full.velocity(v_r), full.velocity(a_r)
        if target is model:
            q_all[k], v_all[k], a_all[k] = q, v, a
        else:
            pin.forwardKinematics(model, data, q, v, a)
            _with_free_flyer(full, target, data, (q, v, a), (q_all[k], v_all[k], a_all[k]))
        place[k], axes = full.feet_at(q)
        force[k] = np.einsum("fa,fac->fc", full.forces_on_feet(f), axes)
    for entries in _quaternions(target):
        q_all[:, entries] = continuous_quaternions(q_all[:, entries])
    effort = np.zeros((n, target.nv))
    for name, values in efforts.items():
        if target.existJointName(name) and target.joints[target.getJointId(name)].nv == 1:
            effort[:, target.joints[target.getJointId(name)].idx_v] = values
    return ModelMotion(free, q_all, v_all, a_all, effort, full.feet, place, force)


def _with_free_flyer(
    full: FullModel,
    target: pin.Model,
    data: pin.Data,
    given: tuple[np.ndarray, np.ndarray, np.ndarray],
    result: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    """Write the state of the model with free flyers that move as the root joints of the task do."""
    model = full.robot.model
    roots = {model.names[index] for index in full.robot.root_joints}
    for index in range(1, target.njoints):
        name, own = target.names[index], target.joints[index]
        source = model.getJointId(name)
        if name in roots:
            result[0][own.idx_q : own.idx_q + 7] = pin.SE3ToXYZQUAT(data.oMi[source])
            result[1][own.idx_v : own.idx_v + 6] = data.v[source].vector
            result[2][own.idx_v : own.idx_v + 6] = data.a[source].vector
            continue
        other = model.joints[source]
        result[0][own.idx_q : own.idx_q + own.nq] = given[0][other.idx_q : other.idx_q + other.nq]
        for part in (1, 2):
            result[part][own.idx_v : own.idx_v + own.nv] = given[part][other.idx_v : other.idx_v + other.nv]


def _quaternions(model: pin.Model) -> list[slice]:
    """Return the entries of q that are quaternions."""
    sizes = {"JointModelFreeFlyer": 3, "JointModelSpherical": 0}
    starts = [joint.idx_q + sizes[joint.shortname()] for joint in model.joints if joint.shortname() in sizes]
    return [slice(start, start + 4) for start in starts]
