"""A robot driven through contact by given controls: pieces of motion between events, and impacts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fesd_robot.errors import SolverError
from fesd_robot.recovery import NumericPhysics, SwitchRecord
from fesd_robot.replay import Budget, ContactLaw, Contacts, Event, Impact, ReplayNote, Segments, States, events_along
from fesd_robot.simulation.schedule import ControlSchedule

_FATAL = {
    ReplayNote.MANY_EVENTS: f"more than {Budget.most_events} contact events, or {Budget.most_bounces} bounces, "
    "happen within one control interval",
    ReplayNote.MANY_STEPS: "the steps become too short",
    ReplayNote.FAILED: "the motion cannot be integrated",
    ReplayNote.UNFINISHED_IMPACT: "an impact does not end",
}
"""Notes after which there is no motion to go on with, in words."""


@dataclass(frozen=True)
class Piece:
    """One step of the integrator, between two events.

    Attributes:
        start, end: s.
        interval: control interval.
        control: (n_u).
        contacts: their modes.
        state: time, s -> configuration (n_q) and velocity (n_v).
    """

    start: float
    end: float
    interval: int
    control: np.ndarray
    contacts: Contacts
    state: Callable[[float], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Hit:
    """An impact.

    Attributes:
        time: s.
        interval: control interval.
        configuration: (n_q).
        before: velocity before it, (n_v).
        impact: velocity after it and impulses.
        pieces: how many there were before it.
    """

    time: float
    interval: int
    configuration: np.ndarray
    before: np.ndarray
    impact: Impact
    pieces: int


@dataclass
class SimulatedMotion:
    """A simulated motion.

    Attributes:
        pieces, hits: in time order.
        switches, joint_switches, compliant_switches: changes of contacts, of joints with dry friction, and of
            compliant contacts.
        notes: (time, what was not as it should be), each kind at its first time.
        configuration, velocity: at the end, (n_q) and (n_v).
    """

    configuration: np.ndarray
    velocity: np.ndarray
    pieces: list[Piece] = field(default_factory=list)
    hits: list[Hit] = field(default_factory=list)
    switches: list[SwitchRecord] = field(default_factory=list)
    joint_switches: list[SwitchRecord] = field(default_factory=list)
    compliant_switches: list[SwitchRecord] = field(default_factory=list)
    notes: dict[ReplayNote, float] = field(default_factory=dict)


def drive(physics: NumericPhysics, q: np.ndarray, v: np.ndarray, schedule: ControlSchedule) -> SimulatedMotion:
    """Return where rigid bodies with unilateral contacts, restitution and Coulomb friction are led by a schedule.

    The equations and the choice of modes are those of `replay.integrator.replay_motion`; contacts stay closed from one
    control interval to the next.

    Args:
        physics: of the robot and its contacts.
        q, v: configuration (n_q) and velocity (n_v) at the start.
        schedule: of the controls.

    Raises:
        SolverError: the motion does not go on; the sentence says when, and why.
    """
    result = SimulatedMotion(q, v)
    contacts: Contacts | None = None
    for interval, control in enumerate(schedule.controls):
        start, end = (float(time) for time in schedule.times[interval : interval + 2])
        law = ContactLaw(physics, control)
        recorder = _Recorder(result, start, interval, control, physics.rubbing.firsts)
        segments = Segments(physics, result.configuration, control, law, taken=recorder.step)
        if contacts is None:
            begin = law.begin(q, v, np.zeros(len(physics.friction), dtype=bool))
            contacts, velocity = begin.contacts, begin.velocity
            if begin.impact:
                result.hits.append(Hit(start, interval, q, v, begin.impact, 0))
        else:
            before = contacts
            contacts, velocity = law.choose(before, result.configuration, result.velocity)
            nothing = np.zeros(len(before.modes), dtype=bool)
            recorder.event(Event(0.0, result.configuration, velocity, before, contacts, nothing, None))
        recorder.check(law, 0.0)
        following = events_along(segments, contacts, velocity, end - start)
        while True:
            try:
                event = next(following)
            except StopIteration as last:
                result.configuration, result.velocity, contacts = last.value
                break
            recorder.event(event)
            recorder.check(law, event.time)
        recorder.check(law, end - start)
    return result


@dataclass
class _Recorder:
    """Writes down what happens in one control interval.

    Attributes:
        result: where.
        start: of the interval, s.
        interval: its number.
        control: its controls, (n_u).
        firsts: joints whose changes count, `DryFriction.firsts`.
    """

    result: SimulatedMotion
    start: float
    interval: int
    control: np.ndarray
    firsts: frozenset[int]

    def step(self, start: float, end: float, states: States, contacts: Contacts) -> None:
        """Add a step of the integrator; those without a length are none."""
        if end > start:
            self.result.pieces.append(
                Piece(
                    self.start + start,
                    self.start + end,
                    self.interval,
                    self.control,
                    contacts,
                    lambda time: states(time - self.start),
                )
            )

    def event(self, event: Event) -> None:
        """Add an event."""
        self.result.switches += event.switches(self.start)
        self.result.joint_switches += event.joint_switches(self.start, self.firsts)
        self.result.compliant_switches += event.compliant_switches(self.start)
        if event.impact:
            time, pieces = self.start + event.time, len(self.result.pieces)
            self.result.hits.append(Hit(time, self.interval, event.configuration, event.velocity, event.impact, pieces))

    def check(self, law: ContactLaw, time: float) -> None:
        """Add new notes.

        Raises:
            SolverError: after one of them the motion does not go on.
        """
        for note in sorted(law.notes):
            if note in _FATAL:
                raise SolverError(
                    f"the simulation ends at {self.start + time:.6g} s, in control interval {self.interval}: "
                    f"{_FATAL[note]}"
                )
            self.result.notes.setdefault(note, self.start + time)
