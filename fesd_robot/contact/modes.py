"""What a contact does in a finite element, read from the branch."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.contact.steps import GAP, NORMAL_VELOCITY, STEPS, TANGENTIAL_VELOCITY
from fesd_robot.contact.velocities import (
    BACKWARDS,
    FORCE_AT_A_DISTANCE,
    FORCE_WHILE_PARTING,
    FORWARDS,
    FRICTION_ALONG_SLIDING,
    MOTION_DURING_IMPACT,
)
from fesd_robot.dcs import ABOVE, BELOW


class ContactMode(str, Enum):
    """What one contact does."""

    FLIGHT = "flight"
    """No force."""
    IMPACT = "impact"
    """The clock stands still, and the force changes the velocity."""
    STICK = "stick"
    """Closed, without tangential velocity."""
    SLIP_FORWARDS = "slip+"
    """Closed, and moving along the tangent."""
    SLIP_BACKWARDS = "slip-"
    """Closed, and moving against the tangent."""
    SLIP = "slip"
    """Closed without friction: the branch leaves the tangential velocity open."""


def contact_modes(branch: Branch, element: int) -> dict[str, ContactMode]:
    """Return name of every contact -> its mode in a finite element."""
    return {name: _mode(name, branch.of_contact(element, name)) for name in branch.contacts}


def _mode(name: str, active: Mapping[tuple[str, str], ActiveFactor]) -> ContactMode:
    distance = active.get((FORCE_AT_A_DISTANCE, name))
    return _by_steps(name, active) if distance is None else _by_multipliers(name, active)


def _by_multipliers(name: str, active: Mapping[tuple[str, str], ActiveFactor]) -> ContactMode:
    """Read the vanishing constraints of `multiplier_contact_system`."""
    if ActiveFactor.H in (active[FORCE_AT_A_DISTANCE, name], active[FORCE_WHILE_PARTING, name]):
        return ContactMode.FLIGHT
    if active[MOTION_DURING_IMPACT, name] is ActiveFactor.COMPLEMENT:
        return ContactMode.IMPACT
    backwards, forwards = (active.get((FRICTION_ALONG_SLIDING, f"{name} {way}")) for way in (BACKWARDS, FORWARDS))
    if backwards is None:
        return ContactMode.SLIP
    if forwards is ActiveFactor.H:
        return ContactMode.SLIP_FORWARDS
    return ContactMode.SLIP_BACKWARDS if backwards is ActiveFactor.H else ContactMode.STICK


def _by_steps(name: str, active: Mapping[tuple[str, str], ActiveFactor]) -> ContactMode:
    """Read the step functions of `step_contact_system`: of a step alpha, H is zero where alpha is 0, or 1."""
    is_zero = {step: active.get((BELOW, f"{name} {step}")) is ActiveFactor.H for step in STEPS}
    is_one = {step: active.get((ABOVE, f"{name} {step}")) is ActiveFactor.H for step in STEPS}
    if is_one[GAP] or is_one[NORMAL_VELOCITY]:
        return ContactMode.FLIGHT
    if is_zero[NORMAL_VELOCITY]:
        return ContactMode.IMPACT
    if (BELOW, f"{name} {TANGENTIAL_VELOCITY}") not in active:
        return ContactMode.SLIP
    if is_one[TANGENTIAL_VELOCITY]:
        return ContactMode.SLIP_FORWARDS
    return ContactMode.SLIP_BACKWARDS if is_zero[TANGENTIAL_VELOCITY] else ContactMode.STICK
