"""Keyframes of a MuJoCo model as postures."""

from __future__ import annotations

from collections.abc import Collection, Iterator

import mujoco
import numpy as np

from fesd_robot.robot.joints import Spherical
from fesd_robot.robot.mjcf.bodies import pose_of
from fesd_robot.robot.mjcf.compiled import name_of
from fesd_robot.robot.root import ROOT_JOINT, Root, root_values


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
            pose = pose_of(qpos[at : at + 3], qpos[at + 3 : at + 7])
            yield from root_values(ROOT_JOINT if root_body is not None else name, own, pose).items()
        elif kind == kinds.mjJNT_BALL:
            for suffix, value in zip(Spherical.position_suffixes, _last_first(qpos[at : at + 4]), strict=True):
                yield name + suffix, float(value)
        elif name not in left_out:
            yield name, float(qpos[at])


def _last_first(quaternion: np.ndarray) -> list[float]:
    """Return x, y, z, w of w, x, y, z."""
    return [*quaternion[1:], quaternion[0]]
