"""Bodies and joints of a MuJoCo model as a model of Pinocchio."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError
from fesd_robot.robot.followers import set_entries
from fesd_robot.robot.mjcf.compiled import disabled, name_of
from fesd_robot.robot.mjcf.drives import ForceRange
from fesd_robot.robot.root import ROOT_JOINT

_WORLD = 0
_NO_LIMIT = np.array([np.inf])


class _Place(NamedTuple):
    """The joint of Pinocchio that carries something, and its pose on it."""

    joint: int
    pose: pin.SE3


def pose_of(position: np.ndarray, quaternion: np.ndarray) -> pin.SE3:
    """Return a pose of MuJoCo: position, m, (3), and quaternion w, x, y, z, (4)."""
    w, x, y, z = quaternion
    return pin.SE3(pin.Quaternion(w, x, y, z).matrix(), np.array(position))


def root_body(path: Path, model: mujoco.MjModel) -> int:
    """Return the body that a root joint of the task is put under: the only one on the world that carries a joint.

    Raises:
        RobotError: none, several, or one that moves by joints of its own other than a free joint.
    """
    tops = [b for b in range(1, model.nbody) if model.body_parentid[b] == _WORLD and model.body_mocapid[b] < 0]
    trees = {int(model.body_rootid[model.jnt_bodyid[j]]) for j in range(model.njnt)}
    moving = [b for b in tops if b in trees] or tops
    if len(moving) != 1:
        names = ", ".join(f"'{name_of(model, 'body', b)}'" for b in moving)
        raise RobotError(
            f"{path}: found {len(moving)} bodies on the world that move ({names or 'none'}), expected one, the "
            "robot's first, for a root of the task; set root to 'fixed'."
        )
    return moving[0]


class _Builder:
    """Adds body after body; MuJoCo numbers parents before their children."""

    def __init__(self, model: mujoco.MjModel, root: int | None, joint: pin.JointModel | None) -> None:
        self.model, self.result = model, pin.Model()
        self.result.name = model.names.split(b"\0")[0].decode()
        self.result.gravity.linear = np.zeros(3) if disabled(model, "GRAVITY") else np.array(model.opt.gravity)
        self._root, self._root_joint = root, joint
        self._places = {_WORLD: _Place(0, pin.SE3.Identity())}
        self._frames = {_WORLD: 0}

    def add_body(self, body: int, efforts: Mapping[int, ForceRange]) -> None:
        model, result = self.model, self.result
        parent = self._places[model.body_parentid[body]]
        place = _Place(parent.joint, parent.pose * pose_of(model.body_pos[body], model.body_quat[body]))
        frame = self._frames[model.body_parentid[body]]
        if body == self._root:
            place = _Place(result.addJoint(0, self._root_joint, pin.SE3.Identity(), ROOT_JOINT), pin.SE3.Identity())
            frame = result.addJointFrame(place.joint, frame)
        first = model.body_jntadr[body]
        for joint in range(first, first + model.body_jntnum[body]):
            if body == self._root and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
                continue
            place = self._moved(place, joint, efforts.get(joint, ForceRange(0.0, 0.0)))
            frame = result.addJointFrame(place.joint, frame)
        if place.joint:
            result.appendBodyToJoint(place.joint, self._inertia(body), place.pose)
        self._places[body] = place
        self._frames[body] = result.addBodyFrame(name_of(model, "body", body), place.joint, place.pose, frame)

    def add_site(self, site: int) -> None:
        body = int(self.model.site_bodyid[site])
        place = self._places[body]
        pose = place.pose * pose_of(self.model.site_pos[site], self.model.site_quat[site])
        name = name_of(self.model, "site", site)
        self.result.addFrame(pin.Frame(name, place.joint, self._frames[body], pose, pin.FrameType.OP_FRAME), False)

    def _moved(self, place: _Place, joint: int, effort: ForceRange) -> _Place:
        """Add a joint to a body at a place, and return the place of the body behind it."""
        model, result = self.model, self.result
        name, v = name_of(model, "joint", joint), int(model.jnt_dofadr[joint])
        axis, kind = np.array(model.jnt_axis[joint]), model.jnt_type[joint]
        anchor = pin.SE3(np.eye(3), np.array(model.jnt_pos[joint]))
        damping = np.zeros(6) if disabled(model, "DAMPER") else np.array(model.dof_damping[v : v + 6])
        if kind == mujoco.mjtJoint.mjJNT_FREE:
            added = result.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), name)
            self._set_inertia_and_damping(added, model.dof_armature[v], damping)
            return _Place(added, pin.SE3.Identity())
        if kind == mujoco.mjtJoint.mjJNT_BALL:
            added = result.addJoint(place.joint, pin.JointModelSpherical(), place.pose * anchor, name)
            self._set_inertia_and_damping(added, model.dof_armature[v], damping)
            return _Place(added, anchor.inverse())
        reference = float(model.qpos0[model.jnt_qposadr[joint]])
        if kind == mujoco.mjtJoint.mjJNT_HINGE:
            moving, back = _turning(axis), pin.SE3(pin.exp3(-reference * axis), np.zeros(3))
        else:
            moving, back = _sliding(axis), pin.SE3(np.eye(3), -reference * axis)
        limits = model.jnt_range[joint] if model.jnt_limited[joint] else (-np.inf, np.inf)
        friction = np.zeros(1) if disabled(model, "FRICTIONLOSS") else np.array([model.dof_frictionloss[v]])
        added = result.addJoint(
            place.joint,
            moving,
            place.pose * anchor * back,
            name,
            np.array([effort.lower]),
            np.array([effort.upper]),
            -_NO_LIMIT,
            _NO_LIMIT,
            np.array([limits[0]]),
            np.array([limits[1]]),
            -friction,
            friction,
            damping[:1],
        )
        self._set_inertia_and_damping(added, model.dof_armature[v], damping)
        return _Place(added, anchor.inverse())

    def _set_inertia_and_damping(self, joint: int, armature: float, damping: np.ndarray) -> None:
        added = self.result.joints[joint]
        set_entries(self.result, "armature", added.idx_v, np.full(added.nv, armature))
        set_entries(self.result, "damping", added.idx_v, damping[: added.nv])

    def _inertia(self, body: int) -> pin.Inertia:
        model = self.model
        axes = pose_of(model.body_ipos[body], model.body_iquat[body])
        about = axes.rotation @ np.diag(model.body_inertia[body]) @ axes.rotation.T
        return pin.Inertia(float(model.body_mass[body]), axes.translation, about)


def build_bodies(
    model: mujoco.MjModel, efforts: Mapping[int, ForceRange], root: int | None, root_joint: pin.JointModel | None
) -> pin.Model:
    """Return Pinocchio's model of MuJoCo's: the same bodies, joints, sites, and values q of the joints.

    Joints of one body follow one another, as in MuJoCo, with bodies without mass between them. The coordinates are
    MuJoCo's ``qpos`` and ``qvel``, but for free joints: their quaternion is x, y, z, w, and their linear velocity is in
    axes of the body.

    Args:
        model: of MuJoCo.
        efforts: number of a joint -> the forces that its motors can give.
        root: number of the body under which the root joint is put, in place of a free joint, None for no root.
        root_joint: that joint.
    """
    builder = _Builder(model, root, root_joint)
    for body in range(1, model.nbody):
        builder.add_body(body, efforts)
    for site in range(model.nsite):
        builder.add_site(site)
    return builder.result


def _turning(axis: np.ndarray) -> pin.JointModel:
    kinds = (pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ)
    return _along(axis, kinds) or pin.JointModelRevoluteUnaligned(axis)


def _sliding(axis: np.ndarray) -> pin.JointModel:
    kinds = (pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ)
    return _along(axis, kinds) or pin.JointModelPrismaticUnaligned(axis)


def _along(axis: np.ndarray, kinds: tuple[type, ...]) -> pin.JointModel | None:
    for unit, kind in zip(np.eye(3), kinds, strict=True):
        if np.array_equal(axis, unit):
            return kind()
    return None
