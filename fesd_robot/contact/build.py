"""The choice between the forms of the contact logic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from fesd_robot.contact.compliance import CompliantContact, with_compliance
from fesd_robot.contact.impulses import impulse_contact_system
from fesd_robot.contact.model import Contact, ContactOptions, ContactSystem, MultibodyDynamics, StepOptions
from fesd_robot.contact.multipliers import multiplier_contact_system
from fesd_robot.contact.steps import step_contact_system
from fesd_robot.errors import OptionError


def contact_system(
    dynamics: MultibodyDynamics,
    contacts: Sequence[Contact],
    options: ContactOptions,
    parameters: ca.SX | None = None,
    compliant: Sequence[CompliantContact] = (),
) -> ContactSystem:
    """Return rigid-body motion with contacts in the form that `options` names.

    Args:
        dynamics, contacts: of the robot, (n_c) rigid contacts.
        options: form of the contact logic, Baumgarte gain and auxiliary force.
        parameters: SX symbols that costs and constraints will use, constant on each control interval.
        compliant: contacts that give way.

    Raises:
        OptionError: a variant of the step form where another form is built; dry friction of joints, compliant contacts
            or contact in space in the step form; dry friction of joints, contact in space, a limit of the slip distance
            or the damping of a compliant contact with impulses; a reserve of friction of a contact that may slip or
            bounce in either.
    """
    _refuse_compliance(options, compliant)
    system = _rigid_system(dynamics, contacts, options, parameters)
    return with_compliance(system, dynamics, compliant, options.auxiliary_force)


def _refuse_compliance(options: ContactOptions, compliant: Sequence[CompliantContact]) -> None:
    """Raise for compliant contacts in a form that does not have them."""
    names, damped = (", ".join(one.name for one in compliant if one.damping >= least) for least in (0.0, _DAMPED))
    if options.transcription == "freezing" and options.form == "steps" and names:
        raise OptionError(f"compliant contacts ({names}) need the form 'multipliers', found 'steps'")
    if options.transcription == "impulses" and damped:
        raise OptionError(
            f"damping of compliant contacts ({damped}) needs contact 'freezing', found 'impulses', which make it jump"
        )


_DAMPED = np.finfo(float).tiny
"""N s/m; least damping that is some."""


def _rigid_system(
    dynamics: MultibodyDynamics, contacts: Sequence[Contact], options: ContactOptions, parameters: ca.SX | None
) -> ContactSystem:
    """Return the system without compliant contacts, see `contact_system`."""
    if options.steps != StepOptions() and (options.form != "steps" or options.transcription == "impulses"):
        raise OptionError(f"found {options.steps}, which needs the form 'steps' and the transcription 'freezing'")
    reserved = [contact.name for contact in contacts if contact.sticking_reserve > 0]
    if reserved and (options.form == "steps" or options.transcription == "impulses"):
        form = "'steps'" if options.form == "steps" else "'impulses'"
        raise OptionError(
            f"a reserve of friction of contacts that may slip or bounce ({', '.join(reserved)}) needs contact "
            f"'freezing' with the form 'multipliers', found {form}"
        )
    if options.transcription == "impulses":
        return _with_gaps_bounded(impulse_contact_system(dynamics, contacts, options, parameters), dynamics)
    if options.form == "steps" and dynamics.dry_friction:
        joints = ", ".join(dynamics.dry_friction)
        raise OptionError(f"dry friction of joints ({joints}) needs the form 'multipliers', found 'steps'")
    if options.form == "steps" and any(contact.in_space for contact in contacts):
        raise OptionError("contact in space needs the form 'multipliers', found 'steps'")
    if options.form == "steps":
        return _with_gaps_bounded(step_contact_system(dynamics, contacts, options, parameters), dynamics)
    return _with_gaps_bounded(multiplier_contact_system(dynamics, contacts, options, parameters), dynamics)


def _with_gaps_bounded(contact: ContactSystem, dynamics: MultibodyDynamics) -> ContactSystem:
    """Return the system whose integrated gaps have their lower bound also where nobody states it."""
    lower = np.full(contact.system.state.numel(), -np.inf)
    first = dynamics.configuration.numel() + dynamics.velocity.numel() + 1  # behind the clock
    lower[first : first + contact.gap_states] = contact.gap_lower
    return replace(contact, system=replace(contact.system, state_lower=lower))
