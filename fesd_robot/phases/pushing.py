"""Pushes of objects on a table: where they have to act so that an object goes to its goal, and guesses that do."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from scipy.optimize import least_squares

from fesd_robot.contact import ContactMode, Modes
from fesd_robot.ocp import MotionProblem, gap_function
from fesd_robot.phases.sequence import Phase, Sequence, hits

APPROACH, PUSHED = 0.35, 0.95
"""Parts of the duration at which a push begins whose contact is open at the start, and at which every push ends."""

STARTS = 40
"""Postures, beside that of the start, from which a place to push at is looked for."""

TOUCHES = 1e-3
"""m; a contact with a smaller gap touches."""

SAMPLES = 11
"""Of a push, between which its guess is interpolated."""

CLEAR = 0.05
"""Of the robot's length: how far an approach stays away from what it goes round."""

STEP, MOST_STEPS = 0.02, 2000
"""Of the robot's length: steps of an approach; and how many there may be."""

LEAST_ALONG = 0.5
"""Cosine between what a push gives and what an object needs, in units of its friction, below which it is none."""

GAP_WEIGHT = 30.0
"""Of a gap in units of the object's path or the robot's length, beside 1 - cosine."""


@dataclass(frozen=True)
class Pushing:
    """A push of an object as a sequence, and as a guess.

    Attributes:
        sequences: that may have its motion, the likelier first.
        state: time, s -> state, (n_x): what pushes goes round the object to where it pushes, and with it to its goal.
    """

    sequences: tuple[Sequence, ...]
    state: Callable[[float], np.ndarray]


def pushings(motion: MotionProblem) -> Iterator[Pushing]:
    """Yield the pushes that bring objects with a limit surface to their goals, one for every contact that can do it.

    An object that slides with the velocity v needs the force ``F_k^2 v_k`` along its coordinates, by the normality rule
    of its ellipsoid with the axes F_k; what a contact gives is its normal J_n. The contact pushes where the cosine
    between both, in units of F_k, is the largest that driven coordinates can reach.

    Args:
        motion: the formulated task.

    Source: Goyal, Ruina, Papadopoulos, Wear 143 (1991), for the normality rule; the search for a place is ours.
    """
    driven = set(motion.actuation.matrix.sparsity_out(0).row())
    names, known = list(motion.dynamics.velocity_names), set(motion.robot.configuration_names)
    for unit, coordinates in motion.dynamics.limit_surfaces.items():
        rows = [names.index(one) for one in coordinates]
        if driven & set(rows) or not known.issuperset(coordinates):
            continue
        for number, contact in enumerate(motion.contacts):
            moved = set(ca.sparsify(contact.normal).sparsity().row())
            own = _Push(motion, unit, rows, number, sorted(moved & driven))
            if moved & set(rows) and moved & driven and (found := own.pushing()) is not None:
                yield found


