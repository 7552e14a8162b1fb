"""Contact as set-valued step functions of gap and velocities, the published form."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Complementarity, HeldAt
from fesd_robot.contact.freezing import (
    free_flow_multiplier,
    freezing_dynamics,
    freezing_state,
    stabilised_normal_velocities,
)
from fesd_robot.contact.model import AuxiliaryMultipliers, Contact, ContactOptions, ContactSystem, MultibodyDynamics
from fesd_robot.contact.velocities import velocity_conditions
from fesd_robot.dcs import Model, StepFunctions, heaviside

GAP, NORMAL_VELOCITY, TANGENTIAL_VELOCITY = "gap", "normal velocity", "tangential velocity"
STEPS = (GAP, NORMAL_VELOCITY, TANGENTIAL_VELOCITY)
"""The step functions of a contact, the subjects of their conditions."""


def step_contact_system(
    dynamics: MultibodyDynamics,
    contacts: Sequence[Contact],
    options: ContactOptions,
    parameters: ca.SX | None = None,
) -> ContactSystem:
    """Return rigid-body motion with planar contacts as a Heaviside system.

    With the steps alpha of psi = (p or f_c, J_n v, J_t v), beta_c = (1 - alpha_q)(1 - alpha_n) and
    theta_ODE = prod_c (1 - beta_c), theta_+ = beta alpha_t, theta_- = beta (1 - alpha_t); a contact
    without friction has no alpha_t. beta_c, and the partial products of theta_ODE for several contacts, are lifted.

    With `StepOptions.gate` the velocity steps are those of (1 - alpha_q) J v, vacuous in flight. Their multipliers at
    a touchdown then belong to the flight before it and vanish; the conditions they would have carried into the element
    that begins there are held on the state at its left boundary.

    All steps, those of velocities too, are conditions of the position level, so that a homotopy relaxes them alike.

    Args:
        dynamics, contacts, options: as in `freezing.freezing_state`.
        parameters: SX symbols that costs and constraints will use; none if omitted.

    Source: Nurkanovic et al., arXiv 2111.06759 (time-freezing), arXiv 2303.18066, section V (multipliers).
    """
    symbols = freezing_state(dynamics, contacts, options)
    alpha: list[ca.SX] = []
    switching: list[ca.SX] = []
    step_names: list[str] = []
    lifted: list[tuple[str, ca.SX, ca.SX]] = []
    vanishing: list[Complementarity] = []
    excluded: dict[int, ca.SX] = {}
    multipliers, complements, errors, exact = [], [], [], ca.SX(1)
    velocities = stabilised_normal_velocities(dynamics, contacts, options, symbols)
    for i, (contact, normal_velocity) in enumerate(zip(contacts, velocities, strict=True)):
        gap = symbols.gaps[i] if options.steps.gap == "integrated" else contact.gap
        at_gap, parting, beta = (ca.SX.sym(f"{name}{i}") for name in ("alpha_q", "alpha_n", "beta"))
        gate = 1 - at_gap if options.steps.gate else ca.SX(1)
        if options.steps.gate:
            excluded[len(alpha) + 1] = 1 - beta
        alpha += [at_gap, parting]
        switching += [gap, gate * normal_velocity]
        step_names += [f"{contact.name} {GAP}", f"{contact.name} {NORMAL_VELOCITY}"]
        definition = (1 - at_gap) * (1 - parting)
        lifted.append((f"beta[{contact.name}]", beta, definition))
        plus, minus = beta, ca.SX(0)
        if contact.friction > 0:
            sliding = ca.SX.sym(f"alpha_t{i}")
            alpha.append(sliding)
            switching.append(gate * contact.tangential_velocities(dynamics.velocity)[0])
            step_names.append(f"{contact.name} {TANGENTIAL_VELOCITY}")
            plus, minus = beta * sliding, beta * (1 - sliding)
        own = AuxiliaryMultipliers(((plus, minus),))
        if options.steps.gate:
            vanishing += velocity_conditions(
                dynamics, contact, normal_velocity, beta, 1 - beta, own, held_at=HeldAt.LEFT_BOUNDARY
            )
        multipliers.append(own)
        complements.append(1 - beta)
        errors.append(beta - definition)
        exact *= 1 - definition
    theta_ode, products = free_flow_multiplier(complements)
    mass_matrix, right_hand_side = freezing_dynamics(dynamics, contacts, options, symbols, theta_ode, multipliers)
    system = heaviside(
        Model(
            state=symbols.state,
            control=symbols.control,
            parameters=ca.SX(0, 1) if parameters is None else parameters,
            mass_matrix=mass_matrix,
            state_names=symbols.state_names,
            control_names=symbols.control_names,
        ),
        StepFunctions(ca.vertcat(*alpha), ca.vertcat(*switching), names=step_names, excluded=excluded),
        right_hand_side,
        lifted=[*lifted, *products],
        vanishing=vanishing,
        regularisation_weight=options.steps.regularisation_weight,
    )
    owners = {f"{contact.name} {step}": (contact.name, step) for contact in contacts for step in STEPS}
    conditions = [_owned(condition, owners) for condition in system.complementarities]
    return ContactSystem(
        system=replace(system, complementarities=conditions),
        theta_ode=theta_ode,
        theta_auxiliary=multipliers,
        clock_rate=theta_ode * symbols.speed,
        theta_error=ca.mmax(ca.fabs(ca.vertcat(*errors, theta_ode - exact))),
        integrated_gap=options.steps.gap == "integrated",
        gap_lower=-np.inf,
    )


def _owned(condition: Complementarity, owners: Mapping[str, tuple[str, str]]) -> Complementarity:
    """Return the condition of a step with the contact that the step belongs to."""
    if condition.label.contact is not None:
        return condition
    contact, step = owners[condition.label.subject]
    return replace(condition, label=replace(condition.label, contact=contact, subject=step))
