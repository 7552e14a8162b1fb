"""Rigid-body motion through contact, event by event, with constant controls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq

from fesd_robot.recovery import SwitchRecord
from fesd_robot.recovery.contact_rows import normal_rows, tangential_rows
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay.changes import kinds_of_change
from fesd_robot.replay.impacts import impact
from fesd_robot.replay.modes import (
    ADMISSIBLE,
    ZERO_TANGENTIAL_VELOCITY,
    Mode,
    ModeMotion,
    Modes,
    acceleration_in_modes,
    contact_dynamics,
    force_margin,
    rated_modes,
)

CLOSED_GAP = 1e-3
"""Gap, m, up to which a contact that hardly moves is closed when a replay begins."""

CLOSED_VELOCITY = 1e-2
"""Normal velocity, m/s, up to which a contact within `CLOSED_GAP` is closed when a replay begins."""

RELATIVE_TOLERANCE, ABSOLUTE_TOLERANCE = 1e-10, 1e-12
"""Of the integration, in rad, m and per s."""

LONGEST_STEP = 0.025
"""s, so that no touchdown is stepped over."""

MOST_EVENTS = 50
"""Events of one replay after which it no longer looks for more."""

_PARTING = 1e-9
"""Normal velocity after an impact, m/s, above which a contact that touches is open."""

_BEYOND_GAP, _BEYOND_SLIP = 1e-11, 1e-9
"""By how much a gap, m, or a velocity against the slip, m/s, is below zero when its event counts."""

_SAME = 1e-6
"""Difference of two accelerations relative to the larger up to which two choices of modes are the same motion."""


class Note(str, Enum):
    """What is not as it should be about a replay."""

    NOT_UNIQUE = "several choices of modes are admissible"
    IMPROPER = "all admissible modes are improper"
    NO_MODE = "no mode is admissible"
    UNFINISHED_IMPACT = "an impact does not end"
    MANY_EVENTS = "too many events"


@dataclass(frozen=True)
class Replay:
    """Where a motion leads.

    Attributes:
        configuration, velocity: at the end, (n_q) and (n_v).
        events: changes of the contacts' modes in time order, after the modes at the start.
        gap_drift: largest gap of a contact that is closed at the start, which its ground was shifted by, m.
        velocity_drift: largest velocity of such a contact against its mode, which was taken out, m/s.
        notes: what is not as it should be.
    """

    configuration: np.ndarray
    velocity: np.ndarray
    events: tuple[SwitchRecord, ...]
    gap_drift: float
    velocity_drift: float
    notes: frozenset[Note]


def replay_motion(
    physics: NumericPhysics, q: np.ndarray, v: np.ndarray, u: np.ndarray, duration: float, start: float = 0.0
) -> Replay:
    """Return where rigid bodies with inelastic, unilateral contacts and Coulomb friction are led by constant controls.

        M a + h + D v = B u + J^T f,   0 <= f_n ⊥ gap >= 0,   f_t in -mu f_n Sgn(J_t v)

    Between events the contact modes are fixed, and the accelerations of `motion_in_modes` are integrated with DOP853
    in tangent coordinates about q. At an event, a gap, a force at the edge of its friction cone or a tangential
    velocity reaching zero, the modes are chosen anew from `rated_modes`, after an `impact` where a contact approaches.
    A contact that is closed at the start within `CLOSED_GAP` and `CLOSED_VELOCITY` touches where it is.

    Args:
        physics: of the robot and its contacts.
        q, v, u: configuration (n_q), velocity (n_v), controls (n_u), SI units.
        duration: s.
        start: time of the start, s, to which the times of events are added.

    Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I (1993), section II.5 (DOP853);
    Pfeiffer and Glocker, Multibody Dynamics with Unilateral Contacts (1996).
    """
    return _Motion(physics, q, u).run(v, duration, start)


@dataclass(frozen=True)
class _Contacts:
    """What the contacts do from an event on.

    Attributes:
        modes: of every contact, (n_c).
        closed: those that touch and do not part, (n_c) of bool.
        ground: gap at which each contact touches, m, (n_c).
    """

    modes: Modes
    closed: np.ndarray
    ground: np.ndarray


@dataclass
class _Motion:
    """One replay: the configuration at its start, its controls, and what it has met."""

    physics: NumericPhysics
    base: np.ndarray
    control: np.ndarray
    events: list[SwitchRecord] = field(default_factory=list)
    notes: set[Note] = field(default_factory=set)

    def run(self, v: np.ndarray, duration: float, start: float) -> Replay:
        n_v = len(v)
        y = np.concatenate([np.zeros(n_v), v])
        contacts, y, gap_drift, velocity_drift = self._begin(y, start)
        time, events = 0.0, 0
        while True:
            time, y, fired = self._until_event(contacts, time, y, duration, watch=events < MOST_EVENTS)
            if fired is None:
                break
            events += 1
            if events == MOST_EVENTS:
                self.notes.add(Note.MANY_EVENTS)
            contacts, y = self._after(contacts, fired, start + time, y)
        q, v = self._state(y)
        return Replay(q, v, tuple(self.events), gap_drift, velocity_drift, frozenset(self.notes))

    def _state(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        half = len(y) // 2
        return self.physics.integrate(self.base, y[:half]), y[half:]

    def _begin(self, y: np.ndarray, time: float) -> tuple[_Contacts, np.ndarray, float, float]:
        """Return the contacts at the start, the state without their drift, and the drift of gaps and velocities."""
        q, v = self._state(y)
        gaps, normal = self.physics.gaps(q), normal_rows(self.physics.contact_jacobian(q) @ v)
        closed = (gaps <= CLOSED_GAP) & (np.abs(normal) <= CLOSED_VELOCITY)
        hits = (gaps <= 0) & (normal < -CLOSED_VELOCITY)
        contacts = _Contacts((Mode.FLIGHT,) * len(gaps), closed, np.where(closed, gaps, 0.0))
        drift = float(np.abs(gaps[closed]).max(initial=0.0)), float(np.abs(normal[closed]).max(initial=0.0))
        if hits.any():
            contacts, y = self._hit(contacts, hits, y)
        contacts, y = self._chosen(contacts, y)
        return contacts, y, *drift

    def _hit(self, contacts: _Contacts, hits: np.ndarray, y: np.ndarray) -> tuple[_Contacts, np.ndarray]:
        """Return the contacts that still touch after an impact, and the state after it."""
        q, v = self._state(y)
        touching = contacts.closed | hits
        ground = np.where(contacts.closed, contacts.ground, self.physics.gaps(q))
        result = impact(self.physics, q, v, touching)
        if not result.finished:
            self.notes.add(Note.UNFINISHED_IMPACT)
        normal = normal_rows(self.physics.contact_jacobian(q) @ result.velocity)
        closed = touching & (normal <= _PARTING)
        ground = np.where(closed, ground, contacts.ground)
        return replace(contacts, closed=closed, ground=ground), np.concatenate([y[: len(v)], result.velocity])

    def _chosen(self, contacts: _Contacts, y: np.ndarray, left: Modes | None = None) -> tuple[_Contacts, np.ndarray]:
        """Return the closed contacts with the modes that the law allows, and the state that keeps to them exactly.

        Args:
            left: modes that have just ceased to be possible.
        """
        if not contacts.closed.any():
            return replace(contacts, modes=(Mode.FLIGHT,) * len(contacts.modes)), y
        y = self._settled(contacts.closed, y)
        q, v = self._state(y)
        choices = rated_modes(contact_dynamics(self.physics, q, v, self.control), contacts.closed)
        choices = [choice for choice in choices if choice.modes != left] or choices
        self._judge(choices)
        kept = [choice for choice in choices if choice.modes == contacts.modes and choice.admissible]
        modes = next((choice.modes for choice in kept if choice.proper), choices[0].modes)
        closed = contacts.closed & np.array([mode is not Mode.FLIGHT for mode in modes])
        return replace(contacts, modes=modes, closed=closed), y

    def _settled(self, closed: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the state without the velocities that closed contacts do not have, the nearest in kinetic energy."""
        q, v = self._state(y)
        jacobian = self.physics.contact_jacobian(q)
        still = np.abs(tangential_rows(jacobian @ v)) <= ZERO_TANGENTIAL_VELOCITY
        rows = np.column_stack([closed, closed & still & (self.physics.friction > 0)]).ravel()
        response = np.linalg.solve(self.physics.mass_matrix(q), jacobian[rows].T)
        impulse = np.linalg.lstsq(jacobian[rows] @ response, jacobian[rows] @ v, rcond=1e-10)[0]
        return np.concatenate([y[: len(v)], v - response @ impulse])

    def _judge(self, choices: list[ModeMotion]) -> None:
        best, others = choices[0], choices[1:]
        if not best.admissible:
            self.notes.add(Note.NO_MODE)
            return
        if not best.proper:
            self.notes.add(Note.IMPROPER)
        size = _SAME * (1.0 + np.abs(best.acceleration).max())
        if any(o.admissible and np.abs(o.acceleration - best.acceleration).max() > size for o in others):
            self.notes.add(Note.NOT_UNIQUE)

    def _until_event(
        self, contacts: _Contacts, time: float, y: np.ndarray, end: float, watch: bool
    ) -> tuple[float, np.ndarray, int | None]:
        """Integrate to the first event; return its time, the state there, and its number, None at the end."""
        if end - time <= 1e-12:
            return time, y, None
        stepper = DOP853(
            self._rate(contacts), time, y, end, rtol=RELATIVE_TOLERANCE, atol=ABSOLUTE_TOLERANCE, max_step=LONGEST_STEP
        )
        watched = self._watched(contacts)
        before = watched(y)
        while stepper.status == "running":
            stepper.step()
            after = watched(stepper.y)
            crossing = np.flatnonzero((before >= 0) & (after < 0)) if watch else []
            if len(crossing):
                time, first = _first_root(stepper, watched, crossing)
                return time, stepper.dense_output()(time), first
            before = after
        return float(stepper.t), stepper.y, None

    def _rate(self, contacts: _Contacts) -> Callable[[float, np.ndarray], np.ndarray]:
        physics, base, u, half = self.physics, self.base, self.control, len(self.physics.damping)

        def rate(_: float, y: np.ndarray) -> np.ndarray:
            q, v = physics.integrate(base, y[:half]), y[half:]
            if contacts.closed.any():
                a = acceleration_in_modes(contact_dynamics(physics, q, v, u), contacts.modes)
            else:
                a = np.linalg.solve(physics.mass_matrix(q), -physics.required_force(q, v, np.zeros_like(v), u))
            return np.concatenate([physics.displacement_rate(base, y[:half], v), a])

        return rate

    def _watched(self, contacts: _Contacts) -> Callable[[np.ndarray], np.ndarray]:
        """Return what must stay positive: gap and slip of every contact, then the margin of all forces, (2 n_c + 1)."""
        slip = np.array([mode.direction for mode in contacts.modes]) * (self.physics.friction > 0)

        def values(y: np.ndarray) -> np.ndarray:
            q, v = self._state(y)
            gaps = np.where(contacts.closed, np.inf, self.physics.gaps(q) - contacts.ground + _BEYOND_GAP)
            if not contacts.closed.any():
                return np.concatenate([gaps, np.full(len(gaps) + 1, np.inf)])
            dynamics = contact_dynamics(self.physics, q, v, self.control)
            slips = np.where(slip == 0, np.inf, slip * tangential_rows(dynamics.velocity) + _BEYOND_SLIP)
            return np.concatenate([gaps, slips, [force_margin(dynamics, contacts.modes) + 2.0 * ADMISSIBLE]])

        return values

    def _after(self, contacts: _Contacts, fired: int, time: float, y: np.ndarray) -> tuple[_Contacts, np.ndarray]:
        """Return contacts and state after the event `fired`, and record what has changed."""
        count = len(contacts.modes)
        hits = np.arange(count) == fired
        if hits.any():
            following, y = self._hit(contacts, hits, y)
            following, y = self._chosen(following, y)
        else:
            following, y = self._chosen(contacts, y, contacts.modes if fired == 2 * count else None)
        for i, (old, new) in enumerate(zip(contacts.modes, following.modes, strict=True)):
            self.events += [SwitchRecord(time, i, kind) for kind in kinds_of_change(old, new, hit=bool(hits[i]))]
        return following, y


def _first_root(
    stepper: DOP853, watched: Callable[[np.ndarray], np.ndarray], crossing: np.ndarray
) -> tuple[float, int]:
    """Return time and number of the value, of those that become negative in the last step, that does so first."""
    path = stepper.dense_output()
    roots = [
        float(brentq(lambda t, k=k: watched(path(t))[k], stepper.t_old, stepper.t, xtol=1e-14, rtol=1e-14))
        for k in crossing
    ]
    first = int(np.argmin(roots))
    return roots[first], int(crossing[first])
