"""Time-freezing dynamics: free motion and, with the clock standing still, what impacts do to the velocity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from fesd_robot.contact.model import AuxiliaryMultipliers, Contact, ContactOptions, MultibodyDynamics


@dataclass(frozen=True)
class FreezingState:
    """Symbols of a time-freezing system: y = (q, v, t, p) and control (u, s); no p without an integrated gap.

    Attributes:
        state: y, SX (n_q + n_v + 1 + n_gaps).
        control: (u, s), SX (n_u + 1).
        speed: s, dimensionless.
        gaps: p, m, SX (n_c), or (0) without an integrated gap.
        state_names, control_names: one an entry.
    """

    state: ca.SX
    control: ca.SX
    speed: ca.SX
    gaps: ca.SX
    state_names: list[str]
    control_names: list[str]


def freezing_state(dynamics: MultibodyDynamics, contacts: Sequence[Contact], options: ContactOptions) -> FreezingState:
    """Return the symbols of the time-freezing system.

    Args:
        dynamics: M, h, B u and q' of the robot as expressions of q, v, u.
        contacts: gap, directions and friction of every contact, (n_c).
        options: form of the contact logic, Baumgarte gain and auxiliary force.
    """
    speed, clock = ca.SX.sym("s"), ca.SX.sym("t")
    gaps = ca.SX.sym("p", len(contacts) if options.steps.gap == "integrated" else 0)
    return FreezingState(
        state=ca.vertcat(dynamics.configuration, dynamics.velocity, clock, gaps),
        control=ca.vertcat(dynamics.control, speed),
        speed=speed,
        gaps=gaps,
        state_names=[
            *dynamics.configuration_names,
            *(f"{name} velocity" for name in dynamics.velocity_names),
            "clock",
            *[f"{contact.name} integrated gap" for contact in contacts][: gaps.numel()],
        ],
        control_names=[*dynamics.control_names, "speed of time"],
    )


def stabilised_normal_velocities(
    dynamics: MultibodyDynamics, contacts: Sequence[Contact], options: ContactOptions, symbols: FreezingState
) -> list[ca.SX]:
    """Return the stabilised normal velocity of every contact: J_n v, or J_n v + kappa (f_c - p) with an integrated gap.

    The second term is a Baumgarte stabilisation. It pulls p to the true gap in flight. In stance, where p = 0, it pulls
    the true gap to zero: what the Runge-Kutta scheme lets drift there decays with the rate kappa.

    Args:
        dynamics, contacts, options: as in `freezing_state`.
        symbols: of the system.

    Returns:
        m/s, positive when parting, SX scalar in y for every contact, (n_c).
    """
    velocities = [ca.dot(contact.normal, dynamics.velocity) for contact in contacts]
    if not symbols.gaps.numel():
        return velocities
    return [
        velocity + options.baumgarte_gain * (contact.gap - gap)
        for velocity, contact, gap in zip(velocities, contacts, ca.vertsplit(symbols.gaps), strict=True)
    ]


def freezing_dynamics(
    dynamics: MultibodyDynamics,
    contacts: Sequence[Contact],
    options: ContactOptions,
    symbols: FreezingState,
    theta_ode: ca.SX,
    multipliers: Sequence[AuxiliaryMultipliers],
) -> tuple[ca.SX, ca.SX]:
    """Return mass matrix and right-hand side, E y' = f.

    ``y' = theta_ODE s (dq/dt, M^-1 (B u - h), 1, J_n v + kappa (f_c - p)) + sum_c (theta_+ f_+ + theta_- f_-)`` with
    ``f_+ = (0, M^-1 (J_n - mu J_t) a_n, 0, 0)`` and ``f_- = (0, M^-1 (J_n + mu J_t) a_n, 0, 0)``; in space they push
    with ``beta J_n + mu sum_k (theta_k- - theta_k+) J_tk``. E carries the mass matrix, so that M is never inverted.

    Args:
        dynamics, contacts, options: as in `freezing_state`.
        symbols: of the system.
        theta_ode: Filippov multiplier of the free motion, SX scalar.
        multipliers: of every contact.

    Source: Nurkanovic et al., arXiv 2111.06759, section 3; the integrated gap is ours.
    """
    rate = theta_ode * symbols.speed
    push = ca.SX.zeros(dynamics.velocity.numel())
    for contact, own in zip(contacts, multipliers, strict=True):
        push += own.normal * contact.normal
        if contact.friction > 0:
            for direction, share in zip(contact.directions, own.tangential, strict=True):
                push += contact.usable_friction * share * direction
    gap_rates = []
    if symbols.gaps.numel():
        gap_rates = [rate * velocity for velocity in stabilised_normal_velocities(dynamics, contacts, options, symbols)]
    right_hand_side = ca.vertcat(
        rate * dynamics.configuration_derivative,
        rate * dynamics.force + options.auxiliary_force * push,
        rate,
        *gap_rates,
    )
    identity = ca.SX.eye
    mass_matrix = ca.diagcat(
        identity(dynamics.configuration.numel()), dynamics.mass_matrix, identity(1 + len(gap_rates))
    )
    return mass_matrix, right_hand_side


def free_flow_multiplier(complements: Sequence[ca.SX]) -> tuple[ca.SX, list[tuple[str, ca.SX, ca.SX]]]:
    """Return theta_ODE = prod_c (1 - beta_c), with its partial products as lifted (name, symbol, definition).

    Args:
        complements: 1 - beta of every contact.
    """
    product, lifted = complements[0], []
    for i, complement in enumerate(complements[1:], start=2):
        symbol = ca.SX.sym(f"theta_ode{i}")
        lifted.append((f"theta_ODE of {i} contacts", symbol, product * complement))
        product = symbol
    return product, lifted
