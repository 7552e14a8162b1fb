"""Keyframes of a MuJoCo model as postures."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator

import mujoco
import numpy as np

from fesd_robot.robot.joints import FreeFlyer, Planar, Spherical
from fesd_robot.robot.mjcf.bodies import pose_of
from fesd_robot.robot.mjcf.compiled import name_of
from fesd_robot.robot.root import ROOT_JOINT, SAGITTAL_NAMES, Root


def read_keyframes(
    model: mujoco.MjModel, root: Root, root_body: int | None, left_out: Collection[str]
) -> dict[str, dict[str, float]]:
    """Return the positions of all keyframes by name, and those of the file itself as ``qpos0``.

    Args:
        model: of MuJoCo.
        root: joint that a task puts under the robot; it has the pose that its free joint has in the keyframe.
        root_body: number of the body under which it is put.
        left_out: names of joints that have no coordinate.

    Returns:
        name -> name of a configuration coordinate -> m or rad; keyframes without name are called ``key0``, ``key1`` ...
    """
    frames = {"qpos0": np.array(model.qpos0)}
    for key in range(model.nkey):
        frames[str(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_KEY, key) or f"key{key}")] = model.key_qpos[key]
    return {name: dict(_values(model, qpos, root, root_body, left_out)) for name, qpos in frames.items()}


def _values(
    model: mujoco.MjModel, qpos: np.ndarray, root: Root, root_body: int | None, left_out: Collection[str]
) -> Iterator[tuple[str, float]]:
    kinds = mujoco.mjtJoint
    for joint in range(model.njnt):
        name, at, kind = name_of(model, "joint", joint), int(model.jnt_qposadr[joint]), model.jnt_type[joint]
        if kind == kinds.mjJNT_FREE:
            own = root if root_body is not None and model.jnt_bodyid[joint] == root_body else "free_flyer"
            yield from _root_values(ROOT_JOINT if root_body is not None else name, own, qpos[at : at + 7])
        elif kind == kinds.mjJNT_BALL:
            yield from _named(name, Spherical.position_suffixes, _last_first(qpos[at : at + 4]))
        elif name not in left_out:
            yield name, float(qpos[at])


def _root_values(name: str, root: Root, qpos: np.ndarray) -> Iterator[tuple[str, float]]:
    """Yield the coordinates of a root at a pose of a free joint, (7)."""
    position, turn = qpos[:3], pose_of(qpos[:3], qpos[3:]).rotation
    if root == "sagittal":
        pitch = math.atan2(-turn[2, 0], turn[0, 0])
        yield from zip(SAGITTAL_NAMES, (float(position[0]), float(position[2]), pitch), strict=True)
    elif root == "planar":
        yaw = math.atan2(turn[1, 0], turn[0, 0])
        yield from _named(name, Planar.position_suffixes, [position[0], position[1], math.cos(yaw), math.sin(yaw)])
    else:
        yield from _named(name, FreeFlyer.position_suffixes, [*position, *_last_first(qpos[3:])])


def _named(name: str, suffixes: tuple[str, ...], values: Collection[float]) -> Iterator[tuple[str, float]]:
    yield from ((name + suffix, float(value)) for suffix, value in zip(suffixes, values, strict=True))


def _last_first(quaternion: np.ndarray) -> list[float]:
    """Return x, y, z, w of w, x, y, z."""
    return [*quaternion[1:], quaternion[0]]
