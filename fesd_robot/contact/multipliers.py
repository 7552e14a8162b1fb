"""Contact with the Filippov multipliers of the auxiliary fields as variables: the step functions eliminated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

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
from fesd_robot.contact.kinds import FORCE_AT_A_DISTANCE
from fesd_robot.contact.limit_surface import with_limit_surfaces
from fesd_robot.contact.model import (
    STICKING_MARGIN,
    AuxiliaryMultipliers,
    Contact,
    ContactOptions,
    ContactSystem,
    MultibodyDynamics,
)
from fesd_robot.contact.one_at_a_time import with_one_at_a_time
from fesd_robot.contact.slip_distance import limit_slip_distances
from fesd_robot.contact.velocities import velocity_conditions
from fesd_robot.dcs import ComplementaritySystem


def multiplier_contact_system(
    dynamics: MultibodyDynamics,
    contacts: Sequence[Contact],
    options: ContactOptions,
    parameters: ca.SX | None = None,
) -> ContactSystem:
    """Return rigid-body motion with contacts whose variables are Filippov multipliers.

    With beta = theta_+ + theta_-, its complement 1 - beta >= 0 and theta_ODE = prod_c (1 - beta_c), the step logic of
    gap p >= 0, normal velocity J_n v and tangential velocity J_t v says, for every contact and between all points of a
    finite element:

    - no force at a distance: ``p beta = 0``;
    - no force while parting, ``J_n v > 0 => beta = 0``, and no free motion while approaching a closed contact,
      ``J_n v < 0 and beta > 0 => beta = 1``: an impact fills its element, and the clock stands still in all of it;
    - friction opposes sliding: ``J_t v < 0 => theta_+ = 0`` and ``J_t v > 0 => theta_- = 0``.

    A contact with restitution has further conditions, see `velocity_conditions`.

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
    velocities = stabilised_normal_velocities(dynamics, contacts, options, symbols)
    fields = [_auxiliary_fields(i, contact) for i, contact in enumerate(contacts)]
    conditions: list[Complementarity] = []
    exact = ca.SX(1)
    for gap, velocity, contact, own in zip(ca.vertsplit(symbols.gaps), velocities, contacts, fields, strict=True):
        label = Label(FORCE_AT_A_DISTANCE, contact=contact.name)
        about = [
            Complementarity(label, gap, own.beta, vanishing=True, invariant=True),
            *velocity_conditions(
                dynamics, contact, velocity, own.beta, own.complement, own.multipliers, unused=own.unused
            ),
        ]
        conditions += [replace(one, vanish_together=own.vanish_together) if one.H is own.beta else one for one in about]
        exact *= 1 - own.beta
    multipliers = [own.multipliers for own in fields]
    theta_ode, products = free_flow_multiplier([own.complement for own in fields])
    mass_matrix, right_hand_side = freezing_dynamics(dynamics, contacts, options, symbols, theta_ode, multipliers)
    names = [name for own in fields for name in own.names]
    variables = [variable for own in fields for variable in own.variables]
    lifted = [
        *(entry for own in fields for entry in own.lifted),
        *(_Lifted(*product, in_flight=1.0, lower=-np.inf) for product in products),
    ]
    n_theta, nothing = len(variables), ca.SX(0, 1)
    system = ComplementaritySystem(
        state=symbols.state,
        control=symbols.control,
        parameters=nothing if parameters is None else parameters,
        algebraic=ca.vertcat(*variables, *[one.symbol for one in lifted]),
        mass_matrix=mass_matrix,
        right_hand_side=right_hand_side,
        residual=ca.vertcat(nothing, *[one.symbol - one.definition for one in lifted]),
        algebraic_lower=np.append(np.zeros(n_theta), [one.lower for one in lifted]),
        algebraic_upper=np.concatenate([*(own.upper for own in fields), np.full(len(lifted), np.inf)]),
        regularisation=ca.SX(0),
        guess=lambda x, u, p: np.append(np.zeros(n_theta), [one.in_flight for one in lifted]),
        state_names=symbols.state_names,
        control_names=symbols.control_names,
        algebraic_names=[*names, *(one.name for one in lifted)],
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
    with_friction = with_limit_surfaces(with_dry_friction(contact_system, dynamics), dynamics)
    return with_one_at_a_time(limit_slip_distances(with_friction, dynamics, contacts), dynamics)


class _Lifted(NamedTuple):
    """An algebraic variable that a row of its own defines, its value in flight, and its lower bound."""

    name: str
    symbol: ca.SX
    definition: ca.SX
    in_flight: float
    lower: float = 0.0


@dataclass(frozen=True)
class _AuxiliaryFields:
    """Variables of one contact.

    Attributes:
        names, variables, upper: of the multipliers, one an entry.
        lifted: further variables.
        multipliers, beta, complement: what the contact logic is made of.
        unused: part of the friction cone that is not used; None in the plane.
        vanish_together: variables that vanish with beta by the rows of the lifted ones.
    """

    names: list[str]
    variables: list[ca.SX]
    upper: list[float]
    lifted: list[_Lifted]
    multipliers: AuxiliaryMultipliers
    beta: ca.SX
    complement: ca.SX
    unused: ca.SX | None = None
    vanish_together: tuple[ca.SX, ...] = ()


def _auxiliary_fields(i: int, contact: Contact) -> _AuxiliaryFields:
    plus = ca.SX.sym(f"theta_plus{i}")
    if contact.friction == 0:
        none = tuple((plus, ca.SX(0)) for _ in contact.directions)
        multipliers = AuxiliaryMultipliers(none)
        return _AuxiliaryFields([f"theta_+[{contact.name}]"], [plus], [1.0], [], multipliers, plus, 1 - plus)
    minus, complement = ca.SX.sym(f"theta_minus{i}"), ca.SX.sym(f"complement{i}")
    beta = plus + minus
    planar = _AuxiliaryFields(
        names=[f"theta_+[{contact.name}]", f"theta_-[{contact.name}]"],
        variables=[plus, minus],
        upper=[np.inf, np.inf],
        lifted=[_Lifted(f"1 - beta[{contact.name}]", complement, 1 - beta, in_flight=1.0)],
        multipliers=AuxiliaryMultipliers(((plus, minus),)),
        beta=beta,
        complement=complement,
    )
    return _in_space(planar, i, contact) if contact.in_space else _with_reserve(planar, i, contact)


def _with_reserve(planar: _AuxiliaryFields, i: int, contact: Contact) -> _AuxiliaryFields:
    """Return the variables of a planar contact with what both its multipliers have to spare beyond r beta / 2."""
    if contact.sticking_reserve == 0:
        return planar
    least = contact.sticking_reserve / 2 * planar.beta
    spares = tuple(ca.SX.sym(f"spare_{side}{i}") for side in ("plus", "minus"))
    lifted = [
        _Lifted(f"beyond the reserve{sign}[{contact.name}]", spare, theta - least, in_flight=0.0, lower=-np.inf)
        for sign, spare, theta in zip("+-", spares, planar.multipliers.sides[0], strict=True)
    ]
    multipliers = replace(planar.multipliers, spares=spares)
    return replace(planar, lifted=[*planar.lifted, *lifted], multipliers=multipliers)


def _in_space(planar: _AuxiliaryFields, i: int, contact: Contact) -> _AuxiliaryFields:
    """Return the variables of a contact with a second pair of multipliers across the first, and the cone."""
    name, kept = contact.name, 2 * STICKING_MARGIN * (1 - planar.beta) if contact.slip_distance == 0 else 0
    left, right, unused = (ca.SX.sym(f"{what}{i}") for what in ("theta_left", "theta_right", "unused"))
    multipliers = AuxiliaryMultipliers((*planar.multipliers.sides, (left, right)))
    along, across = multipliers.tangential
    reserve: list[_Lifted] = []
    if contact.sticking_reserve > 0:
        spare = ca.SX.sym(f"spare{i}")
        inside = ((1 - contact.sticking_reserve) * planar.beta) ** 2 - along**2 - across**2
        reserve = [_Lifted(f"beyond the reserve[{name}]", spare, inside, in_flight=0.0, lower=-np.inf)]
        multipliers = replace(multipliers, spares=(spare,))
    return replace(
        planar,
        names=[*planar.names, f"theta_left[{name}]"],
        variables=[*planar.variables, left],
        upper=[*planar.upper, np.inf],
        lifted=[
            *planar.lifted,
            _Lifted(f"theta_right[{name}]", right, planar.beta - left, in_flight=0.0),
            _Lifted(
                f"unused friction[{name}]", unused, (1 - kept) * planar.beta**2 - along**2 - across**2, in_flight=0.0
            ),
            *reserve,
        ],
        multipliers=multipliers,
        unused=unused,
        vanish_together=(left, right, unused),
    )
