"""Rigid-body motion through contact, event by event, with constant controls."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from scipy.integrate import DOP853

from fesd_robot.contact import ContactMode
from fesd_robot.exactness import NO_VELOCITY
from fesd_robot.instants import SAME_EVENT
from fesd_robot.recovery import NumericPhysics, SwitchRecord, normal_rows, stacked_rows, tangential_rows
from fesd_robot.replay.budget import Budget
from fesd_robot.replay.contacts import ContactLaw, Contacts, Drift, ReplayNote
from fesd_robot.replay.dynamics import ContactDynamics, contact_dynamics
from fesd_robot.replay.end import Replay
from fesd_robot.replay.event import Event
from fesd_robot.replay.headings import slip_headings
from fesd_robot.replay.mode_motion import ADMISSIBLE, scale_of
from fesd_robot.replay.modes import (
    acceleration_in_modes,
    force_margin,
    motion_in_modes,
    with_beginning_headings,
)
from fesd_robot.replay.roots import BEYOND_GAP, crossing_time, first_root

RELATIVE_TOLERANCE, ABSOLUTE_TOLERANCE = 1e-10, 1e-12
"""Of the integration, in rad, m and per s."""

LONGEST_STEP = 0.025
"""s, so that no touchdown is stepped over."""

_SHORTER = 0.1
"""Factor on a step with a stage at which there is no motion."""

States = Callable[[float], tuple[np.ndarray, np.ndarray]]
"""Time, s -> configuration (n_q) and velocity (n_v)."""

_BEYOND_SLIP, _BEYOND_MARGIN = 1e-9, 2.0 * ADMISSIBLE
"""How far below zero a velocity along the slip, m/s, and the margin of the forces are at their events."""

STUCK, TURNED = -1, -2
"""Numbers of the events at which a motion cannot be integrated further, and at which it goes on about another base."""

FARTHEST = 1.0
"""rad or m from the base: tangent coordinates of a body in space have no rate where it has turned round once."""


def replay_motion(
    physics: NumericPhysics,
    q: np.ndarray,
    v: np.ndarray,
    u: np.ndarray,
    duration: float,
    start: float = 0.0,
    flying: np.ndarray | None = None,
    budget: Budget | None = None,
) -> Replay:
    """Return where rigid bodies with unilateral contacts and Coulomb friction are led by constant controls.

        M a + h + D v = B u + J^T f + tau,   0 <= f_n ⊥ gap >= 0,   f_t in -mu f_n Sgn(J_t v),   tau in -F Sgn(v)

    with f_n = max(0, -k gap - d J_n v) of compliant contacts in place of the second and the third.

    Between events the contact modes are fixed, and the accelerations of `acceleration_in_modes` are integrated with
    DOP853 in tangent coordinates about q. At an event, a gap, a force at the edge of its friction cone, a tangential
    velocity or one of a joint with dry friction reaching zero, that friction reaching its limit, or a compliant contact
    beginning or ceasing to push, the modes are
    chosen anew from `rated_modes`, after an `impact` where a contact approaches; dry friction has no impulse.
    A contact that is closed at the start, as `ContactLaw.begin` says, touches where it is.

    Args:
        physics: of the robot and its contacts.
        q, v, u: configuration (n_q), velocity (n_v), controls (n_u), SI units.
        duration: s.
        start: time of the start, s, to which the times of events are added.
        flying: contacts that are open at the start if they are above the ground by however little, (n_c) of bool; none
            if omitted.
        budget: what it may take; as much as a control interval if omitted.

    Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I (1993), section II.5 (DOP853);
    Pfeiffer and Glocker, Multibody Dynamics with Unilateral Contacts (1996).
    """
    if not all(np.isfinite(part).all() for part in (q, v, u)):
        nowhere = Drift(np.nan, np.nan)
        lost = np.full_like(v, np.nan)
        return Replay(np.full_like(q, np.nan), lost, (), nowhere, frozenset({ReplayNote.FAILED}), arriving=lost)
    law = ContactLaw(physics, u)
    segments = Segments(physics, q, u, law, budget=budget or Budget())
    begin = law.begin(q, v, np.zeros(len(physics.friction), dtype=bool) if flying is None else flying)
    events, joint_events, compliant_events = list[SwitchRecord](), list[SwitchRecord](), list[SwitchRecord]()
    following = events_along(segments, begin.contacts, begin.velocity, duration)
    arriving: np.ndarray | None = None
    while True:
        try:
            event = next(following)
        except StopIteration as end:
            q, v, _ = end.value
            break
        events += event.switches(start)
        joint_events += event.joint_switches(start, physics.rubbing.firsts)
        compliant_events += event.compliant_switches(start)
        if arriving is None and event.impact and event.time > duration - SAME_EVENT:
            arriving = event.velocity
    arriving = v if arriving is None else arriving
    return Replay(
        q,
        v,
        tuple(events),
        begin.drift,
        frozenset(law.notes),
        tuple(joint_events),
        tuple(compliant_events),
        arriving,
    )


def events_along(
    segments: Segments, contacts: Contacts, v: np.ndarray, duration: float
) -> Generator[Event, None, tuple[np.ndarray, np.ndarray, Contacts]]:
    """Yield the events of a motion with constant controls; return configuration, velocity and contacts at its end.

    Args:
        segments: whose `base` is where the motion begins.
        contacts, v: at its beginning, v of shape (n_v).
        duration: s.
    """
    time, y, law, n_v = 0.0, np.concatenate([np.zeros(len(v)), v]), segments.law, len(v)
    budget = segments.budget
    while time < duration:
        time, y, fired = segments.until_event(contacts, time, y, duration, watch=budget.watching)
        if fired is None:
            break
        if fired == TURNED:
            segments, contacts, y = segments.about(contacts, y)
            continue
        here, v = segments.state(y)
        before, velocity, result = contacts, v, None
        if fired >= segments.springs:
            contacts = contacts.with_compliant_changed(fired - segments.springs)
        left = contacts.modes if fired == segments.forces else None
        hits = law.hit_with(before, np.arange(len(before.modes)) == fired, here, v)
        if hits.any():
            contacts, result = law.hit(contacts, hits, here, v)
        elif fired == STUCK:
            jammed = law.jammed(contacts, here, v)
            if jammed is None:
                law.notes.add(ReplayNote.FAILED)
                return *segments.state(np.full_like(y, np.nan)), contacts
            contacts, result = jammed
        v = result.velocity if result else v
        contacts, v = law.choose(contacts, here, v, left)
        contacts = law.released(contacts, here)
        y = np.concatenate([y[:n_v], v])
        budget.events += 1
        budget.bounces += bool((hits & ~contacts.closed & (segments.physics.restitution > 0)).any())
        if not budget.watching:
            law.notes.add(ReplayNote.MANY_EVENTS)
        yield Event(time, here, velocity, before, contacts, hits, result)
    return *segments.state(y), contacts


@dataclass(frozen=True)
class Segments:
    """Motion between events, y = (displacement from `base`, v), with constant controls.

    Attributes:
        physics: of the robot and its contacts.
        base: configuration in whose tangent space it is integrated, (n_q).
        control: (n_u).
        law: of the contacts.
        taken: called after every step with its start and end, s, the states in between, and the contacts.
        budget: what of the replay is taken.
    """

    physics: NumericPhysics
    base: np.ndarray
    control: np.ndarray
    law: ContactLaw
    taken: Callable[[float, float, States, Contacts], None] | None = None
    budget: Budget = field(default_factory=Budget)

    @property
    def forces(self) -> int:
        """Number of the event at which a force leaves its friction cone, after those of the gaps and of the slips."""
        return 2 * len(self.physics.friction)

    @property
    def springs(self) -> int:
        """Number of the first event at which a compliant contact begins or ceases to push, behind all others."""
        return self.forces + 2 + len(self.physics.friction_coordinates)

    def state(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return configuration and velocity."""
        half = len(y) // 2
        return self.physics.integrate(self.base, y[:half]), y[half:]

    def about(self, contacts: Contacts, y: np.ndarray) -> tuple[Segments, Contacts, np.ndarray]:
        """Return segments whose base is a state, the contacts as they slide there, and the state's y in them."""
        here, v = self.state(y)
        headings = slip_headings(tangential_rows(self._velocity(y), self.physics.rows), contacts.headings)
        rubbing = self.physics.rubbing
        speeds = v[rubbing.coordinates]
        of_joints = rubbing.headings(speeds, contacts.joint_headings, slow=NO_VELOCITY)
        turned = replace(contacts, headings=headings, joint_headings=of_joints)
        return replace(self, base=here), turned, np.concatenate([np.zeros(len(v)), v])

    def until_event(
        self, contacts: Contacts, time: float, y: np.ndarray, end: float, watch: bool
    ) -> tuple[float, np.ndarray, int | None]:
        """Return time and state at the first event, and its number, `TURNED` far from the base; None at the end.

        Args:
            watch: whether to look for events.
        """
        headings = contacts.headings.copy()
        of_joints, starting = contacts.joint_headings.copy(), self._starting(contacts, y)
        dynamics = partial(self._dynamics, contacts, (headings, of_joints), starting)
        stepper = DOP853(
            self._rate(contacts, dynamics),
            time,
            y,
            end,
            rtol=RELATIVE_TOLERANCE,
            atol=ABSOLUTE_TOLERANCE,
            max_step=LONGEST_STEP,
        )
        watched = self._watched(contacts, (headings, of_joints), dynamics)
        before = watched(y)
        while stepper.status == "running":
            if self.budget.over:
                self.law.notes.add(ReplayNote.MANY_STEPS)
                return end, np.full_like(y, np.nan), None
            self.budget.steps += 1
            try:
                stepper.step()
            except np.linalg.LinAlgError:  # at a stage of a step that is much too long
                stepper.h_abs *= _SHORTER
                continue
            if stepper.status == "failed":
                return stepper.t, stepper.y, STUCK
            after = watched(stepper.y)
            crossing = {int(k): stepper.t for k in np.flatnonzero((before >= 0) & (after < 0))}
            crossing |= self._dips(contacts, stepper, watched) if watch else {}
            crossing |= self._dips_of_springs(contacts, stepper, watched) if watch else {}
            found = self._first(stepper, watched, crossing) if watch and crossing else None
            if self.taken:
                self.taken(stepper.t_old, found[0] if found else stepper.t, self._along(stepper), contacts)
            if found:
                return found
            self.law.look(contacts, *self.state(stepper.y))
            self._turn(headings, starting, dynamics, stepper.y)
            of_joints[:] = self._joint_headings(stepper.y, of_joints)
            before = after
            if stepper.status == "running" and self._far(stepper.y):
                return stepper.t, stepper.y, TURNED
        return end, stepper.y, None

    def _along(self, stepper: DOP853) -> States:
        path = stepper.dense_output()
        return lambda time: self.state(path(time))

    def _far(self, y: np.ndarray) -> bool:
        """Return whether a state is far from the base, if there are bodies that turn in space."""
        half = len(y) // 2
        return len(self.base) > half and bool(np.abs(y[:half]).max() > FARTHEST)

    def _first(
        self, stepper: DOP853, watched: Callable[[np.ndarray], np.ndarray], crossing: Mapping[int, float]
    ) -> tuple[float, np.ndarray, int]:
        """Return time, state and number of the value that is first of those that become negative in the last step."""
        path = stepper.dense_output()
        values, parting = (lambda t: watched(path(t))), (lambda t: self._parting(path(t)))
        time, first = first_root(stepper.t_old, values, crossing, parting, len(self.physics.friction))
        return time, path(time), first

    def _dips(
        self, contacts: Contacts, stepper: DOP853, watched: Callable[[np.ndarray], np.ndarray]
    ) -> dict[int, float]:
        """Return the open contacts that were below the ground inside the last step -> when they were lowest, s."""
        turning = ~contacts.closed
        if turning.any():
            turning &= self._parting(stepper.y) > 0
        if not turning.any():
            return {}
        path, dips = stepper.dense_output(), {}
        turning &= self._parting(path(stepper.t_old)) < 0
        for k in np.flatnonzero(turning).tolist():
            lowest = crossing_time(lambda t: self._parting(path(t)), k, stepper.t_old, stepper.t)
            if watched(path(lowest))[k] < 0 <= watched(path(stepper.t_old))[k]:
                dips[k] = lowest
        return dips

    def _dips_of_springs(
        self, contacts: Contacts, stepper: DOP853, watched: Callable[[np.ndarray], np.ndarray]
    ) -> dict[int, float]:
        """Return the numbers of compliant contacts that have begun and ceased inside the last step -> when in between.

        Looked at are those whose gap has an extreme in the step.
        """
        if not contacts.compliant:
            return {}
        sides = np.array([-1.0 if mode is ContactMode.TOUCH else 1.0 for mode in contacts.compliant])

        def rates(y: np.ndarray) -> np.ndarray:
            q, v = self.state(y)
            return np.asarray(sides * (self.physics.compliant_jacobian(q) @ v))

        path, dips = stepper.dense_output(), {}
        turning = (rates(stepper.y) > 0) & (rates(path(stepper.t_old)) < 0)
        for i in np.flatnonzero(turning).tolist():
            extreme = crossing_time(lambda t: rates(path(t)), i, stepper.t_old, stepper.t)
            k = self.springs + i
            if watched(path(extreme))[k] < 0 <= watched(path(stepper.t_old))[k]:
                dips[k] = extreme
        return dips

    def _parting(self, y: np.ndarray) -> np.ndarray:
        """Return the normal velocity of every contact, m/s, (n_c)."""
        return normal_rows(self._velocity(y), self.physics.rows)

    def _velocity(self, y: np.ndarray) -> np.ndarray:
        """Return J v, m/s, (rows n_c)."""
        q, v = self.state(y)
        return np.asarray(self.physics.contact_jacobian(q) @ v)

    def _starting(self, contacts: Contacts, y: np.ndarray) -> list[int]:
        """Return the contacts in space that slide without a velocity that has a direction, and so begin to."""
        if self.physics.rows == 2:
            return []
        slides = np.array([mode.direction != 0 for mode in contacts.modes], dtype=bool) & (self.physics.friction > 0)
        speeds = np.linalg.norm(tangential_rows(self._velocity(y), self.physics.rows), axis=1)
        return np.flatnonzero(slides & (speeds <= NO_VELOCITY)).tolist()

    def _turn(
        self,
        headings: np.ndarray,
        starting: list[int],
        dynamics: Callable[[np.ndarray, np.ndarray], ContactDynamics],
        y: np.ndarray,
    ) -> None:
        """Turn the directions of slides, in place, to where the velocities of a state point.

        Those in `starting` that have become fast leave it, and the others turn to where they accelerate.
        """
        if self.physics.rows == 2:
            return
        velocities = tangential_rows(self._velocity(y), self.physics.rows)
        if starting:
            headings[starting] = dynamics(*self.state(y)).headings[starting]
            starting[:] = [i for i in starting if np.linalg.norm(velocities[i]) <= NO_VELOCITY]
        headings[:] = slip_headings(velocities, headings)

    def _joint_headings(self, y: np.ndarray, before: np.ndarray) -> np.ndarray:
        """Return the directions of slides on limit surfaces in a state, (n_f)."""
        speeds = y[len(y) // 2 :][self.physics.friction_coordinates]
        return self.physics.rubbing.headings(speeds, before, slow=NO_VELOCITY)

    def _dynamics(
        self,
        contacts: Contacts,
        headings: tuple[np.ndarray, np.ndarray],
        starting: Sequence[int],
        q: np.ndarray,
        v: np.ndarray,
    ) -> ContactDynamics:
        """Return the dynamics of a state, slides that begin in the directions in which they accelerate."""
        dynamics = contact_dynamics(self.physics, q, v, self.control, *headings, through_zero=True)
        dynamics = dynamics.in_joint_modes(contacts.joints)
        if not starting:
            return dynamics
        found = with_beginning_headings(dynamics, contacts.modes, starting).headings
        return replace(dynamics, headings=np.where(found.any(axis=1, keepdims=True), found, dynamics.headings))

    def _rate(
        self, contacts: Contacts, dynamics: Callable[[np.ndarray, np.ndarray], ContactDynamics]
    ) -> Callable[[float, np.ndarray], np.ndarray]:
        physics, half = self.physics, len(self.physics.damping)
        forced = bool(contacts.closed.any() or contacts.joints)

        def rate(_: float, y: np.ndarray) -> np.ndarray:
            q, v = self.state(y)
            if forced:
                a = acceleration_in_modes(dynamics(q, v), contacts.modes)
            else:
                force = physics.required_force(q, v, np.zeros_like(v), self.control)
                a = np.linalg.solve(physics.mass_matrix(q), -force)
            return np.concatenate([physics.displacement_rate(self.base, y[:half], v), a])

        return rate

    def _watched(
        self,
        contacts: Contacts,
        headings: tuple[np.ndarray, np.ndarray],
        dynamics_at: Callable[[np.ndarray, np.ndarray], ContactDynamics],
    ) -> Callable[[np.ndarray], np.ndarray]:
        """Return the values that must stay positive, (2 n_c + 2 + n_f + n_s).

        Gap and slip of every contact, the margin of all their forces, that of the dry friction of sticking joints, the
        velocities of sliding ones, and how far compliant contacts are from beginning, or ceasing, to push, m.
        """
        slip = np.array([mode.direction for mode in contacts.modes]) * (self.physics.friction > 0)
        touches, count = bool(contacts.closed.any()), len(contacts.modes)
        rubbing = self.physics.rubbing
        slide = np.array([mode.direction for mode in contacts.joints], dtype=float)
        pushing = np.array([-1.0 if mode is ContactMode.TOUCH else 1.0 for mode in contacts.compliant])
        sticking = [unit for unit in rubbing.units if contacts.joints[unit[0]] is ContactMode.STICK]

        def values(y: np.ndarray) -> np.ndarray:
            q, v = self.state(y)
            result = np.full(2 * count + 2 + len(slide) + len(pushing), np.inf)
            if not contacts.closed.all():
                gaps = self.physics.gaps(q) - contacts.ground + BEYOND_GAP
                result[:count] = np.where(contacts.closed, np.inf, gaps)
            if touches or sticking:
                dynamics = dynamics_at(q, v)
            if touches:
                velocities = tangential_rows(dynamics.velocity, dynamics.rows)
                along = slip * (velocities * headings[0]).sum(axis=1) + _BEYOND_SLIP
                result[count : 2 * count] = np.where(slip == 0, np.inf, along)
                result[2 * count] = force_margin(dynamics, contacts.modes) + _BEYOND_MARGIN
            if sticking:
                friction = dynamics.joint_force(stacked_rows(motion_in_modes(dynamics, contacts.modes)[1]))
                unused = min(rubbing.unused(unit, friction) for unit in sticking)
                result[2 * count + 1] = unused / scale_of(friction) + _BEYOND_MARGIN
            speeds = v[rubbing.coordinates]
            for unit in rubbing.surfaces:
                speeds[unit] = rubbing.scaled(unit, speeds) @ headings[1][unit]
            moving = slide * speeds + _BEYOND_SLIP
            result[2 * count + 2 : 2 * count + 2 + len(slide)] = np.where(slide == 0, np.inf, moving)
            if pushing.size:
                result[2 * count + 2 + len(slide) :] = (
                    pushing * self.physics.relief(q, v) / self.physics.reach + BEYOND_GAP
                )
            return result

        return values
