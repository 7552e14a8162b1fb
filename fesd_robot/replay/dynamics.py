"""The dynamics of a state in the coordinates of its contacts and of the joints with dry friction."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fesd_robot.contact import ContactMode, Modes
from fesd_robot.exactness import NO_VELOCITY
from fesd_robot.recovery import DryFriction, NumericPhysics, tangential_rows
from fesd_robot.replay.headings import slip_headings

_STEP = 3e-6
"""Step in s of the central difference for the derivative of the contact Jacobian along the motion."""


@dataclass(frozen=True)
class ContactDynamics:
    """Dynamics of one state in the coordinates of the contacts: their acceleration is ``free + compliance f``.

    Joints with dry friction move as if they had none, until `in_joint_modes` says what they do.

    Attributes:
        jacobian: J, rows J_n and J_t of every contact, (rows n_c, n_v).
        velocity: J v, m/s, (rows n_c).
        acceleration: M^-1 (B u - h - D v - K (q - r)), of the robot without contact forces, (n_v).
        response: M^-1 J^T, (n_v, rows n_c).
        compliance: W = J M^-1 J^T, 1/kg, (rows n_c, rows n_c).
        free: J times that acceleration + (dJ/dt) v, m/s^2, (rows n_c).
        friction: coefficients, (n_c).
        headings: direction in which a contact slides that slides forwards, (n_c, n_t): its tangent in the plane, that
            of its velocity in space.
        joints: the same for the joints with dry friction.
    """

    jacobian: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    response: np.ndarray
    compliance: np.ndarray
    free: np.ndarray
    friction: np.ndarray
    headings: np.ndarray
    joints: JointDynamics

    @property
    def rows(self) -> int:
        """Rows of a contact."""
        return 1 + self.headings.shape[1]

    def in_joint_modes(self, modes: Modes) -> ContactDynamics:
        """Return the dynamics in which joints with dry friction stick or slide as given, from that without friction.

            slide: tau_f = -F s e;   stick: a_i = 0, with the tau_f that this takes

        Args:
            modes: of every joint with dry friction, (n_f).
        """
        if not modes:
            return self
        joints, rows = self.joints, self.joints.rows
        sticking = np.array([mode is ContactMode.STICK for mode in modes])
        force = -joints.limit * np.array([mode.direction for mode in modes]) * joints.headings
        acceleration = self.acceleration + joints.response @ force
        held = np.linalg.inv(joints.response[rows][np.ix_(sticking, sticking)])
        force[sticking] = -held @ acceleration[rows[sticking]]
        by_contacts = np.zeros((len(rows), self.response.shape[1]))
        by_contacts[sticking] = -held @ self.response[rows[sticking]]
        acceleration = acceleration + joints.response[:, sticking] @ force[sticking]
        response = self.response + joints.response @ by_contacts
        drift = self.free - self.jacobian @ self.acceleration
        return replace(
            self,
            acceleration=acceleration,
            response=response,
            compliance=self.jacobian @ response,
            free=self.jacobian @ acceleration + drift,
            joints=replace(joints, force=force, by_contacts=by_contacts),
        )

    def joint_force(self, forces: np.ndarray) -> np.ndarray:
        """Return the dry friction of joints in their modes, N or N m, (n_f).

        Args:
            forces: of the contacts, stacked, (rows n_c).
        """
        return np.asarray(self.joints.force + self.joints.by_contacts @ forces)


@dataclass(frozen=True)
class JointDynamics:
    """Joints with dry friction in a state: n_f of them.

    Attributes:
        rows: their velocity coordinates, (n_f).
        limit: F, N or N m, (n_f).
        velocity: m/s or rad/s, (n_f).
        response: M^-1 S^T, (n_v, n_f), where S picks the joints.
        headings: direction e of a slide on a limit surface, 1 of a joint by itself, (n_f).
        force, by_contacts: in given modes the friction is ``force + by_contacts f``, (n_f) and (n_f, rows n_c).
        rubbing: which of them share a limit surface.
    """

    rows: np.ndarray
    limit: np.ndarray
    velocity: np.ndarray
    response: np.ndarray
    headings: np.ndarray
    force: np.ndarray
    by_contacts: np.ndarray
    rubbing: DryFriction


def contact_dynamics(
    physics: NumericPhysics,
    q: np.ndarray,
    v: np.ndarray,
    u: np.ndarray,
    headings: np.ndarray | None = None,
    joint_headings: np.ndarray | None = None,
    *,
    through_zero: bool = False,
) -> ContactDynamics:
    """Return the dynamics of a state in the coordinates of its contacts, without dry friction of joints.

    (dJ/dt) v is the central difference of J(q (+) eps v) v.

    Args:
        physics: of the robot and its contacts.
        q, v, u: configuration (n_q), velocity (n_v), controls (n_u), SI units.
        headings, through_zero: `before` of `slip_headings`, and as there.
        joint_headings: `before` of `DryFriction.headings`, (n_f).
    """
    ahead, behind = (physics.contact_jacobian(physics.integrate(q, sign * _STEP * v)) for sign in (1.0, -1.0))
    jacobian, rows = physics.contact_jacobian(q), physics.friction_coordinates
    force = -physics.required_force(q, v, np.zeros_like(v), u)
    picked = np.eye(len(v))[:, rows]
    solved = np.linalg.solve(physics.mass_matrix(q), np.column_stack([force, jacobian.T, picked]))
    acceleration, response, of_joints = np.split(solved, [1, 1 + len(jacobian)], axis=1)
    velocity = jacobian @ v
    return ContactDynamics(
        jacobian=jacobian,
        velocity=velocity,
        acceleration=acceleration[:, 0],
        response=response,
        compliance=jacobian @ response,
        free=jacobian @ acceleration[:, 0] + (ahead @ v - behind @ v) / (2.0 * _STEP),
        friction=physics.friction,
        headings=slip_headings(tangential_rows(velocity, physics.rows), headings, through_zero=through_zero),
        joints=JointDynamics(
            rows=rows,
            limit=physics.dry_friction[rows],
            velocity=v[rows],
            response=of_joints,
            headings=physics.rubbing.headings(v[rows], joint_headings, slow=NO_VELOCITY, through_zero=through_zero),
            force=np.zeros(len(rows)),
            by_contacts=np.zeros((len(rows), len(jacobian))),
            rubbing=physics.rubbing,
        ),
    )
