"""Conditions on the signs of a contact's velocities, the same for every form of the contact logic."""

from __future__ import annotations

from typing import Any

import casadi as ca

from fesd_robot.complementarity import Complementarity, HeldAt, Label
from fesd_robot.contact.cone import cone_conditions
from fesd_robot.contact.kinds import (
    BACKWARDS,
    DIRECTIONS,
    FORCE_WHILE_PARTING,
    FORWARDS,
    FRICTION_AFTER_IMPACT,
    FRICTION_ALONG_SLIDING,
    MOTION_DURING_IMPACT,
    RESTITUTION,
    SLIPPING,
)
from fesd_robot.contact.model import AuxiliaryMultipliers, Contact, MultibodyDynamics


def velocity_conditions(
    dynamics: MultibodyDynamics,
    contact: Contact,
    normal_velocity: ca.SX,
    beta: ca.SX,
    complement: ca.SX,
    multipliers: AuxiliaryMultipliers,
    *,
    unused: ca.SX | None = None,
    held_at: HeldAt = HeldAt.POINTS,
) -> list[Complementarity]:
    """Return the vanishing constraints on normal and tangential velocity of one contact.

    No force while parting, no free motion while approaching a closed contact, and friction against the sliding:
    ``max(J_n v, 0) beta = 0``, ``max(-J_n v, 0) beta (1 - beta) = 0``, ``max(-J_t v, 0) theta_+ = 0`` and
    ``max(J_t v, 0) theta_- = 0``. A contact that may not slip has ``max(J_t v, 0) beta (1 - beta) = 0`` and the same
    for -J_t v: closed, it sticks while the clock runs. One with a reserve r has theta_+ and theta_- that are zero or at
    least r beta / 2: it slides with all of its friction, or sticks with 1 - r of it, in an impact, too.

    With restitution e an element is a whole impact, which begins with the normal velocity v_0 at the left boundary and
    ends with -e v_0 (Newton): the first condition is ``max(J_n v + e v_0, 0) beta = 0``, at the right boundary
    ``max(-(J_n v + e v_0), 0) beta = 0`` holds besides, and friction obeys Coulomb's law for the impulse as a whole: it
    is against the tangential velocity at the right boundary, and at the other points only while the clock runs. In
    stance v_0 is 0, and these are the conditions without restitution.

    Args:
        normal_velocity: J_n v, stabilised, SX in x.
        beta: Filippov multiplier of the contact's auxiliary fields together.
        complement: 1 - beta, not negative.
        multipliers: theta_+ and theta_- of every tangential direction.
        unused: of a contact in space the part of its friction cone that is not used, see `cone.cone_conditions`.
        held_at: where within an element the conditions are held that do not say so themselves.
    """
    bounces = contact.restitution > 0

    def condition(
        kind: str, G: ca.SX, H: ca.SX, *, direction: str = "", held_at: HeldAt = held_at, **others: Any
    ) -> Complementarity:
        return Complementarity(
            Label(kind, subject=direction, contact=contact.name),
            G,
            H,
            vanishing=True,
            level="velocity",
            held_at=held_at,
            **others,
        )

    conditions = [
        condition(FORCE_WHILE_PARTING, normal_velocity, beta, initial_value_factor=contact.restitution),
        condition(MOTION_DURING_IMPACT, -normal_velocity, beta, complement=complement),
    ]
    if bounces:
        conditions.append(
            condition(
                RESTITUTION,
                -normal_velocity,
                beta,
                initial_value_factor=contact.restitution,
                held_at=HeldAt.RIGHT_BOUNDARY,
            )
        )
    if contact.friction > 0:
        velocities = contact.tangential_velocities(dynamics.velocity)
        if unused is not None:
            conditions += cone_conditions(dynamics, contact, multipliers, unused)
        else:
            plus, minus = multipliers.sides[0]
            spares = multipliers.spares or (None, None)
            sides = ((-velocities[0], plus, BACKWARDS, spares[0]), (velocities[0], minus, FORWARDS, spares[1]))
            for signed, own, direction, spare in sides:
                running: dict[str, Any] = {"complement": complement} if bounces else {}
                conditions.append(
                    condition(FRICTION_ALONG_SLIDING, signed, own, direction=direction, spare=spare, **running)
                )
            for signed, own, direction, spare in sides if bounces else ():
                at_end: dict[str, Any] = {"held_at": HeldAt.RIGHT_BOUNDARY, "spare": spare}
                conditions.append(condition(FRICTION_AFTER_IMPACT, signed, own, direction=direction, **at_end))
        if contact.slip_distance == 0:
            conditions += [
                condition(SLIPPING, signed, beta, complement=complement, direction=direction, vector_component=True)
                for velocity, (forwards, backwards) in zip(velocities, DIRECTIONS, strict=False)
                for direction, signed in ((backwards, -velocity), (forwards, velocity))
            ]
    return conditions