@dataclass(frozen=True)
class _Push:
    """A push of an object by a contact.

    Attributes:
        motion: the formulated task.
        unit: name of the object's limit surface.
        rows: its velocity coordinates.
        contact: number of the contact.
        driven: velocity coordinates that controls push and that move the contact.
    """

    motion: MotionProblem
    unit: str
    rows: list[int]
    contact: int
    driven: list[int]

    def pushing(self) -> Pushing | None:
        """Return the push, None where the object has not far to go or nothing can push it there."""
        if not np.linalg.norm(self._goal[self._own] - self._start[self._own]) > 0:
            return None
        place = self._place()
        return None if place is None else Pushing(tuple(self._sequences()), self._state(place))

    @cached_property
    def _start(self) -> np.ndarray:
        return np.asarray(self.motion.endpoints.initial_configuration)

    @cached_property
    def _goal(self) -> np.ndarray:
        return np.asarray(self.motion.endpoints.goal_configuration)

    @cached_property
    def _own(self) -> list[int]:
        """The object's coordinates among those of the configuration; those of a plane have the same names."""
        names = list(self.motion.robot.configuration_names)
        return [names.index(self.motion.robot.velocity_names[row]) for row in self.rows]

    @cached_property
    def _pushing(self) -> list[int]:
        names = list(self.motion.robot.configuration_names)
        return [names.index(self.motion.robot.velocity_names[row]) for row in self.driven]

    @cached_property
    def _limits(self) -> np.ndarray:
        return np.array([self.motion.dynamics.dry_friction_limits[row] for row in self.rows])

    @cached_property
    def _arc(self) -> _Arc:
        return _Arc.between(self._start[self._own], self._goal[self._own])

    @cached_property
    def _touched(self) -> bool:
        gap = np.asarray(gap_function(self.motion.dynamics, self.motion.contacts)(self._start)).ravel()
        return bool(gap[self.contact] <= TOUCHES)

    @cached_property
    def _geometry(self) -> ca.Function:
        """q -> gap and normal of the contact."""
        contact = self.motion.contacts[self.contact]
        return ca.Function("push", [self.motion.dynamics.configuration], [contact.gap, ca.densify(contact.normal)])

    def _residual(self, values: np.ndarray, q: np.ndarray, needed: np.ndarray) -> np.ndarray:
        at = q.copy()
        at[self._pushing] = values
        gap, normal = (np.asarray(part).ravel() for part in self._geometry(at))
        given = normal[self.rows] / self._limits
        cosine = given @ needed / max(float(np.linalg.norm(given)), 1e-12)
        return np.array([GAP_WEIGHT * gap[0] / self._length, 1 - cosine])

    @cached_property
    def _length(self) -> float:
        return float(self.motion.scales.length)

    def _needed(self, part: float) -> np.ndarray:
        """Return the force that the object needs in a part of its way, in units of its friction, of length one."""
        force = self._limits * self._arc.velocity(part)
        return np.asarray(force / np.linalg.norm(force))

    def _place(self) -> np.ndarray | None:
        """Return the driven coordinates at which the contact pushes best where the object is at the start."""
        needed = self._needed(0.0)
        random, first = np.random.default_rng(0), self._start[self._pushing]
        lower, upper = (bound[self._pushing] for bound in self._position_limits)
        starts = [first, *(first + self._length * random.normal(size=(STARTS, len(first))))]
        best, place = np.inf, None
        for one in starts:
            end = least_squares(
                self._residual, np.clip(one, lower, upper), args=(self._start, needed), bounds=(lower, upper)
            )
            gap, along = end.fun
            if abs(gap) <= GAP_WEIGHT * TOUCHES / self._length and along < best - 1e-6 and along <= 1 - LEAST_ALONG:
                best, place = along, end.x
        return place

    @property
    def _position_limits(self) -> tuple[np.ndarray, np.ndarray]:
        limits = self.motion.limits
        margin = 1e-9
        return limits.lower_position - margin, limits.upper_position + margin

    def _state(self, place: np.ndarray) -> Callable[[float], np.ndarray]:
        """Return the guess: approach in a line, push as long as the object moves, at the same place of it."""
        duration = self.motion.grid.nominal
        begin = 0.0 if self._touched else APPROACH * duration
        length = PUSHED * duration - begin
        known, n_q = self._along(place), len(self._start)
        approach = self._approach(place) if begin else np.zeros((0, 1 + len(place)))
        usual = self.motion.ocp.state_guess

        def configuration(time: float) -> np.ndarray:
            q = self._start.copy()
            share = float(np.clip((time - begin) / length, 0, 1))
            part = share**2 * (3 - 2 * share)
            q[self._own] = self._arc.pose(part)
            if approach is not None and time < begin:
                q[self._pushing] = [np.interp(time / begin, approach[:, 0], column) for column in approach[:, 1:].T]
            else:
                q[self._pushing] = [np.interp(part, known[:, 0], column) for column in known[:, 1:].T]
            return q

        gaps, first = gap_function(self.motion.dynamics, self.motion.contacts), n_q + self.motion.robot.model.nv
        step = 1e-4 * duration

        def state(time: float) -> np.ndarray:
            x, q = np.array(usual(time)), configuration(time)
            later, earlier = configuration(min(time + step, duration)), configuration(max(time - step, 0.0))
            speed = (later - earlier) / (min(time + step, duration) - max(time - step, 0.0))
            x[:n_q] = q
            for row, at in zip([*self.rows, *self.driven], [*self._own, *self._pushing], strict=True):
                x[n_q + row] = speed[at]
            x[first + 1 : first + 1 + len(self.motion.contacts)] = np.maximum(np.asarray(gaps(q)).ravel(), 0.0)
            return x

        return state

    def _along(self, place: np.ndarray) -> np.ndarray:
        """Return the driven coordinates along the push: part of the way and coordinates, (n, 1 + n_d)."""
        rows, values = list[list[float]](), place
        lower, upper = (bound[self._pushing] for bound in self._position_limits)
        for part in np.linspace(0, 1, SAMPLES):
            q = self._start.copy()
            q[self._own] = self._arc.pose(float(part))
            arguments = (q, self._needed(float(part)))
            values = least_squares(
                self._residual, np.clip(values, lower, upper), args=arguments, bounds=(lower, upper)
            ).x
            rows.append([float(part), *values])
        return np.array(rows)

    def _approach(self, place: np.ndarray) -> np.ndarray:
        """Return the driven coordinates along the approach, which goes round the object: part of it and coordinates.

        It is the line to the place as long as that is clear of the object, and else goes along it, on to the side to
        which it turned.
        """
        at, rows, along = self._start[self._pushing], [self._start[self._pushing]], np.zeros(len(place))
        lower, upper = (bound[self._pushing] for bound in self._position_limits)
        step = STEP * self._length
        for _ in range(MOST_STEPS):
            way = place - at
            left = float(np.linalg.norm(way))
            if left <= step:
                break
            q = self._start.copy()
            q[self._pushing] = at
            gap, normal = (np.asarray(part).ravel() for part in self._geometry(q))
            outwards = normal[self.driven] / max(float(np.linalg.norm(normal[self.driven])), 1e-12)
            clear, move = min(CLEAR * self._length, left), way / left
            if gap[0] < clear + step and move @ outwards < 0:
                along = along if along.any() else move
                along = along - (along @ outwards) * outwards
                along = along / max(float(np.linalg.norm(along)), 1e-12)
                move = along + outwards * max(clear - gap[0], 0.0) / step
            else:
                along = np.zeros(len(place))
            at = np.clip(at + step * move, lower, upper)
            rows.append(at)
        known = np.array([*rows, place])
        lengths = np.linalg.norm(np.diff(known, axis=0), axis=1)
        return np.column_stack([np.append(0.0, np.cumsum(lengths) / max(float(lengths.sum()), 1e-12)), known])

    def _sequences(self) -> Iterator[Sequence]:
        """Yield approach, push and rest in several ways."""
        motion = self.motion
        joints = list(motion.dynamics.dry_friction_units)
        names = (*(contact.name for contact in motion.contacts), *joints)
        touching = ContactMode.STICK if motion.contacts[self.contact].friction > 0 else ContactMode.SLIP

        def modes(touches: bool, slides: bool) -> Modes:
            contacts = [ContactMode.FLIGHT] * len(motion.contacts)
            if touches:
                contacts[self.contact] = touching
            units = [ContactMode.SLIP if slides and one == self.unit else ContactMode.STICK for one in joints]
            return (*contacts, *units)

        whole = motion.grid.nominal
        push, away, rest = modes(True, True), modes(False, True), modes(False, False)
        hit = hits(push, {self.contact: touching})
        begin = 0.0 if self._touched else APPROACH * whole
        first = () if self._touched else (Phase(rest, begin),)
        for impacts in ((),) if self._touched else (hit, ()):
            yield Sequence(names, (*first, Phase(push, whole - begin, impacts)))
            left = whole - begin
            yield Sequence(
                names,
                (*first, Phase(push, 0.6 * left, impacts), Phase(away, 0.3 * left), Phase(rest, 0.1 * left)),
            )


