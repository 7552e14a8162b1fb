"""Contact with the Filippov multipliers of the auxiliary fields as variables: the step functions eliminated."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Complementarity, Label
from fesd_robot.contact.freezing import (
    free_flow_multiplier,
    freezing_dynamics,
    freezing_state,
    stabilised_normal_velocities,
)
from fesd_robot.contact.joint_friction import with_dry_friction
from fesd_robot.contact.model import ContactOptions, ContactSystem, MultibodyDynamics, PlanarContact
from fesd_robot.contact.slip_distance import limit_slip_distances
from fesd_robot.contact.velocities import FORCE_AT_A_DISTANCE, velocity_conditions
from fesd_robot.dcs import ComplementaritySystem


def multiplier_contact_system(
    dynamics: MultibodyDynamics,
    contacts: Sequence[PlanarContact],
    options: ContactOptions,
    parameters: ca.SX | None = None,
) -> ContactSystem:
    """Return rigid-body motion with planar contacts whose variables are Filippov multipliers.

    With beta = theta_+ + theta_-, its complement 1 - beta >= 0 and theta_ODE = prod_c (1 - beta_c), the step logic of
    gap p >= 0, normal velocity J_n v and tangential velocity J_t v says, for every contact and between all points of a
    finite element:

    - no force at a distance: ``p beta = 0``;
    - no force while parting, ``J_n v > 0 => beta = 0``, and no free motion while approaching a closed contact,
      ``J_n v < 0 and beta > 0 => beta = 1``: an impact fills its element, and the clock stands still in all of it;
    - friction opposes sliding: ``J_t v < 0 => theta_+ = 0`` and ``J_t v > 0 => theta_- = 0``.

    In flight every condition is vacuous, so no element ends where a velocity changes its sign in the air. In stance
    p = 0 holds along the element, so J_n v = 0 at its stages determines beta, and nothing is left to choose.

    The complement is a variable of its own where there is friction: without its bound time could run backwards
    (1 - beta as low as -1), which a relaxed problem with a cheap motion makes use of.

    A step function needs three variables and two pairs at every stage (alpha, lambda_n, lambda_p), three steps a
    contact; this form needs three variables a contact. The left boundary takes part through the state itself. (Gating
    the velocity steps by 1 - alpha_q loses it: the multiplier of a touchdown belongs to the element before, where the
    gate is shut, and an element may then smear an impact over moving time, with energy from nowhere.)

    Args:
        dynamics, contacts, options: as in `freezing.freezing_state`.
        parameters: SX symbols that costs and constraints will use; none if omitted.

    Source: the step functions of arXiv 2303.18066, section V, eliminated by the signs of a time-freezing contact
    (arXiv 2111.06759, section 3).
    """
    symbols = freezing_state(dynamics, contacts, options)
    names: list[str] = []
    variables: list[ca.SX] = []
    upper: list[float] = []
    conditions: list[Complementarity] = []
    complements: list[ca.SX] = []
    lifted: list[tuple[str, ca.SX, ca.SX]] = []
    multipliers: list[tuple[ca.SX, ca.SX]] = []
    exact = ca.SX(1)
    velocities = stabilised_normal_velocities(dynamics, contacts, options, symbols)
    for i, (gap, velocity, contact) in enumerate(zip(ca.vertsplit(symbols.gaps), velocities, contacts, strict=True)):
        plus, minus = ca.SX.sym(f"theta_plus{i}"), ca.SX(0)
        beta, complement, bounds = plus, 1 - plus, [1.0]
        variables.append(plus)
        names.append(f"theta_+[{contact.name}]")
        if contact.friction > 0:
            minus, complement = ca.SX.sym(f"theta_minus{i}"), ca.SX.sym(f"complement{i}")
            beta, bounds = plus + minus, [np.inf, np.inf]
            variables.append(minus)
            names.append(f"theta_-[{contact.name}]")
            lifted.append((f"1 - beta[{contact.name}]", complement, 1 - beta))
        label = Label(FORCE_AT_A_DISTANCE, contact=contact.name)
        conditions.append(Complementarity(label, gap, beta, vanishing=True, invariant=True))
        conditions += velocity_conditions(dynamics, contact, velocity, beta, complement, (plus, minus))
        upper += bounds
        multipliers.append((plus, minus))
        complements.append(complement)
        exact *= 1 - beta
    theta_ode, products = free_flow_multiplier(complements)
    lifted += products
    mass_matrix, right_hand_side = freezing_dynamics(dynamics, contacts, options, symbols, theta_ode, multipliers)
    n_theta, n_lifted, n_products, nothing = len(variables), len(lifted), len(products), ca.SX(0, 1)
    system = ComplementaritySystem(
        state=symbols.state,
        control=symbols.control,
        parameters=nothing if parameters is None else parameters,
        algebraic=ca.vertcat(*variables, *[symbol for _, symbol, _ in lifted]),
        mass_matrix=mass_matrix,
        right_hand_side=right_hand_side,
        residual=ca.vertcat(nothing, *[symbol - definition for _, symbol, definition in lifted]),
        algebraic_lower=np.append(np.zeros(n_theta + n_lifted - n_products), np.full(n_products, -np.inf)),
        algebraic_upper=np.concatenate([upper, np.full(n_lifted, np.inf)]),
        regularisation=ca.SX(0),
        guess=lambda x, u, p: np.concatenate([np.zeros(n_theta), np.ones(n_lifted)]),
        state_names=symbols.state_names,
        control_names=symbols.control_names,
        algebraic_names=[*names, *(name for name, _, _ in lifted)],
        complementarities=conditions,
    )
    contact_system = ContactSystem(
        system=system,
        theta_ode=theta_ode,
        theta_auxiliary=multipliers,
        clock_rate=theta_ode * symbols.speed,
        theta_error=ca.fabs(theta_ode - exact),
        integrated_gap=True,
        gap_lower=0.0,
    )
    return limit_slip_distances(with_dry_friction(contact_system, dynamics), dynamics, contacts)
