"""What the signs of a contact's velocities forbid, the same for every form of the contact logic."""

from __future__ import annotations

import casadi as ca

from fesd_robot.complementarity import Complementarity, Label
from fesd_robot.contact.model import MultibodyDynamics, PlanarContact

FORCE_AT_A_DISTANCE = "force at a distance"
FORCE_WHILE_PARTING = "force while parting"
MOTION_DURING_IMPACT = "motion during impact"
FRICTION_ALONG_SLIDING = "friction along sliding"
SLIPPING = "slipping"
FORWARDS, BACKWARDS = "forwards", "backwards"
"""Kinds of vanishing constraints, and directions of sliding that are their subjects."""


def velocity_conditions(
    dynamics: MultibodyDynamics,
    contact: PlanarContact,
    normal_velocity: ca.SX,
    beta: ca.SX,
    complement: ca.SX,
    multipliers: tuple[ca.SX, ca.SX],
    *,
    left_boundary_only: bool = False,
) -> list[Complementarity]:
    """Return the vanishing constraints on normal and tangential velocity of one contact.

    No force while parting, no free motion while approaching a closed contact, and friction against the sliding:
    ``max(J_n v, 0) beta = 0``, ``max(-J_n v, 0) beta (1 - beta) = 0``, ``max(-J_t v, 0) theta_+ = 0`` and
    ``max(J_t v, 0) theta_- = 0``. A contact that may not slip has ``max(J_t v, 0) beta (1 - beta) = 0`` and the same
    for -J_t v: closed, it sticks while the clock runs.

    Args:
        normal_velocity: J_n v, stabilised, SX in x.
        beta: Filippov multiplier of the contact's auxiliary fields together.
        complement: 1 - beta, not negative.
        multipliers: (theta_+, theta_-), whose sum is beta.
        left_boundary_only: hold the conditions for the left boundary of each element only.
    """

    def condition(
        kind: str, G: ca.SX, H: ca.SX, *, complement: ca.SX | None = None, direction: str = ""
    ) -> Complementarity:
        return Complementarity(
            Label(kind, subject=direction, contact=contact.name),
            G,
            H,
            vanishing=True,
            complement=complement,
            level="velocity",
            left_boundary_only=left_boundary_only,
        )

    conditions = [
        condition(FORCE_WHILE_PARTING, normal_velocity, beta),
        condition(MOTION_DURING_IMPACT, -normal_velocity, beta, complement=complement),
    ]
    if contact.friction > 0:
        plus, minus = multipliers
        tangential_velocity = ca.dot(contact.tangent, dynamics.velocity)
        conditions += [
            condition(FRICTION_ALONG_SLIDING, -tangential_velocity, plus, direction=BACKWARDS),
            condition(FRICTION_ALONG_SLIDING, tangential_velocity, minus, direction=FORWARDS),
        ]
        if contact.slip_distance == 0:
            conditions += [
                condition(SLIPPING, -tangential_velocity, beta, complement=complement, direction=BACKWARDS),
                condition(SLIPPING, tangential_velocity, beta, complement=complement, direction=FORWARDS),
            ]
    return conditions
