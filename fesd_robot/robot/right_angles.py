"""Axes and angles of a model file that are along x, y or z up to the digits written."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from fesd_robot.exactness import LAST_BITS
from fesd_robot.robot.tree import directions

_ROUNDING = 1e-5
"""Entry of a unit vector that counts as zero, to the digits written: 1.5708 is a right angle, and 2e-8 0 1 is z."""

SQUARE_AXES = "The last digits of the axes of {}: entries up to 1e-05 are zero."

SQUARE_PLACEMENTS = "The last digits of the angles by which {} are placed: they are right angles."

_ALIGNED = {
    "RevoluteUnaligned": (pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ),
    "PrismaticUnaligned": (pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ),
    "RevoluteUnboundedUnaligned": (pin.JointModelRUBX, pin.JointModelRUBY, pin.JointModelRUBZ),
}
"""Joint about or along any axis -> those about or along x, y and z."""

_UNALIGNED = {
    "RevoluteUnaligned": pin.JointModelRevoluteUnaligned,
    "PrismaticUnaligned": pin.JointModelPrismaticUnaligned,
    "RevoluteUnboundedUnaligned": pin.JointModelRevoluteUnboundedUnaligned,
}


def square_axes(model: pin.Model) -> list[str]:
    """Set those entries of joint axes to zero that are zero to the digits of the file, in place.

    A robot stays in its plane only if its axes are exactly across; with an axis of 1e-7 1 0 a foot would leave it.

    Returns:
        names of the joints whose axes were changed.
    """
    changed = []
    for index in range(1, model.njoints):
        joint = model.joints[index]
        kind = joint.shortname().removeprefix("JointModel")
        if kind not in _ALIGNED:
            continue
        linear, angular = directions(joint)
        axis = linear + angular
        square = np.where(np.abs(axis) <= _ROUNDING, 0.0, axis)
        if np.abs(axis - square).max() <= LAST_BITS:
            continue
        square = square / np.linalg.norm(square)
        model.joints[index] = _joint_along(kind, square, joint)
        changed.append(model.names[index])
    return changed


def _joint_along(kind: str, axis: np.ndarray, joint: pin.JointModel) -> pin.JointModel:
    """Return a joint of a kind about or along an axis in the place of another joint."""
    aligned = [make() for unit, make in zip(np.eye(3), _ALIGNED[kind], strict=True) if np.array_equal(unit, axis)]
    made = aligned[0] if aligned else _UNALIGNED[kind](axis)
    made.setIndexes(joint.id, joint.idx_q, joint.idx_v)
    return pin.JointModel(made)


def square_placements(model: pin.Model) -> list[str]:
    """Turn joint placements that keep an axis, or all, but for the digits of the file, so that they do, in place.

    A leg stays in its plane only if its axes are exactly across; with an angle of 1.5708 rad a foot would leave it by
    micrometres.

    Returns:
        names of the joints that were turned.
    """
    turned = []
    for index in range(1, model.njoints):
        rotation = np.array(model.jointPlacements[index].rotation)
        square = _squared(rotation)
        if np.abs(rotation - square).max() > LAST_BITS:
            model.jointPlacements[index].rotation = square
            turned.append(model.names[index])
    return turned


def _squared(rotation: np.ndarray) -> np.ndarray:
    """Return the rotation whose axes that are along x, y or z to the digits written are exactly so, (3, 3)."""
    small = np.abs(rotation) <= _ROUNDING
    if np.abs(rotation[small]).max(initial=0.0) <= LAST_BITS:
        return rotation
    kept = [
        (row, column)
        for row in range(3)
        for column in range(3)
        if small[row].sum() == 2 and small[:, column].sum() == 2 and not small[row, column]
    ]
    if len(kept) == 3:
        return np.round(rotation) + 0.0
    if not kept:
        return rotation
    (row, column), square = kept[0], np.zeros((3, 3))
    square[row, column] = np.sign(rotation[row, column])
    others = np.ix_([k for k in range(3) if k != row], [k for k in range(3) if k != column])
    left, _, right = np.linalg.svd(rotation[others])
    square[others] = left @ right
    return square
