"""The joint between the world and the first link of a robot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import pinocchio as pin

from fesd_robot.errors import RobotError
from fesd_robot.robot.joints import FreeFlyer, Planar

Root = Literal["fixed", "sagittal", "planar", "free_flyer"]

ROOTS: tuple[Root, ...] = ("fixed", "sagittal", "planar", "free_flyer")

ROOT_JOINT = "root_joint"
"""Pinocchio's name for the joint under the first link."""

ROOT_HEIGHT, ROOT_PITCH = "root_z", "root_pitch"
"""Coordinates of a root that lift and tilt the whole robot."""

FLYER_HEIGHT = f"{ROOT_JOINT}.z"
"""Coordinate of a free flyer that lifts it."""

SAGITTAL_NAMES = ("root_x", ROOT_HEIGHT, ROOT_PITCH)
"""Coordinates of a sagittal root: forward, m, up, m, and nose down, rad about +y."""


PLANAR_VELOCITY_NAMES = (f"{ROOT_JOINT}.vx", f"{ROOT_JOINT}.vy", f"{ROOT_JOINT}.wz")
"""Velocity coordinates of a planar root: along the axes of what moves, m/s, and its turn, rad/s."""


def make_root_joint(root: Root) -> pin.JointModel | None:
    """Return the joint between the world and the first link, None for a fixed one."""
    if root == "planar":
        return pin.JointModelPlanar()
    if root == "free_flyer":
        return pin.JointModelFreeFlyer()
    if root == "sagittal":
        joint = pin.JointModelComposite()
        for part in (pin.JointModelPX(), pin.JointModelPZ(), pin.JointModelRY()):
            joint.addJoint(part)
        return joint
    return None


def root_height(names: Sequence[str]) -> str | None:
    """Return which of a robot's configuration coordinates lifts all of it, None if none does."""
    return next((name for name in (ROOT_HEIGHT, FLYER_HEIGHT) if name in names), None)


def is_height(name: str) -> bool:
    """Return whether a coordinate is the height of a sagittal root, of the robot or of a body beside it."""
    return name.rpartition(".")[2] == ROOT_HEIGHT


def changes_alone(name: str, velocity_names: Sequence[str], configuration_names: Sequence[str]) -> bool:
    """Return whether a configuration coordinate is a length or an angle that may change without others.

    Args:
        name: of the coordinate.
        velocity_names, configuration_names: of the robot; a place of a free flyer changes alone, its quaternion not.
    """
    joint, _, axis = name.rpartition(".")
    place = axis in ("x", "y", "z") and f"{joint}.qw" in configuration_names
    return name in velocity_names or (place and name in configuration_names)


def root_values(name: str, root: Root, pose: pin.SE3) -> dict[str, float]:
    """Return the configuration coordinates of a root joint with which the first link is at a pose.

    A root that keeps to a plane takes what of the pose is in it; a fixed one has no coordinates.

    Args:
        name: of the joint.
        root: its kind.
        pose: of the first link.
    """
    position, turn = pose.translation, pose.rotation
    if root == "fixed":
        return {}
    if root == "sagittal":
        pitch = math.atan2(-turn[2, 0], turn[0, 0])
        return dict(zip(SAGITTAL_NAMES, (float(position[0]), float(position[2]), pitch), strict=True))
    if root == "planar":
        yaw = math.atan2(turn[1, 0], turn[0, 0])
        suffixes, values = Planar.position_suffixes, [position[0], position[1], math.cos(yaw), math.sin(yaw)]
    else:
        suffixes, values = FreeFlyer.position_suffixes, pin.SE3ToXYZQUAT(pose).tolist()
    return {name + suffix: float(value) for suffix, value in zip(suffixes, values, strict=True)}


def refuse_second_root(path: Path, model: pin.Model, root: Root) -> None:
    """Raise if a file moves its first link itself although the model was built with a root joint.

    Raises:
        RobotError: for a free joint on the world, or on a root that carries nothing itself, and for a joint with the
            name of a sagittal coordinate; names the joint.
    """
    for index in range(1, model.njoints):
        name, parent = model.names[index], model.parents[index]
        on_root = parent == 0 or (model.names[parent] == ROOT_JOINT and model.inertias[parent].mass == 0.0)
        is_free = model.joints[index].shortname() == "JointModelFreeFlyer"
        if is_free and on_root and name != ROOT_JOINT:
            raise RobotError(f"{path} has its own free root joint '{name}'; set root to 'fixed' instead of '{root}'.")
        if root == "sagittal" and name in SAGITTAL_NAMES:
            raise RobotError(f"{path} has its own joint '{name}'; set root to 'fixed' instead of 'sagittal'.")
