"""Joints held at a value: the model without them."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pinocchio as pin

from fesd_robot.errors import JointError, nearest
from fesd_robot.exactness import ROUNDED


def lock_joints(model: pin.Model, locked: Mapping[str, float]) -> pin.Model:
    """Return the model with some joints held; the bodies they carry are fixed to their parents, all frames stay.

    Args:
        model: the model.
        locked: name of a joint with one degree of freedom -> value, m or rad.

    Raises:
        JointError: for an unknown name, a joint that cannot be held, and a value outside its limits.
    """
    step = np.zeros(model.nv)
    for name, value in locked.items():
        index = find_joint(model, name, "locked")
        if not math.isfinite(value):
            raise JointError(f"found {value}, expected a finite value of joint '{name}'", option="locked", joint=name)
        step[model.joints[index].idx_v] = value
    # A free root has no value to add here, so its neutral placement survives the integration.
    configuration = pin.integrate(model, pin.neutral(model), step)
    for name, value in locked.items():
        joint = model.joints[model.getJointId(name)]
        if joint.nq == 1:
            lower, upper = model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]
            if not lower - ROUNDED <= value <= upper + ROUNDED:
                raise JointError(
                    f"found {value:g}, expected a value in [{lower:g}, {upper:g}], the limits in the robot",
                    option="locked",
                    joint=name,
                )
    reduced = _reduced(model, [model.getJointId(name) for name in locked], configuration)
    if reduced.nv == 0:
        raise JointError("found every joint locked, expected one that moves", option="locked", joint=next(iter(locked)))
    return reduced


def _reduced(model: pin.Model, joints: list[int], configuration: np.ndarray) -> pin.Model:
    """Return Pinocchio's reduced model, also of one with several frames of one name, which Pinocchio refuses."""
    named, names = model.copy(), dict[str, str]()
    for index, frame in enumerate(named.frames):
        if frame.type != pin.FrameType.JOINT:
            names[f"{frame.name} {index}"] = frame.name
            frame.name = f"{frame.name} {index}"
    reduced = pin.buildReducedModel(named, joints, configuration)
    for frame in reduced.frames:
        frame.name = names.get(frame.name, frame.name)
    return reduced


def find_joint(model: pin.Model, name: str, option: str) -> int:
    """Return Pinocchio's index of a joint with one degree of freedom that no other joint copies.

    Raises:
        JointError: for an unknown name, a joint with several degrees of freedom, and one that another joint follows
            by <mimic>.
    """
    movable = [model.names[i] for i in range(1, model.njoints) if model.joints[i].nv == 1]
    if name not in movable:
        raise JointError(
            f"found '{name}', expected a joint of the model with one degree of freedom{nearest(name, movable)}",
            option=option,
            joint=name,
        )
    index = int(model.getJointId(name))
    for joint in model.joints:
        if joint.shortname() == "JointModelMimic" and joint.idx_v == model.joints[index].idx_v:
            raise JointError(
                f"found '{name}', which another joint follows by <mimic> in the model file, expected another joint",
                option=option,
                joint=name,
            )
    return index
