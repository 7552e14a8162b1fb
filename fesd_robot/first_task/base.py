"""The coordinates that carry all of a robot: how it moves as a whole."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from fesd_robot.robot import Robot

_ALONG = 0.99
"""Cosine from which a direction counts as that of an axis of the world."""


class Base(NamedTuple):
    """How a robot moves as a whole, in the x-z plane.

    Attributes:
        forward, up, pitch: coordinates along x, along z, m, and about y, rad; None without one.
        forward_sign, up_sign, pitch_sign: 1.0, or -1.0 for a coordinate that runs the other way.
        names: of all coordinates that carry the whole robot.
        free: whether one joint gives it six degrees of freedom.
    """

    forward: str | None = None
    up: str | None = None
    pitch: str | None = None
    forward_sign: float = 1.0
    up_sign: float = 1.0
    pitch_sign: float = 1.0
    names: tuple[str, ...] = ()
    free: bool = False


def base_of(robot: Robot) -> Base:
    """Return the coordinates of the joints above which there is no mass: they move all of the robot."""
    model, data = robot.model, robot.model.createData()
    pin.computeJointJacobians(model, data, robot.neutral)
    joints = list(_base_joints(model))
    if any(model.joints[j].nv == 6 for j in joints):
        return Base(names=tuple(_names(robot, joints)), free=True)
    found: dict[str, tuple[str, float]] = {}
    for joint in joints:
        # Pinocchio returns the matrix of a model with one coordinate as a vector.
        jacobian = pin.getJointJacobian(model, data, joint, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED).reshape(6, -1)
        start = model.joints[joint].idx_v
        for v in range(start, start + model.joints[joint].nv):
            linear, angular = jacobian[:3, v], jacobian[3:, v]
            name = robot.velocity_names[v]
            if np.linalg.norm(angular) > _ALONG:
                if abs(angular[1]) > _ALONG:
                    found.setdefault("pitch", (name, float(np.sign(angular[1]))))
            elif abs(linear[0]) > _ALONG:
                found.setdefault("forward", (name, float(np.sign(linear[0]))))
            elif abs(linear[2]) > _ALONG:
                found.setdefault("up", (name, float(np.sign(linear[2]))))
    forward, up, pitch = (found.get(way, (None, 1.0)) for way in ("forward", "up", "pitch"))
    return Base(
        forward=forward[0],
        up=up[0],
        pitch=pitch[0],
        forward_sign=forward[1],
        up_sign=up[1],
        pitch_sign=pitch[1],
        names=tuple(_names(robot, joints)),
    )


def _base_joints(model: pin.Model) -> Iterator[int]:
    masses = [inertia.mass for inertia in model.inertias]
    total = sum(masses)
    for joint in range(1, model.njoints):
        if sum(masses[j] for j in model.subtrees[joint]) >= total * (1 - 1e-12) > 0:
            yield joint


def _names(robot: Robot, joints: list[int]) -> Iterator[str]:
    for joint in joints:
        start = robot.model.joints[joint].idx_v
        yield from robot.velocity_names[start : start + robot.model.joints[joint].nv]


def leaf_joints(model: pin.Model) -> list[int]:
    """Return the joints that carry no other joint."""
    parents = {model.parents[joint] for joint in range(1, model.njoints)}
    return [joint for joint in range(1, model.njoints) if joint not in parents]
