"""Contact with impulses at the boundaries of finite elements: no element in which the clock stands still."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import casadi as ca

from fesd_robot.contact.model import AuxiliaryMultipliers, Contact, ContactOptions, ContactSystem, MultibodyDynamics
from fesd_robot.dcs import Mechanism, UnilateralContact, with_contacts
from fesd_robot.errors import OptionError


def impulse_contact_system(
    dynamics: MultibodyDynamics,
    contacts: Sequence[Contact],
    options: ContactOptions,
    parameters: ca.SX | None = None,
) -> ContactSystem:
    """Return rigid-body motion with planar contacts whose velocity jumps by impulses.

    The state is y = (q, v, t, p) as in time freezing, but t' = s everywhere: with a fixed duration s is 1. Forces times
    s, in units of a_n, take the places of the auxiliary fields' multipliers, so ``lambda_n = a_n beta / s``.

    Args:
        dynamics, contacts: of the robot.
        options: Baumgarte gain, and a_n as the unit of forces.
        parameters: SX symbols that costs and constraints will use; none if omitted.

    Raises:
        OptionError: contact in space, dry friction of joints, a limit of the slip distance.

    Source: `fesd_robot.dcs.with_contacts`; Nurkanovic et al., arXiv 2305.17003.
    """
    _refuse(dynamics, contacts)
    speed, clock, nothing = ca.SX.sym("s"), ca.SX.sym("t"), ca.SX(0, 1)
    mechanism = Mechanism(
        configuration=dynamics.configuration,
        velocity=dynamics.velocity,
        mass_matrix=dynamics.mass_matrix,
        force=dynamics.force,
        control=ca.vertcat(dynamics.control, speed),
        parameters=nothing if parameters is None else parameters,
        configuration_derivative=dynamics.configuration_derivative,
        configuration_names=dynamics.configuration_names,
        velocity_names=[f"{name} velocity" for name in dynamics.velocity_names],
        control_names=[*dynamics.control_names, "speed of time"],
        pace=speed,
        further=clock,
        further_rate=speed,
        further_names=["clock"],
    )
    system = with_contacts(
        mechanism,
        [_unilateral(contact) for contact in contacts],
        baumgarte_gain=options.baumgarte_gain,
        force_unit=options.auxiliary_force,
    )
    assert system.jump is not None
    return ContactSystem(
        system=system,
        theta_ode=ca.SX(1),
        theta_auxiliary=list(_multipliers(contacts, system.algebraic[len(contacts) :])),
        clock_rate=speed,
        theta_error=ca.SX(0),
        integrated_gap=True,
        gap_lower=0.0,
        impulses=list(_multipliers(contacts, system.jump.algebraic)),
    )


def _unilateral(contact: Contact) -> UnilateralContact:
    return UnilateralContact(
        name=contact.name,
        gap=contact.gap,
        normal=contact.normal,
        tangent=contact.directions[0],
        friction=contact.usable_friction,
        restitution=contact.restitution,
        slips=contact.slip_distance > 0,
    )


def _multipliers(contacts: Sequence[Contact], edges: ca.SX) -> Iterator[AuxiliaryMultipliers]:
    """Yield the edges of every contact's cone; without friction there is one."""
    at = 0
    for contact in contacts:
        minus = edges[at + 1] if contact.friction > 0 else ca.SX(0)
        yield AuxiliaryMultipliers(((edges[at], minus),))
        at += 2 if contact.friction > 0 else 1


def _refuse(dynamics: MultibodyDynamics, contacts: Sequence[Contact]) -> None:
    if dynamics.dry_friction:
        joints = ", ".join(dynamics.dry_friction)
        raise OptionError(f"dry friction of joints ({joints}) needs contact 'freezing', found 'impulses'")
    for contact in contacts:
        if contact.in_space:
            raise OptionError(f"contact '{contact.name}' in space needs contact 'freezing', found 'impulses'")
        if contact.limits_slip:
            raise OptionError(
                f"contact '{contact.name}' with a limit of its slip distance needs contact 'freezing', found 'impulses'"
            )
