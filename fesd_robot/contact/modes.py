"""What a contact does in a finite element, read from the branch."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

from fesd_robot.complementarity import ActiveFactor, Branch
from fesd_robot.contact.joint_friction import FRICTION_ALONG_MOTION
from fesd_robot.contact.kinds import (
    BACKWARDS,
    FORCE_AT_A_DISTANCE,
    FORCE_WHILE_PARTING,
    FORWARDS,
    FRICTION_ALONG_SLIDING,
    MOTION_DURING_IMPACT,
    SLIDING_INSIDE_CONE,
)
from fesd_robot.contact.steps import GAP, NORMAL_VELOCITY, STEPS, TANGENTIAL_VELOCITY
from fesd_robot.dcs import ABOVE, BELOW
from fesd_robot.dcs.jump import ABOVE_LAW, IMPACT_LAW

Active = Mapping[tuple[str, str], ActiveFactor]
"""(kind, subject) of every condition of a contact -> its active factor, from `Branch.of_contact`."""


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
    """Closed without friction, or in space: the branch leaves the direction of the tangential velocity open."""

    @property
    def slipping(self) -> ContactMode:
        """The mode while the clock runs: an impact slips."""
        return ContactMode.SLIP if self is ContactMode.IMPACT else self

    @property
    def without_direction(self) -> ContactMode:
        """The mode with both directions of slip as one."""
        slips = (ContactMode.SLIP_FORWARDS, ContactMode.SLIP_BACKWARDS)
        return ContactMode.SLIP if self in slips else self


def contact_modes(branch: Branch, element: int) -> dict[str, ContactMode]:
    """Return name of every contact -> its mode in a finite element.

    The mode is that of the branch; whether an element has a length, in which a contact does anything, is in
    `Branch.without_length`.

    Args:
        branch: of a trajectory of a contact system.
        element: number of the element in the trajectory.
    """
    return {name: _mode(branch.of_contact(element, name)) for name in branch.contacts}


def acting_impulses(branch: Branch, element: int) -> dict[str, bool]:
    """Return name of every contact -> whether an impulse of it acts at the left boundary of a finite element.

    Args:
        branch: of a trajectory of a contact system.
        element: number of the element in the trajectory.
    """
    above = (IMPACT_LAW, ABOVE_LAW)
    return {name: branch.of_contact(element, name).get(above) is ActiveFactor.G for name in branch.contacts}


def joint_modes(branch: Branch, element: int) -> dict[str, ContactMode]:
    """Return name of every velocity coordinate with dry friction -> stick or a direction of slip in a finite element.

    In an element in which a contact is in impact the mode means nothing: dry friction has no impulse.

    Args:
        branch: of a trajectory of a contact system.
        element: number of the element in the trajectory.
    """
    return {name: _joint_mode(branch.of_joint(element, name)) for name in branch.joints}


def _joint_mode(active: Active) -> ContactMode:
    if active[FRICTION_ALONG_MOTION, FORWARDS] is ActiveFactor.H:
        return ContactMode.SLIP_FORWARDS
    if active[FRICTION_ALONG_MOTION, BACKWARDS] is ActiveFactor.H:
        return ContactMode.SLIP_BACKWARDS
    return ContactMode.STICK


def _mode(active: Active) -> ContactMode:
    return _by_multipliers(active) if (FORCE_AT_A_DISTANCE, "") in active else _by_steps(active)


def _by_multipliers(active: Active) -> ContactMode:
    """Read the conditions of `multiplier_contact_system` or `impulse_contact_system`; the latter has fewer kinds."""
    if ActiveFactor.H in (active[FORCE_AT_A_DISTANCE, ""], active.get((FORCE_WHILE_PARTING, ""))):
        return ContactMode.FLIGHT
    if active.get((MOTION_DURING_IMPACT, "")) is ActiveFactor.COMPLEMENT:
        return ContactMode.IMPACT
    inside = active.get((SLIDING_INSIDE_CONE, FORWARDS))
    if inside is not None:
        return ContactMode.SLIP if inside is ActiveFactor.H else ContactMode.STICK
    backwards, forwards = (active.get((FRICTION_ALONG_SLIDING, direction)) for direction in (BACKWARDS, FORWARDS))
    if backwards is None:
        return ContactMode.SLIP
    if forwards is ActiveFactor.H:
        return ContactMode.SLIP_FORWARDS
    return ContactMode.SLIP_BACKWARDS if backwards is ActiveFactor.H else ContactMode.STICK


def _by_steps(active: Active) -> ContactMode:
    """Read the step functions of `step_contact_system`: of a step alpha, H is zero where alpha is 0, or 1."""
    is_zero = {step: active.get((BELOW, step)) is ActiveFactor.H for step in STEPS}
    is_one = {step: active.get((ABOVE, step)) is ActiveFactor.H for step in STEPS}
    if is_one[GAP] or is_one[NORMAL_VELOCITY]:
        return ContactMode.FLIGHT
    if is_zero[NORMAL_VELOCITY]:
        return ContactMode.IMPACT
    if (BELOW, TANGENTIAL_VELOCITY) not in active:
        return ContactMode.SLIP
    if is_one[TANGENTIAL_VELOCITY]:
        return ContactMode.SLIP_FORWARDS
    return ContactMode.SLIP_BACKWARDS if is_zero[TANGENTIAL_VELOCITY] else ContactMode.STICK
