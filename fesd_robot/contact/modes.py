"""Modes of contacts in finite elements, read from the branch."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from enum import Enum

from fesd_robot.complementarity import ActiveFactor, Branch, Complementarity
from fesd_robot.contact.joint_friction import FRICTION_ALONG_MOTION
from fesd_robot.contact.kinds import (
    BACKWARDS,
    COMPLIANT_FORCE,
    FORCE_AT_A_DISTANCE,
    FORCE_WHILE_PARTING,
    FORWARDS,
    FRICTION_AFTER_IMPACT,
    FRICTION_ALONG_SLIDING,
    MOTION_DURING_IMPACT,
    ONE_AT_A_TIME,
    SLIDING_INSIDE_CONE,
    SLIDING_INSIDE_SURFACE,
)
from fesd_robot.contact.steps import GAP, NORMAL_VELOCITY, STEPS, TANGENTIAL_VELOCITY
from fesd_robot.dcs import ABOVE, ABOVE_LAW, BELOW, IMPACT_LAW

Active = Mapping[tuple[str, str], ActiveFactor]
"""(kind, subject) of every condition of a contact -> its active factor, from `Branch.of_contact`."""


class ContactMode(str, Enum):
    """Mode of a contact, or of a joint with dry friction; a joint is never in flight, and has no impacts."""

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
    """Closed without friction, or in space: the direction of the tangential velocity is not a part of the mode."""
    TOUCH = "touch"
    """Of a compliant contact: it gives way, and pushes. Its gap is not zero, and it has no impacts."""

    IMPACT_STICK = "impact, stick"
    """An impact in which the contact does not slip."""
    IMPACT_FORWARDS = "impact, slip+"
    """An impact in which the contact moves along the tangent."""
    IMPACT_BACKWARDS = "impact, slip-"
    """An impact in which the contact moves against the tangent."""

    def __str__(self) -> str:
        return str(self.value)

    @property
    def hits(self) -> bool:
        """Whether it is an impact."""
        return self in _RUNNING

    @property
    def closed(self) -> bool:
        """Whether it keeps the gap of a rigid contact at zero: neither flight nor an impact, nor a spring's touch."""
        return self not in (ContactMode.FLIGHT, ContactMode.TOUCH) and not self.hits

    @property
    def running(self) -> ContactMode:
        """The mode of an impact as that of a contact while the clock runs; any other mode itself."""
        return _RUNNING.get(self, self)

    @property
    def hitting(self) -> ContactMode:
        """The mode of a contact while the clock runs as that of an impact."""
        return {running: hits for hits, running in _RUNNING.items()}[self]

    @property
    def without_direction(self) -> ContactMode:
        """The mode with both directions of slip as one."""
        slips = (ContactMode.SLIP_FORWARDS, ContactMode.SLIP_BACKWARDS)
        return ContactMode.SLIP if self in slips else self

    @property
    def direction(self) -> int:
        """Sign of the velocity along the heading of the contact, which a slip in space has along its slide: 1 or -1; 0
        of a contact that flies or sticks."""
        return _DIRECTIONS.get(self.running, 0)


_RUNNING = {
    ContactMode.IMPACT: ContactMode.SLIP,
    ContactMode.IMPACT_STICK: ContactMode.STICK,
    ContactMode.IMPACT_FORWARDS: ContactMode.SLIP_FORWARDS,
    ContactMode.IMPACT_BACKWARDS: ContactMode.SLIP_BACKWARDS,
}

_DIRECTIONS = {ContactMode.SLIP: 1, ContactMode.SLIP_FORWARDS: 1, ContactMode.SLIP_BACKWARDS: -1}

Modes = tuple[ContactMode, ...]
"""Modes of some contacts, of some joints with dry friction, or of contacts with the joints behind them, in order."""


def modes_of(branch: Branch, element: int) -> dict[str, ContactMode]:
    """Return name of every contact, and of every joint with dry friction -> its mode; impacts with how they slip.

    Args:
        branch: of a trajectory of a contact system in multipliers, or with impulses.
        element: number of the element in the trajectory.
    """
    found = contact_modes(branch, element)
    for name, mode in found.items():
        if mode is ContactMode.IMPACT:
            found[name] = _in_contact(branch.of_contact(element, name)).hitting
    return {**found, **joint_modes(branch, element)}


