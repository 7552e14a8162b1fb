"""Sequences that a task's own guess shows: what touches along it, feet that step in turn."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import permutations, product

import casadi as ca
import numpy as np

from fesd_robot.contact import Contact, ContactMode, Modes
from fesd_robot.ocp import MotionProblem, gap_function
from fesd_robot.phases.acting import acting_along, each_alone, with_acting
from fesd_robot.phases.gait import gait_images
from fesd_robot.phases.sequence import SIDES, Phase, Sequence, flying, hits, joined, landings, stuck, with_mode
from fesd_robot.phases.stepping import steppings

SAMPLES = 4
"""Of the guess, in the time of a control interval."""

TOUCHING_OF_HEIGHT = 0.2
"""Part of the largest height of a contact up to which it touches in the guess."""

LOW = 2e-3
"""m, height up to which it touches whatever the largest is."""

NEAR_OF_LENGTH = 0.02
"""Part of the robot's length; a contact that never comes nearer to what it may touch does not touch in the guess."""

HOP = (0.3, 0.4, 0.3)
"""Parts of the duration in which a robot stands, flies and stands again, where the guess knows no flight."""

TURN = (0.8, 0.2)
"""Parts of a contact's share of a cycle in which it stands, and in which all fly."""

PUSH = (0.35, 0.15, 0.25, 0.25)
"""Parts of the duration in which an object rests, is pushed, slides on, and rests again."""

MORE_HOPS = 3
"""How many more hops than the guess shows may be needed."""

MOVING = 1e-2
"""Part of the largest velocity along the ground of a contact that always touches, above which it slides."""

IN_TURN = 2
"""Compliant contacts that may be pushed one after the other in a guess: more have too many orders."""

SLIDING = 0.02
"""m, path of a contact that touches all along the guess, from which it slides."""


