"""The state of a scene and that of a plan, one from the other."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
import pinocchio as pin

from fesd_robot.robot import Link, Robot

SUFFIXES: dict[str, tuple[tuple[str, str], ...]] = {
    "Translation": ((".x", "x"), (".y", "y"), (".z", "z")),
    "Planar": ((".x", "x"), (".y", "y"), (".theta", "z")),
}
"""Joint with several degrees of freedom that has no counterpart in MuJoCo -> those that it is made of there, by what
their names end with and their axes."""


def joint_names(link: Link) -> list[str]:
    """Return the names of the MuJoCo joints that a link moves on."""
    return [link.name + suffix for suffix, _ in SUFFIXES.get(type(link.joint).__name__, (("", ""),))]


@dataclass(frozen=True)
class _Place:
    """Where the coordinates of a link are."""

    link: Link
    kind: str
    q: slice
    v: slice
    qpos: slice
    qvel: slice


class Coordinates:
    """The maps between q, v of a plan and qpos, qvel of a scene.

    A free flyer's linear velocity is in the axes of its body in a plan and in those of the world in MuJoCo; its
    quaternion is x, y, z, w and w, x, y, z. A planar joint is two slides and a hinge. The angle of a joint whose q is a
    cosine and a sine is that between -pi and pi.

    Args:
        robot: of the plan.
        model: the scene's.
    """

    def __init__(self, robot: Robot, model: mujoco.MjModel) -> None:
        self._neutral, self._sizes = robot.neutral, (model.nq, model.nv, robot.model.nv)
        self._places = [_place(link, model) for link in robot.tree.links]
        self._plain = all(each.kind in ("Revolute", "Prismatic", "Translation") for each in self._places) and not any(
            each.link.mimics for each in self._places
        )
        own = [each for each in self._places if not each.link.mimics]
        if self._plain:
            self._q = np.concatenate([np.arange(each.qpos.start, each.qpos.stop) for each in own]).astype(int)
            self._v = np.concatenate([np.arange(each.qvel.start, each.qvel.stop) for each in own]).astype(int)
            self._at = np.concatenate([np.arange(each.q.start, each.q.stop) for each in own]).astype(int)
            self._along = np.concatenate([np.arange(each.v.start, each.v.stop) for each in own]).astype(int)

    def to_scene(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return qpos and qvel of the scene of a configuration, (n_q), and a velocity, (n_v), of the plan."""
        qpos = np.zeros(self._sizes[0])
        for each in self._places:
            own, kind = q[each.q], each.kind
            if each.link.mimics:
                qpos[each.qpos] = each.link.multiplier * own + each.link.offset
            elif kind == "UnboundedRevolute":
                qpos[each.qpos] = np.arctan2(own[1], own[0])
            elif kind == "Planar":
                qpos[each.qpos] = own[0], own[1], np.arctan2(own[3], own[2])
            elif kind == "Spherical":
                qpos[each.qpos] = own[[3, 0, 1, 2]]
            elif kind == "FreeFlyer":
                qpos[each.qpos] = own[[0, 1, 2, 6, 3, 4, 5]]
            else:
                qpos[each.qpos] = own
        return qpos, self.velocity_matrix(q) @ v

    def to_plan(self, qpos: np.ndarray, qvel: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return configuration, (n_q), and velocity, (n_v), of the plan; of joints that mimic others, nothing."""
        q, v = self._neutral.copy(), np.zeros(self._sizes[2])
        if self._plain:
            q[self._at], v[self._along] = qpos[self._q], qvel[self._v]
            return q, v
        for each in self._places:
            if each.link.mimics:
                continue
            own, speed, kind = qpos[each.qpos], qvel[each.qvel], each.kind
            if kind == "UnboundedRevolute":
                own = np.array([np.cos(own[0]), np.sin(own[0])])
            elif kind == "Planar":
                c, s = np.cos(own[2]), np.sin(own[2])
                own = np.array([own[0], own[1], c, s])
                speed = np.array([c * speed[0] + s * speed[1], -s * speed[0] + c * speed[1], speed[2]])
            elif kind == "Spherical":
                own = own[[1, 2, 3, 0]]
            elif kind == "FreeFlyer":
                own = own[[0, 1, 2, 4, 5, 6, 3]]
                speed = np.concatenate([_turn(own[3:]).T @ speed[:3], speed[3:]])
            q[each.q], v[each.v] = own, speed
        return q, v

    def velocity_matrix(self, q: np.ndarray) -> np.ndarray:
        """Return T(q) with qvel = T v, (nv of the scene, n_v); generalized forces go the other way, T^T qfrc = tau."""
        matrix = np.zeros((self._sizes[1], self._sizes[2]))
        for each in self._places:
            own, n = q[each.q], each.v.stop - each.v.start
            block = np.eye(n)
            if each.link.mimics:
                block = np.array([[each.link.multiplier]])
            elif each.kind == "Planar":
                block[:2, :2] = [[own[2], -own[3]], [own[3], own[2]]]
            elif each.kind == "FreeFlyer":
                block[:3, :3] = _turn(own[3:])
            matrix[each.qvel, each.v] += block
        return matrix

    def force(self, q: np.ndarray, generalized: np.ndarray) -> np.ndarray:
        """Return the forces on the joints of the scene, (nv of the scene), of those on the plan's coordinates, (n_v).

        T (T^T T)^-1 tau; the first one on joints that mimic others as on these.
        """
        if self._plain:
            result = np.zeros(self._sizes[1])
            result[self._v] = generalized[self._along]
            return result
        matrix = self.velocity_matrix(q)
        return np.asarray(matrix @ np.linalg.solve(matrix.T @ matrix, generalized))


def _place(link: Link, model: mujoco.MjModel) -> _Place:
    ids = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) for name in joint_names(link)]
    sizes = {mujoco.mjtJoint.mjJNT_FREE: (7, 6), mujoco.mjtJoint.mjJNT_BALL: (4, 3)}
    n_q, n_v = sizes.get(mujoco.mjtJoint(model.jnt_type[ids[0]]), (len(ids), len(ids)))
    at, along = int(model.jnt_qposadr[ids[0]]), int(model.jnt_dofadr[ids[0]])
    kind = type(link.joint).__name__
    return _Place(link, kind, link.q_indices, link.v_indices, slice(at, at + n_q), slice(along, along + n_v))


def _turn(quaternion: np.ndarray) -> np.ndarray:
    """Return the rotation of a unit quaternion x, y, z, w."""
    return np.asarray(pin.Quaternion(*quaternion[[3, 0, 1, 2]]).toRotationMatrix())
