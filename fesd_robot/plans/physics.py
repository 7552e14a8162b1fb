"""Pinocchio's numeric algorithms at one sample of a trajectory: what the audit compares with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from fesd_robot.contact import Ground
from fesd_robot.robot import Robot


@dataclass(frozen=True)
class ContactPoint:
    """A contact as the audit sees it: its name, the frame whose origin touches, its friction coefficient."""

    name: str
    frame: str
    friction: float


class NumericPhysics:
    """Dynamics and contact kinematics by Pinocchio's own algorithms, independent of the planner's expressions.

    Args:
        robot: the robot with its armature and damping.
        ground: signed distance.
        contacts: points that may touch.
        control_matrix: q -> B, (n_v, n_u).

    Attributes:
        friction: coefficient of every contact, (n_c).
        damping: viscous damping of every joint, the diagonal of D, N s/m or N m s/rad, (n_v).
    """

    def __init__(
        self,
        robot: Robot,
        ground: Ground,
        contacts: Sequence[ContactPoint],
        control_matrix: Callable[[np.ndarray], np.ndarray],
    ) -> None:
        self._model = robot.model
        self._data = robot.model.createData()
        self._frames = [robot.frame_id(contact.frame) for contact in contacts]
        self._ground = ground
        self._control_matrix = control_matrix
        self.damping = np.array(robot.model.damping)
        self.friction = np.array([contact.friction for contact in contacts])

    def mass_matrix(self, q: np.ndarray) -> np.ndarray:
        """M(q) with armature, (n_v, n_v)."""
        upper = np.triu(pin.crba(self._model, self._data, q))
        return np.asarray(upper + np.triu(upper, 1).T)

    def gaps(self, q: np.ndarray) -> np.ndarray:
        """Signed distance of every contact, m, (n_c)."""
        pin.framesForwardKinematics(self._model, self._data, q)
        return np.array([float(self._ground.distance(self._data.oMf[frame].translation)) for frame in self._frames])

    def contact_jacobian(self, q: np.ndarray) -> np.ndarray:
        """Rows J_n, J_t of every contact, (2 n_c, n_v)."""
        pin.computeJointJacobians(self._model, self._data, q)
        pin.updateFramePlacements(self._model, self._data)
        rows = []
        for frame in self._frames:
            jacobian = pin.getFrameJacobian(self._model, self._data, frame, pin.LOCAL_WORLD_ALIGNED)[:3]
            point = self._data.oMf[frame].translation
            rows += [self._ground.normal(point) @ jacobian, self._ground.tangent(point) @ jacobian]
        return np.array(rows)

    def generalized_force(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """B(q) u, (n_v)."""
        return np.asarray(self._control_matrix(q)) @ u

    def required_force(self, q: np.ndarray, v: np.ndarray, a: np.ndarray, u: np.ndarray) -> np.ndarray:
        """M a + h + D v - B u, what the contacts must supply, (n_v)."""
        return np.asarray(pin.rnea(self._model, self._data, q, v, a)) + self.damping * v - self.generalized_force(q, u)

    def difference(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """The displacement from one configuration to another, (n_v)."""
        return np.asarray(pin.difference(self._model, before, after))

    def energy(self, q: np.ndarray, v: np.ndarray) -> float:
        """Kinetic energy (with armature) plus potential energy, J."""
        # Pinocchio computes the potential energy of no model with mimic joints, but the centre of mass of all.
        weight = pin.computeTotalMass(self._model) * self._model.gravity.linear
        potential = -weight @ pin.centerOfMass(self._model, self._data, q)
        return float(0.5 * v @ self.mass_matrix(q) @ v + potential)


def split_contact_force(
    generalized: np.ndarray, jacobian: np.ndarray, closed: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return forces (n_c, 2) of the closed contacts with J^T f = generalized in least squares, and what is left over.

    Args:
        generalized: (n_v). jacobian: rows J_n, J_t of every contact, (2 n_c, n_v). closed: (n_c) of bool.
    """
    force = np.zeros(len(jacobian))
    rows = np.repeat(closed, 2)
    if rows.any():
        force[rows] = np.linalg.lstsq(jacobian[rows].T, generalized, rcond=None)[0]
    return force.reshape(-1, 2), generalized - jacobian.T @ force