@dataclass(frozen=True)
class Guess:
    """A motion without forces that shows what may touch when.

    Attributes:
        motion: the formulated task.
        state: time, s -> state, of which configuration and velocity, (n_q + n_v), are taken.
    """

    motion: MotionProblem
    state: Callable[[float], np.ndarray]

    @cached_property
    def _times(self) -> np.ndarray:
        grid = self.motion.grid
        return grid.nominal * (np.arange(SAMPLES * grid.intervals) + 0.5) / (SAMPLES * grid.intervals)

    @cached_property
    def _states(self) -> np.ndarray:
        n = len(self.motion.robot.configuration_names) + len(self.motion.robot.velocity_names)
        return np.array([self.state(time)[:n] for time in self._times])

    @cached_property
    def _along(self) -> np.ndarray:
        """Velocities of all contacts along their tangents, m/s, (samples, n_c, n_t)."""
        dynamics, contacts = self.motion.dynamics, self.motion.contacts
        rows = ca.vertcat(*[ca.horzcat(*one.tangential_velocities(dynamics.velocity)) for one in contacts])
        function = ca.Function("along", [dynamics.configuration, dynamics.velocity], [ca.densify(rows)])
        n_q = len(self.motion.robot.configuration_names)
        return np.array([np.asarray(function(x[:n_q], x[n_q:])) for x in self._states])

    @cached_property
    def _touching(self) -> np.ndarray:
        gap, n_q = gap_function(self.motion.dynamics, self.motion.contacts), len(self.motion.robot.configuration_names)
        gaps = np.array([np.asarray(gap(x[:n_q])).ravel() for x in self._states])
        comes_near = gaps.min(axis=0) <= max(LOW, NEAR_OF_LENGTH * self.motion.scales.length)
        return np.asarray((gaps <= np.maximum(LOW, TOUCHING_OF_HEIGHT * gaps.max(axis=0))) & comes_near)

    def sequence(self, touching: np.ndarray | None = None) -> Sequence:
        """Return the sequence in which contacts touch as the guess does, without impacts.

        Args:
            touching: which contacts touch at which sample, if that is known, (samples, n_c).
        """
        own = self._touching if touching is None else touching
        speeds = np.linalg.norm(self._along, axis=2)
        paths = speeds.sum(axis=0) * self.motion.grid.nominal / len(self._times)
        slides = own.all(axis=0) & (paths > SLIDING) & (speeds > MOVING * speeds.max(axis=0))
        length = self.motion.grid.nominal / len(self._times)
        names = tuple(contact.name for contact in self.motion.contacts)
        joints = tuple(self.motion.dynamics.dry_friction_units)
        compliant = tuple(contact.name for contact in self.motion.compliant)
        phases = []
        for touches, slid, along, x in zip(own, slides, self._along, self._states, strict=True):
            modes = tuple(
                self._mode(contact, touch, slide, velocity)
                for contact, touch, slide, velocity in zip(self.motion.contacts, touches, slid, along, strict=True)
            )
            pushes = tuple(ContactMode.TOUCH if one < 0 else ContactMode.FLIGHT for one in self.relief(x))
            rubs = tuple(self._friction_mode(name, x) for name in joints)
            phases.append(Phase((*modes, *pushes, *rubs), length))
        phases = [
            replace(phase, acting=acting_along(self.motion, self.state, float(time)))
            for phase, time in zip(phases, self._times, strict=True)
        ]
        return Sequence((*names, *compliant, *joints), joined(phases))

    def relief(self, x: np.ndarray) -> np.ndarray:
        """Return how far the compliant contacts are from pushing in a state, N, (n_s)."""
        n_q = len(self.motion.robot.configuration_names)
        return np.asarray(self._reliefs(x[:n_q], x[n_q:])).ravel()

    @cached_property
    def half_periods(self) -> list[float]:
        """pi sqrt(m / k) of every compliant contact, s, where the guess begins: m is the mass along its normal."""
        dynamics, x = self.motion.dynamics, self._states[0][: len(self.motion.robot.configuration_names)]
        masses = [
            1 / ca.dot(one.contact.normal, ca.solve(dynamics.mass_matrix, one.contact.normal))
            for one in self.motion.compliant
        ]
        values = ca.Function("mass", [dynamics.configuration], [ca.densify(ca.vertcat(ca.SX(0, 1), *masses))])(x)
        springs = zip(np.asarray(values).ravel(), self.motion.compliant, strict=True)
        return [float(np.pi * np.sqrt(mass / one.stiffness)) for mass, one in springs]

    @cached_property
    def _reliefs(self) -> ca.Function:
        dynamics, compliant = self.motion.dynamics, self.motion.compliant
        values = ca.vertcat(ca.SX(0, 1), *[one.relief(dynamics.velocity) for one in compliant])
        return ca.Function("relief", [dynamics.configuration, dynamics.velocity], [ca.densify(values)])

    def _mode(self, contact: Contact, touches: bool, slides: bool, velocity: np.ndarray) -> ContactMode:
        if not touches:
            return ContactMode.FLIGHT
        if contact.friction == 0:
            return ContactMode.SLIP
        if not slides or contact.slip_distance == 0:
            return ContactMode.STICK
        if contact.in_space:
            return ContactMode.SLIP
        return ContactMode.SLIP_FORWARDS if velocity[0] > 0 else ContactMode.SLIP_BACKWARDS

    def _friction_mode(self, name: str, x: np.ndarray) -> ContactMode:
        first, coordinates = len(self.motion.robot.configuration_names), list(self.motion.robot.velocity_names)
        at, *others = (first + coordinates.index(one) for one in self.motion.dynamics.dry_friction_units[name])
        if max(abs(x[k]) for k in (at, *others)) < MOVING:
            return ContactMode.STICK
        if others:
            return ContactMode.SLIP
        return ContactMode.SLIP_FORWARDS if x[at] > 0 else ContactMode.SLIP_BACKWARDS

    def landing_side(self, contact: int, time: float) -> ContactMode:
        """Return how a contact slips where it comes down at a time, s, by its velocity shortly before.

        In space it does not: the direction in which it slips is not one of two, and a guess knows none.
        """
        sample = max(int(np.searchsorted(self._times, time)) - 1, 0)
        velocity = self._along[sample, contact]
        one = self.motion.contacts[contact]
        if one.friction == 0 or one.in_space:
            return ContactMode.SLIP if one.friction == 0 else ContactMode.STICK
        return ContactMode.SLIP_FORWARDS if velocity[0] >= 0 else ContactMode.SLIP_BACKWARDS


