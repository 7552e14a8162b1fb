"""The outcome of a motion: its misses of the goal, and the flights, slides and impacts of each contact."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field

from fesd_robot.plans.record import Record

LOWEST_JUMP = 1e-3
"""m; a flight that stays lower is no jump."""


class GoalEntry(Record):
    """One number that the task wants at the end of the motion, and what it is there.

    Attributes:
        name: a coordinate (``root_x``, ``root_x velocity``), ``frame NAME x position``, ``center of mass z velocity``,
            or, in a periodic motion, the change of a coordinate over it (``change of root_x``).
        kind: whether it is a position or a velocity.
        unit: of goal, end, missed_by and tolerance.
        missed_by: |end - goal|; of roll, pitch and yaw of an orientation (``root_joint.yaw``) the size of the turn from
            goal to end about the body's x, y and z axis.
        tolerance: the largest miss that the task allows; None where it gives none.
        met: whether the miss is within the tolerance; None where the task gives none.
    """

    name: str
    kind: Literal["position", "velocity"]
    unit: str
    goal: float
    end: float
    missed_by: float
    tolerance: float | None = None
    met: bool | None = None


class Flight(Record):
    """A time in which a contact does not touch.

    Attributes:
        start, end: s of physical time.
        length: horizontal distance between the places of the contact point at start and end, m.
        height: largest gap, m: on level ground how high the contact is.
        open_start, open_end: the motion begins or ends in the air, so that the flight is cut there.
    """

    start: float
    end: float
    length: float
    height: float
    open_start: bool = False
    open_end: bool = False


class Slide(Record):
    """A time in which a contact slips.

    Attributes:
        start, end: s of physical time.
        distance: length of the path that the contact slips along its surface, to and fro added up, m.
    """

    start: float
    end: float
    distance: float


class FrictionUse(Record):
    """Most of its cone of friction that a contact uses, |f_t| / (mu f_n), and when, s."""

    share: float
    time: float


class ContactImpact(Record):
    """An impact of one contact: when, s, its normal impulse, N s, and how fast the gap closed before, m/s."""

    time: float
    normal_impulse: float
    approach_velocity: float


class Push(Record):
    """A time in which a compliant contact is compressed.

    Attributes:
        start, end: s of physical time.
        depth: largest compression, m.
        force: largest normal force, N.
        open_start, open_end: the motion begins or ends in it, so that it is cut there.
    """

    start: float
    end: float
    depth: float
    force: float
    open_start: bool = False
    open_end: bool = False


class ContactOutcome(Record):
    """Flights, slides and impacts of one contact, each list in time order, and how much of its friction it uses.

    Attributes:
        pushes: of a compliant contact, which has neither slides nor impacts; none of a rigid one.
        sticking: most of its friction that it uses where it sticks; None if it never does, without friction, and in
            plans that do not say it.
        landing: the same of its impulses in impacts after which it sticks.
    """

    flights: list[Flight] = Field(default_factory=list)
    slides: list[Slide] = Field(default_factory=list)
    impacts: list[ContactImpact] = Field(default_factory=list)
    sticking: FrictionUse | None = None
    landing: FrictionUse | None = None
    pushes: list[Push] = Field(default_factory=list)

    @property
    def slide_distance(self) -> float:
        """Length of all slides together, m."""
        return sum(slide.distance for slide in self.slides)


class Outcome(Record):
    """How far a motion misses its goal, and what its contacts did, measured on the trajectory.

    Attributes:
        goal: every number that the task lists in `goal`; all velocities, wanted to be zero, where it lists none.
        contacts: name of a contact -> its flights, slides and impacts.
    """

    goal: list[GoalEntry]
    contacts: dict[str, ContactOutcome]

    @property
    def leaves_the_ground(self) -> bool:
        """Whether some contact flies higher than `LOWEST_JUMP`."""
        flights = (flight for contact in self.contacts.values() for flight in contact.flights)
        return any(flight.height > LOWEST_JUMP for flight in flights)

    def largest_misses(self, kind: Literal["position", "velocity"]) -> list[GoalEntry]:
        """Return the entry that is missed most of every unit; one that is not a number counts as missed most."""
        largest: dict[str, GoalEntry] = {}
        for entry in (entry for entry in self.goal if entry.kind == kind):
            if entry.unit not in largest or _size(entry) > _size(largest[entry.unit]):
                largest[entry.unit] = entry
        return list(largest.values())


def _size(entry: GoalEntry) -> float:
    return math.inf if math.isnan(entry.missed_by) else entry.missed_by
