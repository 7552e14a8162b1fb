"""Which joints of a robot with legs to lock and to couple so that it moves in the x-z plane."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from fesd_robot.errors import JointError
from fesd_robot.robot.couple import couple_joints
from fesd_robot.robot.lock import lock_joints
from fesd_robot.robot.tree import directions

_WRITTEN_AXIS = 1e-4
"""Entry of an axis that counts as zero: angles in files are written to a few digits."""

_IN_UNISON = 1e-4
"""m; joints this close in the x-z plane may move in unison."""


class SagittalProposal(NamedTuple):
    """Joints whose locks and couplings keep a robot in the x-z plane.

    Attributes:
        locked: name of a joint that leaves the plane -> value, m or rad, as near to zero as its limits allow.
        coupled: name of a joint -> name of the joint beside it that it moves in unison with.
    """

    locked: dict[str, float]
    coupled: dict[str, str]


def propose_sagittal(model: pin.Model) -> SagittalProposal:
    """Propose joints to lock and to couple so that a model moves in the x-z plane.

    Held are joints that turn about another axis than y, or slide along y, in the neutral configuration. Of the others
    those are coupled that are at one place in the plane, on bodies that move in unison, and that `couple_joints` takes.

    Args:
        model: with any root; joints with several degrees of freedom stay as they are.
    """
    data = model.createData()
    pin.forwardKinematics(model, data, pin.neutral(model))
    single = [j for j in range(1, model.njoints) if model.joints[j].nv == 1 and not _mimics(model, j)]
    leaves = [j for j in single if not _stays(model, data, j)]
    locked = {model.names[j]: _nearest_to_zero(model, j) for j in leaves}
    held = lock_joints(model, locked) if locked else model
    coupled: dict[str, str] = {}
    groups: list[list[int]] = []
    for joint in (j for j in single if j not in leaves):
        place = data.oMi[joint].translation[[0, 2]]
        beside = [own for own in groups if np.abs(data.oMi[own[0]].translation[[0, 2]] - place).max() <= _IN_UNISON]
        for own in beside:
            trial = {**coupled, model.names[joint]: model.names[own[0]]}
            if _couples(held, trial):
                coupled = trial
                own.append(joint)
                break
        else:
            groups.append([joint])
    return SagittalProposal(locked, coupled)


def _mimics(model: pin.Model, joint: int) -> bool:
    return bool(model.joints[joint].shortname() == "JointModelMimic")


def _stays(model: pin.Model, data: pin.Data, joint: int) -> bool:
    """Return whether the bodies that a joint carries stay in the plane."""
    linear, angular = directions(model.joints[joint])
    turn = data.oMi[joint].rotation
    about, along = turn @ angular, turn @ linear
    return bool(np.abs(about[[0, 2]]).max() <= _WRITTEN_AXIS and abs(along[1]) <= _WRITTEN_AXIS)


def _nearest_to_zero(model: pin.Model, joint: int) -> float:
    at = model.joints[joint].idx_q
    if model.joints[joint].nq > 1:
        return 0.0
    return float(np.clip(0.0, model.lowerPositionLimit[at], model.upperPositionLimit[at]))


def _couples(model: pin.Model, coupled: dict[str, str]) -> bool:
    try:
        couple_joints(model, coupled)
    except JointError:
        return False
    return True
