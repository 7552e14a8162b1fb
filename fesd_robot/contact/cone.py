"""Coulomb's law in space: a friction cone instead of two directions."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca

from fesd_robot.complementarity import ActiveFactor, Complementarity, HeldAt, Label
from fesd_robot.contact.kinds import (
    DIRECTIONS,
    FORCE_AT_A_DISTANCE,
    FORCE_WHILE_PARTING,
    FRICTION_ACROSS_SLIDING,
    FRICTION_WITH_SLIDING,
    SLIDING_INSIDE_CONE,
)
from fesd_robot.contact.model import AuxiliaryMultipliers, Contact, MultibodyDynamics


def cone_conditions(
    dynamics: MultibodyDynamics, contact: Contact, multipliers: AuxiliaryMultipliers, unused: ca.SX
) -> list[Complementarity]:
    """Return the vanishing constraints of Coulomb's law in space.

    With the friction f = (theta_k- - theta_k+)_k in units of mu a_n and the unused part of the cone
    kappa = beta^2 - |f|^2 >= 0,

    - a contact slides only with its force on the cone: ``v_t != 0 => kappa = 0``, between all points of an element;
    - friction is parallel to sliding, ``f_1 v_2 - f_2 v_1 = 0`` at the stages, and against it, ``max(f . v_t, 0) = 0``
      between all points of an element, in which a slide does not turn back.

    So it is -beta v_t / |v_t| where the contact slides, of any direction, and anything inside the cone where it sticks.
    No direction is preferred, and no velocity regularised. A contact with a reserve r slides with kappa = 0, or has
    |f| <= (1 - r) beta.

    Args:
        contact: with two tangents.
        multipliers: theta_k+ and theta_k-, not negative, with the sum beta for either direction k.
        unused: kappa.

    Source: the maximum dissipation principle, as stated for time freezing in arXiv 2111.06759, section 4.4, without the
    regularisation there; its form as vanishing constraints is ours.
    """
    velocities, friction = contact.tangential_velocities(dynamics.velocity), multipliers.tangential
    inside = [
        Complementarity(
            Label(SLIDING_INSIDE_CONE, direction, contact=contact.name),
            signed,
            unused,
            vanishing=True,
            level="velocity",
            vector_component=True,
        )
        for velocity, (forwards, backwards) in zip(velocities, DIRECTIONS, strict=True)
        for direction, signed in ((backwards, -velocity), (forwards, velocity))
    ]
    if multipliers.spares:
        inside[0] = replace(inside[0], spare=multipliers.spares[0])  # they have one H and are active together
    across = friction[0] * velocities[1] - friction[1] * velocities[0]
    along = friction[0] * velocities[0] + friction[1] * velocities[1]
    lateral = DIRECTIONS[1]
    return inside + [
        Complementarity(
            Label(kind, direction, contact=contact.name),
            signed,
            ca.SX(1),
            vanishing=True,
            level="velocity",
            held_at=HeldAt.POINTS_AND_STAGES if kind == FRICTION_WITH_SLIDING else HeldAt.STAGES,
            implied_by=(
                (SLIDING_INSIDE_CONE, ActiveFactor.G),
                (FORCE_AT_A_DISTANCE, ActiveFactor.H),
                (FORCE_WHILE_PARTING, ActiveFactor.H),
            ),
        )
        for kind, direction, signed in (
            (FRICTION_ACROSS_SLIDING, lateral[0], across),
            (FRICTION_ACROSS_SLIDING, lateral[1], -across),
            (FRICTION_WITH_SLIDING, "", along),
        )
    ]
