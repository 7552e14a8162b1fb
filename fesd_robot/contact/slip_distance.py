"""A limit of how far a contact may slip over the whole motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Complementarity, HeldAt, Label
from fesd_robot.contact.kinds import BACKWARDS, FORWARDS
from fesd_robot.contact.model import Contact, ContactSystem, MultibodyDynamics

SLIP_SPEED = "slip speed"
"""Kind of the vanishing constraints that bound the slip speed from below."""

REGULARISATION_WEIGHT = 1e-3
"""epsilon, s2/m2, of epsilon w^2 at every stage; without it w is left open in flight, and few such tasks are solved."""


def limit_slip_distances(
    contact_system: ContactSystem, dynamics: MultibodyDynamics, contacts: Sequence[Contact]
) -> ContactSystem:
    """Return the contact system with a slip distance d as one more state for every contact that limits it.

    ``d' = theta_ODE s w`` with the slip speed w >= 0, an algebraic variable, for which ``max(J_t v - w, 0) beta = 0``
    and ``max(-J_t v - w, 0) beta = 0`` at the stages of an element: where the contact has a force, w is at least
    |J_t v|, and a cost epsilon w^2 at every stage chooses the least w. So d is never less than the path that the
    contact slips by the scheme's quadrature, impacts left out, and an upper bound on d(T) limits it.

    Args:
        contact_system: in the multiplier form, without slip distances.
        dynamics: whose velocity v is.
        contacts: of the system, in its order.
    """
    limited = [(i, contact) for i, contact in enumerate(contacts) if contact.limits_slip]
    if not limited:
        return contact_system
    system, count = contact_system.system, len(limited)
    distances, speeds = ca.SX.sym("d", count), ca.SX.sym("w", count)
    conditions = []
    for (i, contact), speed in zip(limited, ca.vertsplit(speeds), strict=True):
        beta = contact_system.theta_auxiliary[i].normal
        (tangential_velocity,) = contact.tangential_velocities(dynamics.velocity)
        conditions += [
            Complementarity(
                Label(SLIP_SPEED, direction, contact.name),
                signed_velocity - speed,
                beta,
                vanishing=True,
                level="velocity",
                held_at=HeldAt.STAGES,
            )
            for direction, signed_velocity in ((BACKWARDS, -tangential_velocity), (FORWARDS, tangential_velocity))
        ]
    names = [contact.name for _, contact in limited]
    return replace(
        contact_system,
        system=replace(
            system,
            state=ca.vertcat(system.state, distances),
            mass_matrix=ca.diagcat(system.mass_matrix, ca.SX.eye(count)),
            right_hand_side=ca.vertcat(system.right_hand_side, contact_system.clock_rate * speeds),
            algebraic=ca.vertcat(system.algebraic, speeds),
            regularisation=system.regularisation + REGULARISATION_WEIGHT * ca.sumsqr(speeds),
            regularisation_name="regularisation of the slip speeds",
            algebraic_lower=np.append(system.algebraic_lower, np.zeros(count)),
            algebraic_upper=np.append(system.algebraic_upper, np.full(count, np.inf)),
            guess=lambda x, u, p: np.append(system.guess(x, u, p), np.zeros(count)),
            state_names=[*system.state_names, *(f"{name} slip distance" for name in names)],
            algebraic_names=[*system.algebraic_names, *(f"slip speed[{name}]" for name in names)],
            complementarities=[*system.complementarities, *conditions],
        ),
    )