def with_hits(guess: Guess, sequence: Sequence) -> Sequence:
    """Return a sequence in which contacts that come down slip first as the guess does, and then do what they do.

    Args:
        guess: that says how they move before.
        sequence: without impacts.
    """
    phases, end = list(sequence.phases), 0.0
    for i, phase in enumerate(phases):
        begin, end = end, end + phase.duration
        lands = landings(phases[i - 1].modes, phase.modes) if i else []
        if lands:
            phases[i] = replace(phase, impacts=hits(phase.modes, {n: guess.landing_side(n, begin) for n in lands}))
    return replace(sequence, phases=tuple(phases))


def guessed_sequences(motion: MotionProblem) -> Iterator[Sequence]:
    """Yield the sequences that the guess of a task shows, the likelier first, each once.

    - feet that end elsewhere and never leave the ground in the guess step in turn (`stepping.steppings`);
    - objects that slide in the guess although nothing touches them are pushed, and those in the air are held;
    - what the guess shows, with impacts where contacts come down, and without;
    - a short flight of all contacts to begin with, which saves the way down before a jump;
    - where a cycle is asked for and the guess never leaves the ground: the step of a gait that goes on as its mirror
      image, and contacts that stand in turn;
    - a hop, where contacts slide along the guess and never leave the ground;
    - a push against every compliant contact that is not compressed, for half a period of its spring, and against two of
      them one after the other;
    - what the guess shows with one and the same set of controls acting, of those of which one acts at a time.
    """
    state = motion.ocp.state_guess
    yield from _once(with_acting(motion, state, one) for one in _guessed(motion, Guess(motion, state)))


def hops(motion: MotionProblem) -> Iterator[Sequence]:
    """Yield equal hops of all contacts that leave the ground in the guess, more of them than it shows, with impacts and
    without; none where they are never in the air at once."""
    own = Guess(motion, motion.ocp.state_guess).sequence()
    contacts = range(len(motion.contacts))
    up = [i for i in contacts if len({phase.modes[i].closed for phase in own.phases}) > 1]
    flights = sum(all(phase.modes[i] is ContactMode.FLIGHT for i in up) for phase in own.phases)
    if not up or not flights:
        return
    standing = stuck(tuple(ContactMode.STICK if i in up else mode for i, mode in enumerate(own.phases[0].modes)))
    for count in range(flights + 1, flights + 1 + MORE_HOPS):
        duration = motion.grid.nominal / (2 * count + 1)
        stance, flight = Phase(standing, duration), Phase(flying(standing, up), duration)
        landing = replace(stance, impacts=hits(standing, {i: standing[i] for i in up}))
        for one in (landing, stance):
            hopping = replace(own, phases=(stance, *(flight, one) * count))
            yield with_acting(motion, motion.ocp.state_guess, hopping)


def _once(sequences: Iterator[Sequence]) -> Iterator[Sequence]:
    seen = set()
    for sequence in sequences:
        if sequence.key not in seen:
            seen.add(sequence.key)
            yield sequence


