"""The contacts from an event on: which ones touch, and in which modes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from fesd_robot.contact import ContactMode, Modes
from fesd_robot.exactness import SINGULAR
from fesd_robot.recovery import NumericPhysics, normal_rows, tangential_rows
from fesd_robot.replay.dynamics import contact_dynamics
from fesd_robot.replay.headings import slip_headings
from fesd_robot.replay.impacts import Impact, impact, levelled
from fesd_robot.replay.mode_motion import ZERO_TANGENTIAL_VELOCITY, ModeMotion
from fesd_robot.replay.modes import rated_modes, slips_are_proper
from fesd_robot.replay.roots import BEYOND_GAP

CLOSED_GAP = 1e-5
"""Gap, m, up to which a contact that hardly moves is closed when a replay begins."""

CLOSED_VELOCITY = 1e-3
"""Normal velocity, m/s, up to which a contact within `CLOSED_GAP` is closed when a replay begins."""

PARTING = 1e-5
"""Normal velocity after an impact, m/s, up to which a contact that touches stays closed. Two feet that land one after
the other, or whose forces begin at zero, make each other rise and fall in ever smaller hops without an end; one of this
speed is 5e-12 m high."""

_AT_ONCE = 1e-8
"""Gap, m, up to which a contact that approaches meets the ground together with another one: the integration is hardly
more accurate, and where two feet land at once it must not decide which of them comes first."""

_JAMMED_CHANGE = 1e-3
"""Least change of the velocity of a slide by the impact that ends a jam, relative to it."""

_SAME_MOTION = 1e-6
"""Difference of two accelerations relative to the larger up to which two choices of modes are the same motion; and more
room of the forces than that, `ModeMotion.margin`, is room to spare."""


class ReplayNote(str, Enum):
    """Irregularities of a replay."""

    NOT_UNIQUE = "several choices of modes are admissible"
    IMPROPER = "all admissible modes are improper"
    NO_MODE = "no mode is admissible"
    UNFINISHED_IMPACT = "an impact does not end"
    MANY_EVENTS = "too many events"
    MANY_STEPS = "steps become too short"
    FAILED = "the motion cannot be integrated"
    IN_TURN = "contacts that hit at the same instant do so one after the other"


@dataclass(frozen=True)
class Contacts:
    """Contacts between two events.

    Attributes:
        modes: of every contact, (n_c).
        closed: those that touch and do not part, (n_c) of bool.
        ground: gap at which each contact touches, m, (n_c).
        joints: modes of the joints with dry friction, (n_f).
        headings: directions of their slides at the event, see `slip_headings`, (n_c, n_t).
        joint_headings: the same of joints, see `DryFriction.headings`, (n_f).
        compliant: modes of the compliant contacts, flight or touch, (n_s).
    """

    modes: Modes
    closed: np.ndarray
    ground: np.ndarray
    joints: Modes
    headings: np.ndarray
    joint_headings: np.ndarray
    compliant: Modes = ()

    def with_compliant_changed(self, number: int) -> Contacts:
        """Return the contacts after a compliant one has begun, or ceased, to push."""
        modes = list(self.compliant)
        modes[number] = ContactMode.FLIGHT if modes[number] is ContactMode.TOUCH else ContactMode.TOUCH
        return replace(self, compliant=tuple(modes))


@dataclass(frozen=True)
class Drift:
    """Drift taken out at the start: the largest gap, m, and normal velocity, m/s, of a closed contact."""

    gap: float
    velocity: float


@dataclass(frozen=True)
class Beginning:
    """How a motion begins.

    Attributes:
        contacts: at the start.
        velocity: there, after an impact and without drift, (n_v).
        drift: what was taken out.
        impact: None if there is none.
    """

    contacts: Contacts
    velocity: np.ndarray
    drift: Drift
    impact: Impact | None


class ContactLaw:
    """Impacts and changes of mode of one replay.

    Args:
        physics: of the robot and its contacts.
        control: constant, (n_u).

    Attributes:
        notes: what has not been as it should be.
    """

    def __init__(self, physics: NumericPhysics, control: np.ndarray) -> None:
        self._physics = physics
        self._control = control
        self.notes: set[ReplayNote] = set()

    def begin(self, q: np.ndarray, v: np.ndarray, flying: np.ndarray) -> Beginning:
        """Return how a motion begins in a state.

        A contact within `CLOSED_GAP` whose normal velocity is within `CLOSED_VELOCITY` is closed, and its ground is
        where it is. Others that approach with their gap closed have an impact at once; those that rise from below the
        ground land where they started.

        Args:
            flying: contacts that are open however near the ground they are, if they are above it, (n_c) of bool.
        """
        gaps, normal = self._physics.gaps(q), self._normal_velocity(q, v)
        closed = (gaps <= CLOSED_GAP) & (np.abs(normal) <= CLOSED_VELOCITY) & ~(flying & (gaps > 0))
        drift = Drift(float(np.abs(gaps[closed]).max(initial=0.0)), float(np.abs(normal[closed]).max(initial=0.0)))
        ground, joints = (
            np.where(closed, gaps, np.minimum(gaps, 0.0)),
            (ContactMode.STICK,) * len(self._physics.friction_coordinates),
        )
        nowhere = slip_headings(np.zeros((len(gaps), self._physics.rows - 1)))
        compliant = self._compliant(q, v)
        contacts = Contacts(
            (ContactMode.FLIGHT,) * len(gaps), closed, ground, joints, nowhere, np.zeros(len(joints)), compliant
        )
        hits, result = (gaps <= 0) & (normal < -CLOSED_VELOCITY), None
        if hits.any():
            contacts, result = self.hit(contacts, hits, q, v)
            v = result.velocity
        contacts, v = self.choose(contacts, q, v)
        return Beginning(contacts, v, drift, result)

    def hit_with(self, contacts: Contacts, hits: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return which contacts meet the ground at the same time as those that do, (n_c) of bool.

        Args:
            hits: contacts that meet it, (n_c) of bool; nothing else is looked at if there is none.
        """
        if not hits.any():
            return hits
        near = self._physics.gaps(q) - contacts.ground <= _AT_ONCE
        return np.asarray(hits | (~contacts.closed & near & (self._normal_velocity(q, v) < 0)))

    def hit(self, contacts: Contacts, hits: np.ndarray, q: np.ndarray, v: np.ndarray) -> tuple[Contacts, Impact]:
        """Return the contacts after some have met the ground, whose modes are still to choose, and the impact.

        Args:
            hits: contacts that have met it, (n_c) of bool.
        """
        touching = contacts.closed | hits
        level = levelled(self._physics, q, touching, contacts.ground)
        result = impact(self._physics, q, v, touching, level=level)
        if not result.finished:
            self.notes.add(ReplayNote.UNFINISHED_IMPACT)
        closed = self._not_parting(touching, q, result.velocity)
        ground = np.where(closed & ~contacts.closed, self._physics.gaps(q), contacts.ground)
        return replace(contacts, closed=closed, ground=ground), result

    def jammed(self, contacts: Contacts, q: np.ndarray, v: np.ndarray) -> tuple[Contacts, Impact] | None:
        """Return the contacts and the impact without a collision of a slide whose force grows beyond any bound.

        It does where a push along the normal, with friction against the slide, begins to press the contact into the
        ground: J_n M^-1 (J_n - mu d J_t)^T falls to zero. Impulses then grow until the slide has stopped and the
        contact does not approach any more. None if that changes nothing: the motion ends for another reason.

        Source: Genot and Brogliato, New results on Painleve paradoxes, European Journal of Mechanics A 18 (1999).
        """
        sliding = contacts.closed & np.array([mode.direction != 0 for mode in contacts.modes], dtype=bool)
        if not sliding.any():
            return None
        result = impact(self._physics, q, v, contacts.closed, sliding)
        jacobian = self._physics.contact_jacobian(q)
        slides, changes = (tangential_rows(jacobian @ one, self._physics.rows) for one in (v, result.velocity - v))
        ends = np.linalg.norm(changes, axis=1) > _JAMMED_CHANGE * np.linalg.norm(slides, axis=1)
        if not result.finished or not (ends & sliding).any():
            return None
        self.notes.add(ReplayNote.NO_MODE)
        return replace(contacts, closed=self._not_parting(contacts.closed, q, result.velocity)), result

    def released(self, contacts: Contacts, q: np.ndarray) -> Contacts:
        """Return the contacts with the ground of open ones no higher than they are: they can come back to it."""
        lowest = np.minimum(contacts.ground, self._physics.gaps(q))
        return replace(contacts, ground=np.where(contacts.closed, contacts.ground, lowest))

    def choose(
        self, contacts: Contacts, q: np.ndarray, v: np.ndarray, left: Modes | None = None
    ) -> tuple[Contacts, np.ndarray]:
        """Return the contacts in modes that the law allows, and the velocity that keeps to them exactly.

        Args:
            left: modes that have just ceased to be possible.
        """
        if not contacts.closed.any() and not contacts.joints:
            return replace(contacts, modes=(ContactMode.FLIGHT,) * len(contacts.modes)), v
        v = self._settled(contacts.closed, q, v)
        choices = rated_modes(contact_dynamics(self._physics, q, v, self._control), contacts.closed, left)
        self._judge(choices)
        chosen = self._going_on(choices, contacts.modes)
        closed = contacts.closed & np.array([mode is not ContactMode.FLIGHT for mode in chosen.modes], dtype=bool)
        return (
            replace(
                contacts,
                modes=chosen.modes,
                closed=closed,
                joints=chosen.joints,
                headings=chosen.headings,
                joint_headings=chosen.joint_headings,
            ),
            v,
        )

    def _compliant(self, q: np.ndarray, v: np.ndarray) -> Modes:
        """Return which compliant contacts push; one that is about to begin does."""
        relief = self._physics.relief(q, v)
        if not relief.size:
            return ()
        distance, rate = relief / self._physics.reach, self._physics.compliant_jacobian(q) @ v
        pushes = (distance < -BEYOND_GAP) | ((distance <= BEYOND_GAP) & (rate < 0))
        return tuple(ContactMode.TOUCH if one else ContactMode.FLIGHT for one in pushes)

    def _not_parting(self, touching: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return which of the contacts that touched stay closed after an impact, (n_c) of bool."""
        return np.asarray(touching & (self._normal_velocity(q, v) <= PARTING))

    def _normal_velocity(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return normal_rows(self._physics.contact_jacobian(q) @ v, self._physics.rows)

    def look(self, contacts: Contacts, q: np.ndarray, v: np.ndarray) -> None:
        """Note whether other modes than those that go on have become possible: only where some slip is improper."""
        if not contacts.closed.any() or ReplayNote.NOT_UNIQUE in self.notes:
            return
        dynamics = contact_dynamics(self._physics, q, v, self._control, contacts.headings, contacts.joint_headings)
        if slips_are_proper(dynamics.in_joint_modes(contacts.joints), contacts.closed):
            return
        choices = rated_modes(dynamics, contacts.closed)
        going_on = [choice for choice in choices if choice.modes == contacts.modes]
        self._judge([*going_on, *(choice for choice in choices if choice.modes != contacts.modes)])

    def _settled(self, closed: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the velocity, nearest in kinetic energy, at which closed contacts neither part nor creep.

        Joints with dry friction do not creep either.
        """
        friction_coordinates, jacobian = self._physics.friction_coordinates, self._physics.contact_jacobian(q)
        speeds = np.linalg.norm(tangential_rows(jacobian @ v, self._physics.rows), axis=1)
        creeps = closed & (speeds <= ZERO_TANGENTIAL_VELOCITY) & (self._physics.friction > 0)
        rows = np.column_stack([closed, *[creeps] * (self._physics.rows - 1)]).ravel()
        rests = self._physics.rubbing.resting(v[friction_coordinates], ZERO_TANGENTIAL_VELOCITY)
        resting = friction_coordinates[rests]
        held = np.vstack([jacobian[rows], np.eye(len(v))[resting]])
        response = np.linalg.solve(self._physics.mass_matrix(q), held.T)
        impulse = np.linalg.lstsq(held @ response, held @ v, rcond=SINGULAR)[0]
        return np.asarray(v - response @ impulse)

    @staticmethod
    def _going_on(choices: list[ModeMotion], modes: Modes) -> ModeMotion:
        """Return the choice of modes that goes on as before if the law allows it, else the most plausible one.

        A contact that has come to rest does not go on sliding where the same motion has it stick with room to spare:
        contacts of one body that rest may push against each other, as if each slid its own way.
        """
        first = choices[0]
        same = next((c for c in choices if c.modes == modes and c.admissible and c.proper), first)
        return first if first.margin > _SAME_MOTION and _one_motion(first, same) else same

    def _judge(self, choices: list[ModeMotion]) -> None:
        best, others = choices[0], choices[1:]
        if not best.admissible:
            self.notes.add(ReplayNote.NO_MODE)
            return
        if not best.proper:
            self.notes.add(ReplayNote.IMPROPER)
        if best.shared_otherwise:
            self.notes.add(ReplayNote.NOT_UNIQUE)
        if any(other.admissible and not _one_motion(best, other) for other in others):
            self.notes.add(ReplayNote.NOT_UNIQUE)


def _one_motion(first: ModeMotion, second: ModeMotion) -> bool:
    """Return whether two choices of modes have the same acceleration."""
    size = _SAME_MOTION * (1.0 + np.abs(first.acceleration).max())
    return bool(np.abs(second.acceleration - first.acceleration).max() <= size)
