"""The dynamics of a state in the coordinates of its contacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fesd_robot.recovery.physics import NumericPhysics

_STEP = 3e-6
"""Step in s of the central difference for the derivative of the contact Jacobian along the motion."""


@dataclass(frozen=True)
class ContactDynamics:
    """Dynamics of one state in the coordinates of the contacts: their acceleration is ``free + compliance f``.

    Attributes:
        jacobian: J, rows J_n and J_t of every contact, (2 n_c, n_v).
        velocity: J v, m/s, (2 n_c).
        acceleration: M^-1 (B u - h - D v - K (q - r)), of the robot without contact forces, (n_v).
        response: M^-1 J^T, (n_v, 2 n_c).
        compliance: W = J M^-1 J^T, 1/kg, (2 n_c, 2 n_c).
        free: J times that acceleration + (dJ/dt) v, m/s^2, (2 n_c).
        friction: coefficients, (n_c).
    """

    jacobian: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    response: np.ndarray
    compliance: np.ndarray
    free: np.ndarray
    friction: np.ndarray


def contact_dynamics(physics: NumericPhysics, q: np.ndarray, v: np.ndarray, u: np.ndarray) -> ContactDynamics:
    """Return the dynamics of a state in the coordinates of its contacts.

    (dJ/dt) v is the central difference of J(q (+) eps v) v.

    Args:
        physics: of the robot and its contacts.
        q, v, u: configuration (n_q), velocity (n_v), controls (n_u), SI units.
    """
    ahead, behind = (physics.contact_jacobian(physics.integrate(q, sign * _STEP * v)) for sign in (1.0, -1.0))
    jacobian = physics.contact_jacobian(q)
    force = -physics.required_force(q, v, np.zeros_like(v), u)
    solved = np.linalg.solve(physics.mass_matrix(q), np.column_stack([force, jacobian.T]))
    acceleration, response = solved[:, 0], solved[:, 1:]
    return ContactDynamics(
        jacobian=jacobian,
        velocity=jacobian @ v,
        acceleration=acceleration,
        response=response,
        compliance=jacobian @ response,
        free=jacobian @ acceleration + (ahead @ v - behind @ v) / (2.0 * _STEP),
        friction=physics.friction,
    )