def _guessed(motion: MotionProblem, guess: Guess) -> Iterator[Sequence]:
    own = _compressed(motion, guess, guess.sequence())
    held = [all(phase.modes[i].closed for phase in own.phases) for i in range(len(motion.contacts))]
    orders = steppings(motion)
    if orders and (_straight(motion) or all(held[foot.contact] for foot in orders[0].feet if foot.steps)):
        for stepping in orders:
            step = Guess(motion, stepping.state)
            sequence = step.sequence(np.repeat(stepping.touching, SAMPLES, axis=0))
            yield with_hits(step, sequence)
            yield sequence
        return
    yield from _handled(motion, own)
    flights = any(phase.modes[i] is ContactMode.FLIGHT for phase in own.phases for i in range(len(motion.contacts)))
    hitting = with_hits(guess, own)
    yield hitting
    first = own.phases[0]
    if flights and all(mode.closed for mode in first.modes[: len(motion.contacts)]):
        flight = Phase(flying(first.modes, range(len(motion.contacts))), 0.4 * first.duration)
        standing = replace(first, duration=0.6 * first.duration)
        yield with_hits(guess, replace(own, phases=(flight, standing, *own.phases[1:])))
    if not flights and motion.task.goal.periodic is not None:
        yield from _steps(motion, own)
        yield from _cycles(motion, own)
    if not flights and any(mode in SIDES for phase in own.phases for mode in phase.modes):
        yield with_hits(guess, _hop(motion, own))
    yield own
    yield from _pushes(motion, guess, own)
    yield from each_alone(motion, own)


def _straight(motion: MotionProblem) -> bool:
    """Whether the guess is the straight line from start to goal, which knows no flight, whatever it passes over."""
    return motion.task.reference.type == "line" and motion.task.solver.warm_start is None


def _compressed(motion: MotionProblem, guess: Guess, own: Sequence) -> Sequence:
    """Return the sequence in which what is compressed at the start is, for half a period of its spring at most."""
    ends, first, phase = motion.endpoints, len(motion.contacts), own.phases[0]
    if motion.task.goal.periodic is not None:
        return own
    relief = guess.relief(np.concatenate([ends.initial_configuration, ends.initial_velocity]))
    pushing = [i for i in np.flatnonzero(relief < 0).tolist() if phase.modes[first + i] is ContactMode.FLIGHT]
    if not pushing:
        return own
    modes = phase.modes
    for i in pushing:
        modes = with_mode(modes, first + i, ContactMode.TOUCH)
    length = min(0.5 * phase.duration, *(guess.half_periods[i] for i in pushing))
    later = replace(phase, duration=phase.duration - length)
    return replace(own, phases=(Phase(modes, length, phase.impacts), replace(later, impacts=()), *own.phases[1:]))


def _pushes(motion: MotionProblem, guess: Guess, own: Sequence) -> Iterator[Sequence]:
    """Yield the sequences with one push, or two, in the longest phase of what the guess shows."""
    longest = max(range(len(own.phases)), key=lambda i: own.phases[i].duration)
    phase, first = own.phases[longest], len(motion.contacts)
    free = [n for n in range(first, first + len(motion.compliant)) if phase.modes[n] is ContactMode.FLIGHT]
    spans = dict(zip(range(first, first + len(motion.compliant)), guess.half_periods, strict=True))
    for group in (*permutations(free, 1), *(permutations(free, 2) if len(free) == IN_TURN else ())):
        lengths = [min(spans[n], phase.duration / (2 * len(group) + 1)) for n in group]
        apart = (phase.duration - sum(lengths)) / (len(group) + 1)
        parts = [Phase(phase.modes, apart)]
        for n, length in zip(group, lengths, strict=True):
            parts += [Phase(with_mode(phase.modes, n, ContactMode.TOUCH), length), Phase(phase.modes, apart)]
        yield replace(own, phases=(*own.phases[:longest], *parts, *own.phases[longest + 1 :]))


