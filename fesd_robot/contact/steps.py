"""Contact as set-valued step functions with a clock that stops during impacts (time-freezing)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import casadi as ca

from fesd_robot.dcs import ComplementaritySystem, Exclusion, heaviside


@dataclass(frozen=True)
class Mechanics:
    """M(q) dv/dt = force(q, v, u), dq/dt = configuration_derivative(q, v), as SX expressions.

    Attributes:
        configuration, velocity, control: symbols q (n_q), v (n_v), u (n_u).
        configuration_derivative: (n_q); `mass_matrix`: (n_v, n_v); `force`: B u - h, (n_v).
        configuration_names, velocity_names, control_names: one name an entry.
    """

    configuration: ca.SX
    velocity: ca.SX
    control: ca.SX
    configuration_derivative: ca.SX
    mass_matrix: ca.SX
    force: ca.SX
    configuration_names: Sequence[str]
    velocity_names: Sequence[str]
    control_names: Sequence[str]


@dataclass(frozen=True)
class PlanarContact:
    """A contact in the plane: gap f_c(q), m; J_n and J_t in velocity space, (n_v); friction coefficient mu."""

    name: str
    gap: ca.SX
    normal: ca.SX
    tangent: ca.SX
    friction: float


@dataclass(frozen=True)
class StepOptions:
    """Which form of the step functions is built.

    Args:
        gap: ``integrated`` switches on the state p with p' = theta_ODE s (J_n v + kappa p (f_c - p)); ``true`` on f_c(q).
        gap_feedback: kappa, 1/(m s).
        gate: let velocity signs count at the ground only, (1 - alpha_q) J v instead of J v.
        selection_weight: epsilon of epsilon ||alpha||^2 at every stage.
        auxiliary_acceleration: a_n, N per unit of J_n, strength of the auxiliary field.
    """

    gap: Literal["integrated", "true"] = "integrated"
    gap_feedback: float = 30.0
    gate: bool = True
    selection_weight: float = 1e-3
    auxiliary_acceleration: float = 100.0


@dataclass(frozen=True)
class StepContactSystem:
    """The time-freezing system and the expressions that lead back to physics.

    The state is y = (q, v, t, p_1..p_nc), the control (u, s) with the speed of time s last.

    Attributes:
        system: the complementarity system.
        theta_ode: share of free motion, SX in z; zero while the clock stands still.
        theta_auxiliary: (plus, minus) multipliers of each contact's auxiliary fields, SX in z.
        clock_rate: theta_ode * s = dt/dtau.
        theta_error: largest deviation of the lifted multipliers from their definition; for one contact this is
            |theta_ODE + theta_+ + theta_- - 1|.
        integrated_gap: whether the p states exist.
    """

    system: ComplementaritySystem
    theta_ode: ca.SX
    theta_auxiliary: list[tuple[ca.SX, ca.SX]]
    clock_rate: ca.SX
    theta_error: ca.SX
    integrated_gap: bool


def step_contact_system(
    mechanics: Mechanics,
    contacts: Sequence[PlanarContact],
    options: StepOptions,
    parameters: ca.SX | None = None,
) -> StepContactSystem:
    """Return rigid-body motion with planar contacts as a Heaviside system.

    With beta_c = (1 - alpha_q)(1 - alpha_n) and theta_ODE = prod_c (1 - beta_c),

    ``y' = theta_ODE s (dq/dt, M^-1 (B u - h), 1) + sum_c beta_c (0, M^-1 (J_n + (1 - 2 alpha_t) mu J_t) a_n, 0)``

    where the last bracket is theta_+ f_+ + theta_- f_- with theta_+ = beta alpha_t, theta_- = beta (1 - alpha_t),
    f_-+ = M^-1 (J_n +- mu J_t) a_n. The steps are those of psi = (p or f_c, J_n v, J_t v); a contact without friction
    has no alpha_t. beta_c, and the partial products of theta_ODE for several contacts, are lifted. The mass matrix stays
    on the left side, so M is never inverted.

    Source: Nurkanovic et al., arXiv 2111.06759 (time-freezing), arXiv 2303.18066, section V (multipliers).
    """
    q, v, u = mechanics.configuration, mechanics.velocity, mechanics.control
    n_v = v.numel()
    speed, clock = ca.SX.sym("s"), ca.SX.sym("t")
    gap_state = ca.SX.sym("p", len(contacts) if options.gap == "integrated" else 0)

    alpha, switching, step_names, lifted = [], [], [], []
    exclusions: list[Exclusion] = []
    lifted_beta: list[ca.SX] = []
    free_share: dict[int, ca.SX] = {}
    theta_ode: ca.SX = ca.SX(1)
    theta_exact, theta_error = ca.SX(1), []
    auxiliary_force = ca.SX.zeros(n_v)
    theta_auxiliary = []
    for i, contact in enumerate(contacts):
        gap = gap_state[i] if options.gap == "integrated" else contact.gap
        at_gap, closing = ca.SX.sym(f"alpha_q{i}"), ca.SX.sym(f"alpha_n{i}")
        gate = 1 - at_gap if options.gate else ca.SX(1)
        beta = ca.SX.sym(f"beta{i}")
        if options.gate:
            free_share[len(alpha) + 1] = 1 - beta if not __import__("os").environ.get("OLD") else closing
        alpha += [at_gap, closing]
        switching += [gap, gate * ca.dot(contact.normal, v)]
        step_names += [f"{contact.name} gap", f"{contact.name} normal velocity"]
        lifted_beta.append(beta)
        lifted.append((f"beta[{contact.name}]", beta, (1 - at_gap) * (1 - closing)))
        theta_exact *= 1 - (1 - at_gap) * (1 - closing)
        theta_error.append(beta - (1 - at_gap) * (1 - closing))
        if i == 0:
            theta_ode = 1 - beta
        else:
            product = ca.SX.sym(f"theta_ode{i}")
            lifted.append((f"theta_ODE[{i + 1} contacts]", product, theta_ode * (1 - beta)))
            theta_ode = product
        force = beta * contact.normal
        if contact.friction > 0:
            sliding = ca.SX.sym(f"alpha_t{i}")
            alpha.append(sliding)
            switching.append(gate * ca.dot(contact.tangent, v))
            step_names.append(f"{contact.name} tangential velocity")
            theta_auxiliary.append((beta * sliding, beta * (1 - sliding)))
            force += contact.friction * beta * (1 - 2 * sliding) * contact.tangent
        else:
            theta_auxiliary.append((beta, ca.SX(0)))
        auxiliary_force += options.auxiliary_acceleration * force

    theta_error.append(theta_ode - theta_exact)
    rate = theta_ode * speed
    gap_rates = [
        rate * (ca.dot(contact.normal, v) + options.gap_feedback * gap_state[i] * (contact.gap - gap_state[i]))
        for i, contact in enumerate(contacts if options.gap == "integrated" else [])
    ]
    state = ca.vertcat(q, v, clock, gap_state)
    n_after = 1 + gap_state.numel()
    if options.gate:
        for i, contact in enumerate(contacts):
            plus, minus = theta_auxiliary[i]
            beta = lifted_beta[i]
            vn, vt = ca.dot(contact.normal, v), ca.dot(contact.tangent, v)
            exclusions += [
                Exclusion("vn>0", vn, beta, boundary_only=True),
                Exclusion("vn<0", -vn, beta, 1 - beta, boundary_only=True),
                Exclusion("vt<0", -vt, plus, boundary_only=True),
                Exclusion("vt>0", vt, minus, boundary_only=True),
            ]
    system = heaviside(
        exclusions=exclusions,
        state=state,
        control=ca.vertcat(u, speed),
        parameters=parameters,
        alpha=ca.vertcat(*alpha),
        switching=ca.vertcat(*switching),
        right_hand_side=ca.vertcat(
            rate * mechanics.configuration_derivative, rate * mechanics.force + auxiliary_force, rate, *gap_rates
        ),
        mass_matrix=ca.diagcat(ca.SX.eye(q.numel()), mechanics.mass_matrix, ca.SX.eye(n_after)),
        lifted=lifted,
        negative_partner=free_share,
        selection_weight=options.selection_weight,
        state_names=[*mechanics.configuration_names, *(f"{name} velocity" for name in mechanics.velocity_names), "clock"]
        + [f"{contact.name} integrated gap" for contact in contacts][: gap_state.numel()],
        control_names=[*mechanics.control_names, "speed of time"],
        step_names=step_names,
    )
    return StepContactSystem(
        system=system,
        theta_ode=theta_ode,
        theta_auxiliary=theta_auxiliary,
        clock_rate=rate,
        theta_error=ca.mmax(ca.fabs(ca.vertcat(*theta_error))),
        integrated_gap=options.gap == "integrated",
    )
