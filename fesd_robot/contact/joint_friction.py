"""Dry friction of joints: a set-valued force that lets a joint stick and slide."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Complementarity, Label
from fesd_robot.contact.kinds import BACKWARDS, FORWARDS
from fesd_robot.contact.model import ContactSystem, MultibodyDynamics

FRICTION_ALONG_MOTION = "dry friction along the motion"
"""Kind of the vanishing constraints of a joint's dry friction; their subjects are directions of motion."""


def with_dry_friction(contact_system: ContactSystem, dynamics: MultibodyDynamics) -> ContactSystem:
    """Return the contact system in which joints have dry friction, exactly: tau_f in -F Sgn(v), Sgn(0) = [-1, 1].

    The rate theta_ODE of the free motion is split into two shares, one for each direction of a joint's motion,

        theta_ODE = pi_+ + pi_-,   pi_+, pi_- >= 0,   v < 0 => pi_+ = 0,   v > 0 => pi_- = 0

    between all points of a finite element, and the force is -F (pi_+ - pi_-) / theta_ODE. Where v stays zero, that
    determines the shares: the joint sticks with any |tau_f| <= F. While the clock stands still both shares vanish: the
    force is bounded, so that it has no impulse, and an impact may turn the motion of a joint round. Coordinates of a
    limit surface are left to `limit_surface.with_limit_surfaces`.

    Args:
        contact_system: in the multiplier form, without dry friction of joints.
        dynamics: whose velocity coordinates have the limits F.

    Source: Filippov's convexification, as for the friction of a contact (Nurkanovic et al., arXiv 2111.06759); the
    shares of the clock's rate are ours.
    """
    shared = {name for names in dynamics.limit_surfaces.values() for name in names}
    limits = zip(dynamics.velocity_names, dynamics.dry_friction_limits, strict=True)
    rows = [i for i, (name, limit) in enumerate(limits) if limit > 0 and name not in shared]
    if not rows:
        return contact_system
    system, count = contact_system.system, len(rows)
    plus, minus = ca.SX.sym("pi_plus", count), ca.SX.sym("pi_minus", count)
    shares = list(zip(ca.vertsplit(plus), ca.vertsplit(minus), strict=True))
    names = [dynamics.velocity_names[i] for i in rows]
    first = dynamics.configuration.numel()
    right_hand_side, speed = ca.SX(system.right_hand_side), system.control[-1]
    conditions: list[Complementarity] = []
    for i, name, (forwards, backwards) in zip(rows, names, shares, strict=True):
        right_hand_side[first + i] -= speed * float(dynamics.dry_friction_limits[i]) * (forwards - backwards)
        velocity = dynamics.velocity[i]
        conditions += [
            Complementarity(
                Label(FRICTION_ALONG_MOTION, direction, joint=name),
                signed_velocity,
                share,
                vanishing=True,
                level="velocity",
                rate_share=True,
            )
            for direction, signed_velocity, share in (
                (BACKWARDS, -velocity, forwards),
                (FORWARDS, velocity, backwards),
            )
        ]
    free_flow = ca.Function("free_flow", [system.algebraic], [contact_system.theta_ode])

    def guess(x: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        z = system.guess(x, u, p)
        rate = float(free_flow(z))
        along = 0.5 * (1 + np.sign(x[first + np.array(rows)])) * rate
        return np.concatenate([z, along, rate - along])

    return replace(
        contact_system,
        system=replace(
            system,
            right_hand_side=right_hand_side,
            algebraic=ca.vertcat(system.algebraic, plus, minus),
            residual=ca.vertcat(system.residual, plus + minus - contact_system.theta_ode),
            algebraic_lower=np.append(system.algebraic_lower, np.zeros(2 * count)),
            algebraic_upper=np.append(system.algebraic_upper, np.full(2 * count, np.inf)),
            guess=guess,
            algebraic_names=[
                *system.algebraic_names,
                *(f"pi_{sign}[{name}]" for sign in ("+", "-") for name in names),
            ],
            complementarities=[*system.complementarities, *conditions],
        ),
        theta_joints=shares,
    )