@dataclass(frozen=True)
class _Arc:
    """The way between two poses in the x-z plane on which the velocity is constant in the axes of the body.

    Attributes:
        begin: x, z and pitch, m and rad.
        velocity_of_body: of the whole way in these axes, x + i z, m.
        turn: of the whole way, against the pitch, rad.
    """

    begin: np.ndarray
    velocity_of_body: complex
    turn: float

    @classmethod
    def between(cls, begin: np.ndarray, end: np.ndarray) -> _Arc:
        """Return the way from one pose to another one, (3) each."""
        turn, way = float(begin[2] - end[2]), complex(*(end - begin)[:2])
        return cls(begin, way * np.exp(1j * begin[2]) / _mean_turned(turn), turn)

    def pose(self, part: float) -> np.ndarray:
        """Return x, z and pitch after a part of the way, (3)."""
        moved = np.exp(-1j * self.begin[2]) * self.velocity_of_body * part * _mean_turned(part * self.turn)
        return self.begin + np.array([moved.real, moved.imag, -part * self.turn])

    def velocity(self, part: float) -> np.ndarray:
        """Return the derivative of the pose by the part of the way, (3)."""
        turned = np.exp(1j * (part * self.turn - self.begin[2])) * self.velocity_of_body
        return np.array([turned.real, turned.imag, -self.turn])


def _mean_turned(turn: float) -> complex:
    """Return the mean of exp(i a) over 0 <= a <= turn."""
    return complex((np.exp(1j * turn) - 1) / (1j * turn)) if abs(turn) > 1e-9 else complex(1.0, turn / 2)
