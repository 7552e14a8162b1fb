"""The joints: what each one adds to the placement, the velocity and the configuration of its body.

A joint is a motion (R, p) of its body relative to the placement on the parent, and a constant motion subspace in body
coordinates, exactly as in Pinocchio: the joint velocity of a planar or free-flying joint is LOCAL.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import casadi as ca
import numpy as np

from fesd_robot.orientations import QUATERNION
from fesd_robot.robot import rotations
from fesd_robot.robot.algebra import clean


class Joint(Protocol):
    """A joint between a parent and its body.

    Attributes:
        position_suffixes: what distinguishes the entries of q, appended to the joint's name; its length is nq.
        velocity_suffixes: the same for v; its length is nv.
        origin_fixed_in_parent: whether the body's origin stays where it is on the parent.
        directions_fixed_in_parent: whether the motion subspace is also constant as seen from the parent.
        unit_entries: indices of the entries of q that are cosines, sines or quaternion components.
    """

    @property
    def position_suffixes(self) -> tuple[str, ...]: ...

    @property
    def velocity_suffixes(self) -> tuple[str, ...]: ...

    @property
    def origin_fixed_in_parent(self) -> bool: ...

    @property
    def directions_fixed_in_parent(self) -> bool: ...

    @property
    def unit_entries(self) -> tuple[int, ...]: ...

    def subspace(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the linear and the angular rows (each 3 × nv) of the motion subspace in body coordinates."""

    def motion(self, rotation: ca.DM, translation: ca.DM, q: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Return (R, p) of the body in its parent, for a joint placed at (rotation, translation) on the parent."""

    def derivative(self, q: ca.SX, v: ca.SX) -> ca.SX:
        """Return dq/dt for the joint velocity v."""

    def integrate(self, q: ca.SX, dv: ca.SX) -> ca.SX:
        """Return q ⊕ dv."""

    def difference(self, q0: ca.SX, q1: ca.SX) -> ca.SX:
        """Return the dv with q0 ⊕ dv = q1."""


class _Linear:
    """The configuration space of joints whose q simply adds up."""

    unit_entries: ClassVar[tuple[int, ...]] = ()

    def derivative(self, q: ca.SX, v: ca.SX) -> ca.SX:
        return v

    def integrate(self, q: ca.SX, dv: ca.SX) -> ca.SX:
        return q + dv

    def difference(self, q0: ca.SX, q1: ca.SX) -> ca.SX:
        return q1 - q0


def _rotate_about(axis: np.ndarray, rotation: ca.DM, cos: ca.SX, sin: ca.SX) -> ca.SX:
    """Return rotation · (a aᵀ + cos (1 − a aᵀ) + sin [a]×); for an aligned axis only four entries are not constant."""
    along = np.outer(axis, axis)
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    placed = np.array(rotation.full())
    return ca.SX(clean(placed @ along)) + cos * clean(placed @ (np.eye(3) - along)) + sin * clean(placed @ skew)


@dataclass(frozen=True, eq=False)
class Revolute(_Linear):
    """Rotation about a fixed unit axis; q is the angle, rad."""

    axis: np.ndarray
    position_suffixes: ClassVar[tuple[str, ...]] = ("",)
    velocity_suffixes: ClassVar[tuple[str, ...]] = ("",)
    origin_fixed_in_parent: ClassVar[bool] = True
    directions_fixed_in_parent: ClassVar[bool] = True

    def subspace(self) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros((3, 1)), self.axis.reshape(3, 1)

    def motion(self, rotation: ca.DM, translation: ca.DM, q: ca.SX) -> tuple[ca.SX, ca.SX]:
        return _rotate_about(self.axis, rotation, ca.cos(q), ca.sin(q)), ca.SX(translation)


@dataclass(frozen=True, eq=False)
class UnboundedRevolute:
    """Rotation about a fixed unit axis without limits; q = (cos, sin)."""

    axis: np.ndarray
    position_suffixes: ClassVar[tuple[str, ...]] = (".cos", ".sin")
    velocity_suffixes: ClassVar[tuple[str, ...]] = ("",)
    origin_fixed_in_parent: ClassVar[bool] = True
    directions_fixed_in_parent: ClassVar[bool] = True
    unit_entries: ClassVar[tuple[int, ...]] = (0, 1)

    def subspace(self) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros((3, 1)), self.axis.reshape(3, 1)

    def motion(self, rotation: ca.DM, translation: ca.DM, q: ca.SX) -> tuple[ca.SX, ca.SX]:
        return _rotate_about(self.axis, rotation, q[0], q[1]), ca.SX(translation)

    def derivative(self, q: ca.SX, v: ca.SX) -> ca.SX:
        return ca.vertcat(-q[1] * v, q[0] * v)

    def integrate(self, q: ca.SX, dv: ca.SX) -> ca.SX:
        return rotations.planar_matrix(q) @ ca.vertcat(ca.cos(dv), ca.sin(dv))

    def difference(self, q0: ca.SX, q1: ca.SX) -> ca.SX:
        relative = rotations.planar_matrix(q0).T @ q1
        return ca.atan2(relative[1], relative[0])


@dataclass(frozen=True, eq=False)
class Prismatic(_Linear):
    """Translation along a fixed unit axis; q is the distance, m."""

    axis: np.ndarray
    position_suffixes: ClassVar[tuple[str, ...]] = ("",)
    velocity_suffixes: ClassVar[tuple[str, ...]] = ("",)
    origin_fixed_in_parent: ClassVar[bool] = False
    directions_fixed_in_parent: ClassVar[bool] = True

    def subspace(self) -> tuple[np.ndarray, np.ndarray]:
        return self.axis.reshape(3, 1), np.zeros((3, 1))

    def motion(self, rotation: ca.DM, translation: ca.DM, q: ca.SX) -> tuple[ca.SX, ca.SX]:
        return ca.SX(rotation), translation + clean(rotation.full() @ self.axis) * q


@dataclass(frozen=True)
class Translation(_Linear):
    """Translation in space; q = (x, y, z), m."""

    position_suffixes: ClassVar[tuple[str, ...]] = (".x", ".y", ".z")
    velocity_suffixes: ClassVar[tuple[str, ...]] = (".vx", ".vy", ".vz")
    origin_fixed_in_parent: ClassVar[bool] = False
    directions_fixed_in_parent: ClassVar[bool] = True

    def subspace(self) -> tuple[np.ndarray, np.ndarray]:
        return np.eye(3), np.zeros((3, 3))

    def motion(self, rotation: ca.DM, translation: ca.DM, q: ca.SX) -> tuple[ca.SX, ca.SX]:
        return ca.SX(rotation), translation + rotation @ q


@dataclass(frozen=True)
class Spherical:
    """Rotation about a point; q is a unit quaternion (x, y, z, w), v the angular velocity in the body, rad/s."""

    position_suffixes: ClassVar[tuple[str, ...]] = QUATERNION
    velocity_suffixes: ClassVar[tuple[str, ...]] = (".wx", ".wy", ".wz")
    origin_fixed_in_parent: ClassVar[bool] = True
    directions_fixed_in_parent: ClassVar[bool] = False
    unit_entries: ClassVar[tuple[int, ...]] = (0, 1, 2, 3)

    def subspace(self) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros((3, 3)), np.eye(3)

    def motion(self, rotation: ca.DM, translation: ca.DM, q: ca.SX) -> tuple[ca.SX, ca.SX]:
        return rotation @ rotations.quaternion_matrix(q), ca.SX(translation)

    def derivative(self, q: ca.SX, v: ca.SX) -> ca.SX:
        return rotations.quaternion_product(q, ca.vertcat(v, ca.SX(1, 1))) / 2

    def integrate(self, q: ca.SX, dv: ca.SX) -> ca.SX:
        return rotations.quaternion_product(q, rotations.quaternion_exponential(dv))

    def difference(self, q0: ca.SX, q1: ca.SX) -> ca.SX:
        relative = rotations.quaternion_product(rotations.quaternion_conjugate(q0), q1)
        return rotations.quaternion_logarithm(relative)


@dataclass(frozen=True)
class Planar:
    """Motion in the x-y plane of the placement; q = (x, y, cos θ, sin θ), v = (vx, vy, ω) in the body."""

    position_suffixes: ClassVar[tuple[str, ...]] = (".x", ".y", ".cos", ".sin")
    velocity_suffixes: ClassVar[tuple[str, ...]] = (".vx", ".vy", ".wz")
    origin_fixed_in_parent: ClassVar[bool] = False
    directions_fixed_in_parent: ClassVar[bool] = False
    unit_entries: ClassVar[tuple[int, ...]] = (2, 3)

    def subspace(self) -> tuple[np.ndarray, np.ndarray]:
        return np.diag([1.0, 1.0, 0.0]), np.diag([0.0, 0.0, 1.0])

    def motion(self, rotation: ca.DM, translation: ca.DM, q: ca.SX) -> tuple[ca.SX, ca.SX]:
        turned = _rotate_about(np.array([0.0, 0.0, 1.0]), rotation, q[2], q[3])
        return turned, translation + rotation[:, :2] @ q[:2]

    def derivative(self, q: ca.SX, v: ca.SX) -> ca.SX:
        return ca.vertcat(rotations.planar_matrix(q[2:]) @ v[:2], -q[3] * v[2], q[2] * v[2])

    def integrate(self, q: ca.SX, dv: ca.SX) -> ca.SX:
        turn = rotations.planar_matrix(q[2:])
        shift = rotations.planar_exponential_translation(dv[:2], dv[2])
        return ca.vertcat(q[:2] + turn @ shift, turn @ ca.vertcat(ca.cos(dv[2]), ca.sin(dv[2])))

    def difference(self, q0: ca.SX, q1: ca.SX) -> ca.SX:
        back = rotations.planar_matrix(q0[2:]).T
        relative = back @ q1[2:]
        angle = ca.atan2(relative[1], relative[0])
        return ca.vertcat(rotations.planar_logarithm_translation(back @ (q1[:2] - q0[:2]), angle), angle)


@dataclass(frozen=True)
class FreeFlyer:
    """Free motion in space; q = (x, y, z, quaternion (x, y, z, w)), v = (linear, angular) velocity in the body."""

    position_suffixes: ClassVar[tuple[str, ...]] = (".x", ".y", ".z", *QUATERNION)
    velocity_suffixes: ClassVar[tuple[str, ...]] = (".vx", ".vy", ".vz", ".wx", ".wy", ".wz")
    origin_fixed_in_parent: ClassVar[bool] = False
    directions_fixed_in_parent: ClassVar[bool] = False
    unit_entries: ClassVar[tuple[int, ...]] = (3, 4, 5, 6)

    def subspace(self) -> tuple[np.ndarray, np.ndarray]:
        return np.eye(3, 6), np.eye(3, 6, 3)

    def motion(self, rotation: ca.DM, translation: ca.DM, q: ca.SX) -> tuple[ca.SX, ca.SX]:
        return rotation @ rotations.quaternion_matrix(q[3:]), translation + rotation @ q[:3]

    def derivative(self, q: ca.SX, v: ca.SX) -> ca.SX:
        return ca.vertcat(rotations.quaternion_matrix(q[3:]) @ v[:3], Spherical().derivative(q[3:], v[3:]))

    def integrate(self, q: ca.SX, dv: ca.SX) -> ca.SX:
        shift = rotations.rigid_exponential_translation(dv[:3], dv[3:])
        return ca.vertcat(q[:3] + rotations.quaternion_matrix(q[3:]) @ shift, Spherical().integrate(q[3:], dv[3:]))

    def difference(self, q0: ca.SX, q1: ca.SX) -> ca.SX:
        angular = Spherical().difference(q0[3:], q1[3:])
        shift = rotations.quaternion_matrix(q0[3:]).T @ (q1[:3] - q0[:3])
        return ca.vertcat(rotations.rigid_logarithm_translation(shift, angular), angular)