def factors_of(
    conditions: Iterable[Complementarity], modes: Mapping[str, ContactMode], acting: Collection[str] = ()
) -> tuple[ActiveFactor, ...]:
    """Return the active factors of conditions of a contact system in which everything has a given mode.

    The inverse of `modes_of` and `acting_sets`. Impulses are not among the conditions.

    Args:
        conditions: of one element, in multipliers or with impulses.
        modes: name of every contact, and of every joint with dry friction -> its mode.
        acting: the sets of controls that act, of groups of which one does at a time.
    """
    return tuple(
        (ActiveFactor.H if one.label.subject in acting else ActiveFactor.G)
        if one.label.kind == ONE_AT_A_TIME
        else _factor(one, modes[str(one.label.joint or one.label.contact)])
        for one in conditions
    )


def acting_sets(branch: Branch, element: int) -> tuple[str, ...]:
    """Return the sets of controls that may act in a finite element, of groups of which one does at a time.

    Args:
        branch: of a trajectory of a contact system.
        element: number of the element in the trajectory.
    """
    factors = zip(branch.conditions, branch.factors[element], strict=True)
    acting = [one.subject for one, factor in factors if one.kind == ONE_AT_A_TIME and factor is ActiveFactor.H]
    return tuple({set_name.split(" ")[0]: set_name for set_name in reversed(acting)}.values())[::-1]


def _factor(condition: Complementarity, mode: ContactMode) -> ActiveFactor:
    label = condition.label
    if label.kind == COMPLIANT_FORCE:
        return ActiveFactor.H if mode is ContactMode.FLIGHT else ActiveFactor.G
    if mode is ContactMode.FLIGHT:
        return ActiveFactor.G if condition.implied_by else ActiveFactor.H
    if mode.hits and condition.complement is not None:
        return ActiveFactor.COMPLEMENT
    if label.kind in (SLIDING_INSIDE_CONE, SLIDING_INSIDE_SURFACE):
        return ActiveFactor.G if mode.running is ContactMode.STICK else ActiveFactor.H
    own = {FORWARDS: ContactMode.SLIP_FORWARDS, BACKWARDS: ContactMode.SLIP_BACKWARDS}.get(label.subject)
    along = label.kind in (FRICTION_ALONG_SLIDING, FRICTION_AFTER_IMPACT, FRICTION_ALONG_MOTION)
    return ActiveFactor.H if along and mode.running is own else ActiveFactor.G


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
    """Return name of every velocity coordinate with dry friction, and of every limit surface -> its mode in an element.

    It sticks or slips, a coordinate of its own in a direction.

    In an element in which a contact is in impact the mode means nothing: dry friction has no impulse.

    Args:
        branch: of a trajectory of a contact system.
        element: number of the element in the trajectory.
    """
    return {name: _joint_mode(branch.of_joint(element, name)) for name in branch.joints}


def _joint_mode(active: Active) -> ContactMode:
    inside = [factor for (kind, _), factor in active.items() if kind == SLIDING_INSIDE_SURFACE]
    if inside:
        return ContactMode.SLIP if inside[0] is ActiveFactor.H else ContactMode.STICK
    if active[FRICTION_ALONG_MOTION, FORWARDS] is ActiveFactor.H:
        return ContactMode.SLIP_FORWARDS
    if active[FRICTION_ALONG_MOTION, BACKWARDS] is ActiveFactor.H:
        return ContactMode.SLIP_BACKWARDS
    return ContactMode.STICK


def names_of_modes(branch: Branch) -> tuple[str, ...]:
    """Return the names of everything that has a mode: rigid contacts, compliant ones, joints with dry friction."""
    compliant = [label.contact for label in branch.conditions if label.kind == COMPLIANT_FORCE and label.contact]
    rigid = [name for name in branch.contacts if name not in compliant]
    return (*rigid, *compliant, *branch.joints)


def _mode(active: Active) -> ContactMode:
    if (COMPLIANT_FORCE, "") in active:
        return ContactMode.FLIGHT if active[COMPLIANT_FORCE, ""] is ActiveFactor.H else ContactMode.TOUCH
    return _by_multipliers(active) if (FORCE_AT_A_DISTANCE, "") in active else _by_steps(active)


def _by_multipliers(active: Active) -> ContactMode:
    """Read the conditions of `multiplier_contact_system` or `impulse_contact_system`; the latter has fewer kinds."""
    if ActiveFactor.H in (active[FORCE_AT_A_DISTANCE, ""], active.get((FORCE_WHILE_PARTING, ""))):
        return ContactMode.FLIGHT
    if active.get((MOTION_DURING_IMPACT, "")) is ActiveFactor.COMPLEMENT:
        return ContactMode.IMPACT
    return _in_contact(active)


def _in_contact(active: Active) -> ContactMode:
    """Read how a contact that is closed, or hit, moves along its tangents."""
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
