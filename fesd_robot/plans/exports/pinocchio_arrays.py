"""The motion as Pinocchio's vectors q, v and a."""

from __future__ import annotations

import io

import numpy as np

from fesd_robot.plans.exports.format import ExportFormat
from fesd_robot.plans.plan import Plan
from fesd_robot.recovery import ModelMotion


def pinocchio_arrays(plan: Plan, motion: ModelMotion) -> bytes:
    """Return an archive with time, (n,), q, (n, n_q), v, a and tau, (n, n_v), and the feet.

    They are in the order of the model that Pinocchio builds of the robot's file, with ``JointModelFreeFlyer`` if the
    robot is not fixed: locked and coupled joints have their place. ``joint_names`` are those of the model but the
    universe, those of free bodies follow with the name of the body in front, as Pinocchio's ``appendModel`` puts them
    together; ``foot_position`` and ``foot_force``, (n, n_f, 3), are in the world.
    """
    content = io.BytesIO()
    np.savez_compressed(
        content,
        time=plan.trajectory.time,
        q=motion.configuration,
        v=motion.velocity,
        a=motion.acceleration,
        tau=motion.effort,
        joint_names=np.array(list(motion.robot.model.names)[1:]),
        foot_names=np.array(motion.feet),
        foot_position=motion.foot_position,
        foot_force=motion.foot_force,
        solved=np.array(plan.status.solved),
    )
    return content.getvalue()


PINOCCHIO = ExportFormat(
    name="pinocchio",
    stem="pinocchio",
    content="q, v, a and tau as numpy arrays in the order of Pinocchio's model of the robot's file, with a free flyer "
    "if it is not fixed",
    writers={".npz": pinocchio_arrays},
    model=True,
)