def _handled(motion: MotionProblem, own: Sequence) -> Iterator[Sequence]:
    """Yield the sequences in which objects are held while they are in the air, and pushed before they slide.

    An object is what contacts push that no motor moves; what may hold and push it are contacts between it and something
    that motors move, which never touch in the guess.
    """
    driven = set(motion.actuation.matrix.sparsity_out(0).row())
    moved = [set(ca.sparsify(one.normal).sparsity().row()) for one in motion.contacts]
    on_objects = [i for i, own_velocities in enumerate(moved) if not own_velocities & driven]
    objects = set[int]().union(*(moved[i] for i in on_objects))
    hands = [
        i
        for i, own_velocities in enumerate(moved)
        if own_velocities & driven
        and own_velocities & objects
        and all(phase.modes[i] is ContactMode.FLIGHT for phase in own.phases)
    ]
    if not hands:
        return

    def touching(modes: Modes) -> Modes:
        held = {i: ContactMode.STICK if motion.contacts[i].friction > 0 else ContactMode.SLIP for i in hands}
        return tuple(held.get(i, mode) for i, mode in enumerate(modes))

    in_air = [all(phase.modes[i] is ContactMode.FLIGHT for i in on_objects) for phase in own.phases]
    if any(in_air):
        phases = zip(own.phases, in_air, strict=True)
        held = replace(own, phases=tuple(replace(one, modes=touching(one.modes)) if up else one for one, up in phases))
        yield held
        yield _hitting(held, hands)
    sliding = next((one.modes for one in own.phases if any(one.modes[i] in SIDES for i in on_objects)), None)
    if sliding is not None:
        parts = zip((stuck(sliding), touching(sliding), sliding, stuck(sliding)), PUSH, strict=True)
        pushed = replace(own, phases=tuple(Phase(modes, part * motion.grid.nominal) for modes, part in parts))
        yield pushed
        yield _hitting(pushed, hands)


def _hitting(sequence: Sequence, contacts: list[int]) -> Sequence:
    """Return a sequence in which contacts hit where they come down, and do what follows."""
    phases = list(sequence.phases)
    for i in range(1, len(phases)):
        lands = {n: phases[i].modes[n] for n in landings(phases[i - 1].modes, phases[i].modes) if n in contacts}
        if lands:
            phases[i] = replace(phases[i], impacts=hits(phases[i].modes, lands))
    return replace(sequence, phases=tuple(phases))


def _steps(motion: MotionProblem, own: Sequence) -> Iterator[Sequence]:
    """Yield the steps in which of contacts that change places in a mirror one stands, and the other one swings and hits
    where the step ends."""
    images, modes = gait_images(motion), own.phases[0].modes
    pairs = [(i, k) for i, k in enumerate(images) if i < k and images[k] == i]
    for stands in product(*pairs) if pairs else ():
        swings = [sum(pair) - i for pair, i in zip(pairs, stands, strict=True)]
        after = flying(modes, stands)
        step = Phase(flying(modes, swings), motion.grid.nominal)
        yield replace(own, phases=(step,), at_end=hits(after, {n: after[n] for n in swings}))


def _cycles(motion: MotionProblem, own: Sequence) -> Iterator[Sequence]:
    """Yield the cycles in which contacts stand in turn, in either order, with a flight after each."""
    contacts, modes = range(len(motion.contacts)), own.phases[0].modes
    flight = flying(modes, contacts)
    for order in (contacts, contacts[::-1]) if len(contacts) > 1 else ():
        turns = [
            (tuple(ContactMode.STICK if i == stands else mode for i, mode in enumerate(flight)), part)
            for stands in order
            for part in TURN
        ]
        parts = [(flight if number % 2 else modes, part) for number, (modes, part) in enumerate(turns)]
        duration = motion.grid.nominal / len(contacts)
        yield replace(own, phases=tuple(Phase(modes, part * duration) for modes, part in parts))


def _hop(motion: MotionProblem, own: Sequence) -> Sequence:
    """Return the sequence in which everything that slides along a guess sticks, flies and sticks again instead."""
    stick = stuck(own.phases[0].modes)
    flight = flying(stick, range(len(motion.contacts)))
    parts = zip((stick, flight, stick), HOP, strict=True)
    return replace(own, phases=tuple(Phase(modes, part * motion.grid.nominal) for modes, part in parts))
