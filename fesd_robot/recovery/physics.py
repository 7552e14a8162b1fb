"""Pinocchio's numeric algorithms at one sample of a trajectory: what the audit compares with."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
import pinocchio as pin

from fesd_robot.contact import CircleOnSurface, ContactGeometry, PointOnSurface, Scene, TwoBodies, frames_of
from fesd_robot.recovery.between_bodies import closest, tangents_between
from fesd_robot.recovery.contact_rows import IN_THE_PLANE, by_contact, rows_each, rows_of, stacked_rows, tangential_rows
from fesd_robot.recovery.dry_friction import DryFriction
from fesd_robot.robot import Robot

RANK_TOLERANCE = 1e-6
"""Ratio of singular values of J^T below which a motion leaves open how contacts push: an acceleration that is known to
eight digits tells the force along a leg that is straight to 1e-9 rad worse than any task limits it."""


class NumericPhysics:
    """Dynamics and contact kinematics by Pinocchio's own algorithms, independent of the planner's expressions.

    Args:
        robot: the robot with its armature and damping.
        scene: surfaces, and what touches what.
        friction: name of a contact -> its coefficient, in the order of the contacts; the geometry of each is that of
            its name in `scene.geometries`.
        control_matrix: q -> B, (n_v, n_u).
        in_space: whether contacts have two tangents; a circle is a ball then.
        restitution: name of a contact -> its coefficient of restitution, 0 to 1; 0 of those that are left out.
        compliance: name of a compliant contact -> its stiffness, N/m, and damping, N s/m.
        impacts_at_once: whether friction in an impact follows the velocity after it, instead of acting along it.

    Attributes:
        scene: surfaces, and what touches what.
        rows: of a contact in its Jacobian and its forces: a normal and a tangent, in space two.
        friction: coefficient of every contact, (n_c).
        restitution: coefficient of every contact, (n_c).
        damping: viscous damping of every joint, the diagonal of D, N s/m or N m s/rad, (n_v).
        dry_friction: limit of the dry friction of every joint, N or N m, (n_v); it is no part of the forces below.
        friction_coordinates: velocity coordinates that have some, (n_f).
        rubbing: the same, by joints and limit surfaces.
        compliant: compliant contacts, whose force is one of the state and so a part of the forces below.
    """

    def __init__(
        self,
        robot: Robot,
        scene: Scene,
        friction: Mapping[str, float],
        control_matrix: Callable[[np.ndarray], np.ndarray],
        *,
        in_space: bool = False,
        restitution: Mapping[str, float] = MappingProxyType({}),
        compliance: Mapping[str, tuple[float, float]] = MappingProxyType({}),
        impacts_at_once: bool = False,
    ) -> None:
        self.scene = scene
        self.impacts_at_once = impacts_at_once
        self.rows = IN_THE_PLANE + in_space
        self._model = robot.model
        self._data = robot.model.createData()
        self._geometries = [scene.geometries[name] for name in friction]
        self.compliant = tuple(compliance)
        self._compliant = [scene.geometries[name] for name in compliance]
        self._stiffness, self._damping = np.array(list(compliance.values()), dtype=float).reshape(-1, 2).T
        every = [*self._geometries, *self._compliant]
        self._frames = {frame: robot.frame_id(frame) for geometry in every for frame in frames_of(geometry)}
        self._control_matrix = control_matrix
        self.damping = np.array(robot.model.damping)
        self._springs = robot.springs
        self.dry_friction = robot.dry_friction_limits
        self.friction_coordinates = np.flatnonzero(self.dry_friction)
        self.rubbing = DryFriction.of(robot)
        self.friction = np.array(list(friction.values()))
        self.restitution = np.array([restitution.get(name, 0.0) for name in friction])

    def mass_matrix(self, q: np.ndarray) -> np.ndarray:
        """Return M(q) with armature, (n_v, n_v)."""
        upper = np.triu(pin.crba(self._model, self._data, q))
        return np.asarray(upper + np.triu(upper, 1).T)

    def gaps(self, q: np.ndarray) -> np.ndarray:
        """Return the gap of every contact, m, (n_c)."""
        pin.framesForwardKinematics(self._model, self._data, q)
        return np.array([self._gap(geometry) for geometry in self._geometries])

    def contact_points(self, q: np.ndarray) -> np.ndarray:
        """Return the points of the robot that touch where the gap is closed, m, (n_c, 3): on the rim of a circle."""
        pin.framesForwardKinematics(self._model, self._data, q)
        return np.array([self._point(geometry) for geometry in self._geometries]).reshape(-1, 3)

    def contact_axes(self, q: np.ndarray) -> np.ndarray:
        """Return normal and tangents of every contact in the world, (n_c, rows, 3): directions of force components."""
        pin.framesForwardKinematics(self._model, self._data, q)
        return np.array([self._axes(geometry) for geometry in self._geometries]).reshape(-1, self.rows, 3)

    def contact_jacobian(self, q: np.ndarray) -> np.ndarray:
        """Return the rows J_n, J_t of every contact, (rows n_c, n_v)."""
        pin.computeJointJacobians(self._model, self._data, q)
        pin.updateFramePlacements(self._model, self._data)
        rows = [row for geometry in self._geometries for row in self._rows(geometry)]
        return np.array(rows).reshape(-1, self._model.nv)

    def compliant_gaps(self, q: np.ndarray) -> np.ndarray:
        """Return the gap of every compliant contact, m, (n_s); negative where it is compressed."""
        pin.framesForwardKinematics(self._model, self._data, q)
        return np.array([self._gap(geometry) for geometry in self._compliant])

    def every_gap(self, q: np.ndarray) -> np.ndarray:
        """Return the gap of every rigid and, behind them, of every compliant contact, m, (n_c + n_s)."""
        return np.concatenate([self.gaps(q), self.compliant_gaps(q)])

    def compliant_points(self, q: np.ndarray) -> np.ndarray:
        """Return the points of the robot that push against compliant contacts, m, (n_s, 3)."""
        pin.framesForwardKinematics(self._model, self._data, q)
        return np.array([self._point(geometry) for geometry in self._compliant]).reshape(-1, 3)

    def compliant_jacobian(self, q: np.ndarray) -> np.ndarray:
        """Return the rows J_n of the compliant contacts, (n_s, n_v)."""
        pin.computeJointJacobians(self._model, self._data, q)
        pin.updateFramePlacements(self._model, self._data)
        return np.array([self._rows(geometry)[0] for geometry in self._compliant]).reshape(-1, self._model.nv)

    def relief(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return k gap + d J_n v of every compliant contact, N, (n_s); where it is negative it pushes as much."""
        if not self._compliant:
            return np.zeros(0)
        return np.asarray(self._stiffness * self.compliant_gaps(q) + self._damping * (self.compliant_jacobian(q) @ v))

    def compliant_forces(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the normal force max(0, -k gap - d J_n v) of every compliant contact, N, (n_s)."""
        return np.maximum(-self.relief(q, v), 0.0)

    def compliant_push(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the force of all compliant contacts on the coordinates, (n_v)."""
        if not self._compliant:
            return np.zeros_like(v)
        force = self.compliant_forces(q, v)
        return np.asarray(self.compliant_jacobian(q).T @ force)

    @property
    def reach(self) -> np.ndarray:
        """Stiffness of every compliant contact, N/m, (n_s): a relief by it is a distance."""
        return self._stiffness

    def generalized_force(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return B(q) u, (n_v)."""
        return np.asarray(self._control_matrix(q)) @ u

    def required_force(self, q: np.ndarray, v: np.ndarray, a: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return M a + h + D v + K (q - r) - J_s^T f_s - B u, what rigid contacts and dry friction must supply, (n_v).

        f_s are the forces of compliant contacts.
        """
        return (
            np.asarray(pin.rnea(self._model, self._data, q, v, a))
            + self.resistance(q, v)
            - self.compliant_push(q, v)
            - self.generalized_force(q, u)
        )

    def resistance(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return D v + K (q - r), the force that overcomes damping and springs, (n_v)."""
        result = self.damping * v
        for row, entry, stiffness, rest in self._springs:
            result[row] += stiffness * (q[entry] - rest)
        return result

    def difference(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Return the displacement from one configuration to another, (n_v)."""
        return np.asarray(pin.difference(self._model, before, after))

    def integrate(self, q: np.ndarray, displacement: np.ndarray) -> np.ndarray:
        """Return the configuration that a displacement, (n_v), leads to from q."""
        return np.asarray(pin.integrate(self._model, q, displacement))

    def displacement_rate(self, q: np.ndarray, displacement: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the rate of a displacement from the fixed q at which the robot has the velocity v there, (n_v)."""
        if self._model.nq == self._model.nv:
            return v
        return np.linalg.solve(pin.dIntegrate(self._model, q, displacement, pin.ARG1), v)

    @property
    def mass(self) -> float:
        """Mass of all links, kg."""
        return float(pin.computeTotalMass(self._model))

    def energy(self, q: np.ndarray, v: np.ndarray) -> float:
        """Return the kinetic energy (with armature) plus potential energy, of gravity and of the springs, J."""
        # Pinocchio computes the potential energy of no model with mimic joints, but the centre of mass of all.
        weight = self.mass * self._model.gravity.linear
        potential = -weight @ pin.centerOfMass(self._model, self._data, q)
        stored = sum(stiffness * (q[entry] - rest) ** 2 for _, entry, stiffness, rest in self._springs)
        return float(0.5 * v @ self.mass_matrix(q) @ v + potential + 0.5 * stored)

    def _position(self, frame: str) -> np.ndarray:
        return np.array(self._data.oMf[self._frames[frame]].translation)

    def _jacobian(self, frame: str) -> np.ndarray:
        """Return the rows of velocity and angular velocity in world axes, (6, n_v)."""
        frame_id = self._frames[frame]
        jacobian = pin.getFrameJacobian(self._model, self._data, frame_id, pin.LOCAL_WORLD_ALIGNED)
        return np.asarray(jacobian).reshape(6, -1)  # Pinocchio gives a vector for a robot with one coordinate

    def _gap(self, geometry: ContactGeometry) -> float:
        if isinstance(geometry, PointOnSurface):
            return float(geometry.surface.distance(self._position(geometry.frame)))
        if isinstance(geometry, CircleOnSurface):
            return float(geometry.path.distance(self._position(geometry.frame)))
        return self._closest(geometry)[0]

    def _point(self, geometry: ContactGeometry) -> np.ndarray:
        position = self._position(geometry.frame)
        if isinstance(geometry, PointOnSurface):
            return position
        if isinstance(geometry, CircleOnSurface):
            return np.asarray(position - geometry.radius * geometry.path.axes(position).normal)
        return position - geometry.radius * self._closest(geometry)[1]

    def _axes(self, geometry: ContactGeometry) -> tuple[np.ndarray, ...]:
        position = self._position(geometry.frame)
        if isinstance(geometry, TwoBodies):
            normal = self._closest(geometry)[1]
            return normal, *tangents_between(geometry, normal)
        surface = geometry.surface if isinstance(geometry, PointOnSurface) else geometry.path
        return surface.normal(position), *surface.axes(position)[1 : self.rows]

    def _rows(self, geometry: ContactGeometry) -> list[np.ndarray]:
        """Return J_n and J_t of one contact, (n_v) each."""
        position, jacobian = self._position(geometry.frame), self._jacobian(geometry.frame)
        if isinstance(geometry, PointOnSurface):
            return [axis @ jacobian[:3] for axis in self._axes(geometry)]
        if isinstance(geometry, CircleOnSurface):
            normal, *tangents = geometry.path.axes(position)
            moving = self._at_rim(jacobian, -geometry.radius * normal)
            return [
                geometry.path.normal(position) @ jacobian[:3],
                *(axis @ moving for axis in tangents[: self.rows - 1]),
            ]
        gap, normal = self._closest(geometry)
        nearest = position - (gap + geometry.radius) * normal - self._position(geometry.other_frame)
        moving = self._at_rim(jacobian, -geometry.radius * normal)
        moving -= self._at_rim(self._jacobian(geometry.other_frame), nearest)
        return [normal @ moving, *(tangent @ moving for tangent in tangents_between(geometry, normal))]

    def _closest(self, geometry: TwoBodies) -> tuple[float, np.ndarray]:
        """Return the gap and direction from the other body to the circle's centre, (3)."""
        other = self._data.oMf[self._frames[geometry.other_frame]]
        return closest(geometry, self._position(geometry.frame), np.array(other.translation), np.array(other.rotation))

    @staticmethod
    def _at_rim(jacobian: np.ndarray, arm: np.ndarray) -> np.ndarray:
        """Return the Jacobian of a point of the frame, `arm` from its origin: J_p - arm x J_w, (3, n_v)."""
        return np.asarray(jacobian[:3] - pin.skew(arm) @ jacobian[3:])


def split_contact_force(
    generalized: np.ndarray,
    jacobian: np.ndarray,
    closed: np.ndarray,
    friction: np.ndarray | None = None,
    near: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Return forces (n_c, rows) of closed contacts with J^T f = generalized in least squares, and the residual.

    Where the motion leaves open how contacts divide a force between them, as the friction of two corners of a block,
    or the force along a straight leg, every division obeys the same equations of motion; of all of them the one nearest
    to `near` is taken. Where it is as good as open (`RANK_TOLERANCE`), what that one does not supply is left over.

    Args:
        generalized: (n_v).
        jacobian: rows J_n, J_t of every contact, (rows n_c, n_v).
        closed: (n_c) of bool.
        friction: coefficients (n_c); a contact with none has no tangential force. All have one if omitted.
        near: (n_c, rows), normal and tangential; zeros if omitted.
    """
    nothing = np.zeros(0, dtype=int)
    force, _, left = split_forces(generalized, jacobian, closed, nothing, friction, near, np.zeros(0))
    return force, left


def split_forces(
    generalized: np.ndarray,
    jacobian: np.ndarray,
    closed: np.ndarray,
    friction_coordinates: np.ndarray,
    friction: np.ndarray | None,
    near: np.ndarray | None,
    near_joints: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return forces of closed contacts, (n_c, rows), of the dry friction of joints, (n_f), and the residual.

    The same as `split_contact_force` for J^T f + S^T tau = generalized, where S picks the joints.

    Args:
        generalized, jacobian, closed, friction, near: as there.
        friction_coordinates: velocity coordinates with dry friction, (n_f).
        near_joints: force of their friction, N or N m, (n_f).
    """
    count = rows_each(jacobian, len(closed))
    rows = rows_of(closed, count)
    if friction is not None:
        tangential_rows(rows, count)[:] &= friction[:, None] > 0
    force = np.zeros(len(jacobian))
    if near is not None:
        force[rows] = stacked_rows(near)[rows]
    joints = np.array(near_joints, dtype=float)
    columns = np.vstack([jacobian[rows], np.eye(len(generalized))[friction_coordinates]]).T
    if columns.size:
        missing = generalized - jacobian.T @ force
        missing[friction_coordinates] -= joints
        step = np.linalg.lstsq(columns, missing, rcond=RANK_TOLERANCE)[0]
        force[rows] += step[: len(step) - len(friction_coordinates)]
        joints += step[len(step) - len(friction_coordinates) :]
    left = generalized - jacobian.T @ force
    left[friction_coordinates] -= joints
    return by_contact(force, count), joints, left
