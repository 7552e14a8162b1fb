"""Pose and velocity of a floating base in the axes that other programs want."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from fesd_robot.recovery import ModelMotion


@dataclass(frozen=True)
class BaseState:
    """A body that floats along n samples.

    Attributes:
        joint: name of the free joint under it.
        body: name of the free body beside the robot that it is, None for a part of the robot.
        position: of its frame in the world, m, (n, 3).
        quaternion: w, x, y, z, (n, 4).
        velocity: of its frame's origin in the axes of the world, m/s, (n, 3).
        turning_in_world, turning_in_body: angular velocity, rad/s, (n, 3).
    """

    joint: str
    body: str | None
    position: np.ndarray
    quaternion: np.ndarray
    velocity: np.ndarray
    turning_in_world: np.ndarray
    turning_in_body: np.ndarray


def floating_bodies(motion: ModelMotion) -> list[BaseState]:
    """Return the bodies of a motion that a free flyer moves: parts of the robot, then free bodies beside it."""
    model, found = motion.robot.model, []
    for name, joint in zip(model.names, model.joints, strict=True):
        if joint.shortname() != "JointModelFreeFlyer":
            continue
        q = motion.configuration[:, joint.idx_q : joint.idx_q + 7]
        v = motion.velocity[:, joint.idx_v : joint.idx_v + 6]
        turns = np.array([pin.Quaternion(each[3:]).toRotationMatrix() for each in q])
        in_world = [np.einsum("nij,nj->ni", turns, part) for part in (v[:, :3], v[:, 3:])]
        body = motion.robot.body_of(name)
        found.append(BaseState(name, body, q[:, :3], q[:, [6, 3, 4, 5]], in_world[0], in_world[1], v[:, 3:]))
    return sorted(found, key=lambda state: state.body is not None)
