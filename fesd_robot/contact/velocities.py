"""What the signs of a contact's velocities forbid, the same for every form of the contact logic."""

from __future__ import annotations

import casadi as ca

from fesd_robot.contact.model import MultibodyDynamics, PlanarContact
from fesd_robot.dcs import Exclusion


def velocity_exclusions(
    dynamics: MultibodyDynamics,
    contact: PlanarContact,
    normal_velocity: ca.SX,
    beta: ca.SX,
    rest: ca.SX,
    shares: tuple[ca.SX, ca.SX],
    *,
    boundary_only: bool = False,
) -> list[Exclusion]:
    """Return the conditions on normal and tangential speed of one contact.

    No force while parting, no free motion while approaching a closed contact, and friction against the sliding.

    Args:
        normal_velocity: speed that the contact's logic sees, SX in x.
        beta: share of the contact's auxiliary fields.
        rest: 1 - beta, not negative.
        shares: (theta_+, theta_-), whose sum is beta.
        boundary_only: hold the conditions for the left boundary of each element only.
    """

    def exclusion(name: str, level: ca.SX, share: ca.SX, rest: ca.SX | None = None) -> Exclusion:
        return Exclusion(f"{name} [{contact.name}]", level, share, rest, boundary_only=boundary_only, rank=1)

    found = [
        exclusion("force while parting", normal_velocity, beta),
        exclusion("motion during impact", -normal_velocity, beta, rest),
    ]
    if contact.friction > 0:
        plus, minus = shares
        tangential_velocity = ca.dot(contact.tangent, dynamics.velocity)
        found += [
            exclusion("friction along sliding, backwards", -tangential_velocity, plus),
            exclusion("friction along sliding, forwards", tangential_velocity, minus),
        ]
    return found
