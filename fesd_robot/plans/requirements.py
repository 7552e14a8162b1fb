"""Requirements of a task besides physics and limits, measured on the returned trajectory."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import singledispatch

import numpy as np
import pinocchio as pin

from fesd_robot.contact import ContactMode, Surface
from fesd_robot.errors import ModelError
from fesd_robot.instants import SAME_EVENT
from fesd_robot.plans.body_distances import BodyDistances
from fesd_robot.plans.contact_outcome import contact_outcomes
from fesd_robot.plans.measured import Measured, largest
from fesd_robot.plans.points import point_motion
from fesd_robot.recovery import NumericPhysics, PhysicalMotion, tangential_rows
from fesd_robot.robot import Robot, measured_deviation
from fesd_robot.task import (
    GROUND,
    AvoidBox,
    AvoidEllipse,
    AvoidSphere,
    BodyPoint,
    Clearance,
    ContactWindow,
    DistanceConstraint,
    ForbiddenZone,
    FrameLimits,
    FreeDuration,
    Goal,
    PointTarget,
    SwingClearance,
    Task,
    Waypoint,
)

_TOUCHING_FORCE = 1e-2
"""N; a contact with a smaller normal force does not touch."""

_TOUCHING_IMPULSE = 1e-6
"""N s; a contact with a smaller impulse takes no part in an impact."""

_ZONE_TOLERANCE = 1e-3
"""m; where a forbidden zone ends is measured no more exactly than whether a gap is closed."""


def requirements(
    task: Task,
    robot: Robot,
    physics: NumericPhysics,
    motion: PhysicalMotion,
    initial: tuple[np.ndarray, np.ndarray],
    goal: tuple[np.ndarray, np.ndarray],
) -> dict[str, Measured]:
    """Return how far a motion misses its constraints, its goal and its waypoints, each the largest violation.

    Everything is computed with Pinocchio's numeric algorithms from configurations, velocities, forces and times.

    Args:
        task: what was asked for.
        robot: of the task.
        physics: its ground and the gaps of its contacts.
        motion: the trajectory in physical time.
        initial, goal: configuration, (n_q), and velocity, (n_v), with everything filled in that the task leaves out.

    Returns:
        ``max_slip_violation`` in m/s, ``max_slip_distance_violation`` in m, ``max_reserve_violation`` of the cone,
        ``max_constraint_violation``, ``max_goal_violation``, ``max_waypoint_violation`` in m, rad, m/s or rad/s, and
        ``max_simultaneous_control`` in N or N m, zero if nothing is violated, each with its place.
    """
    checks = _Checks(task, robot, physics, motion)
    return {
        "max_slip_violation": largest(checks.slip()),
        "max_slip_distance_violation": largest(checks.slip_distance()),
        "max_reserve_violation": largest(checks.reserve()),
        "max_constraint_violation": largest(checks.constraints()),
        "max_goal_violation": largest(checks.goal(initial, goal)),
        "max_waypoint_violation": largest(checks.waypoints()),
        "max_simultaneous_control": largest(checks.simultaneous()),
    }


@singledispatch
def violations(constraint: BodyPoint, point: np.ndarray, ground: Surface) -> Iterator[float]:
    """Yield by how much a point violates a constraint, m; negative where there is room left.

    Args:
        constraint: of the task.
        point: position in world axes, m, (3,).
        ground: of the scene.

    Raises:
        ModelError: a kind of constraint without a measure.
    """
    raise ModelError(f"no violation is known for {type(constraint).__name__}")


@violations.register
def _clearance(constraint: Clearance, point: np.ndarray, ground: Surface) -> Iterator[float]:
    yield constraint.distance - float(ground.distance(point))


@violations.register
def _sphere(constraint: AvoidSphere, point: np.ndarray, ground: Surface) -> Iterator[float]:
    yield constraint.radius - float(np.linalg.norm(_offset(point, constraint.center)))


@violations.register
def _box(constraint: AvoidBox, point: np.ndarray, ground: Surface) -> Iterator[float]:
    half = 0.5 * _given(constraint.size)
    yield float(np.min(half - np.abs(_offset(point, constraint.center))))


@violations.register
def _ellipse(constraint: AvoidEllipse, point: np.ndarray, ground: Surface) -> Iterator[float]:
    axes = _given(constraint.semi_axes)
    yield float(np.min(axes) * (1.0 - np.linalg.norm(_offset(point, constraint.center) / axes)))


@violations.register
def _frame_limits(constraint: FrameLimits, point: np.ndarray, ground: Surface) -> Iterator[float]:
    for value, bounds in zip(point, (constraint.x, constraint.y, constraint.z), strict=True):
        if bounds is not None:
            yield float(max(bounds[0] - value, value - bounds[1]))


class _Checks:
    """Violations of one motion; negative where there is room left."""

    def __init__(self, task: Task, robot: Robot, physics: NumericPhysics, motion: PhysicalMotion) -> None:
        self._task, self._robot, self._physics, self._motion = task, robot, physics, motion
        self._states = motion.states
        self._ground = physics.scene.surfaces[GROUND]
        self._data = robot.model.createData()
        self._contacts = task.rigid_contacts
        self._names = list(self._contacts)

    def slip(self) -> Iterator[Measured]:
        """Yield the tangential velocity, m/s, of every contact that may not slip, at every stage where it touches."""
        bound = [i for i, contact in enumerate(self._contacts.values()) if contact.slipping == "forbidden"]
        for k in np.flatnonzero(self._motion.weight > 0) if bound else ():
            velocity = self._motion.velocity[k]
            rows = self._physics.contact_jacobian(self._motion.configuration[k]) @ velocity
            speeds = np.linalg.norm(tangential_rows(rows, self._physics.rows), axis=1)
            for i in bound:
                if self._motion.force[k, i, 0] > _TOUCHING_FORCE:
                    yield self._at(int(k), float(speeds[i]), self._names[i])

    def slip_distance(self) -> Iterator[Measured]:
        """Yield by how much the slides of every contact with a limit, all together, are longer than that, m."""
        limits = {name: c.slipping for name, c in self._contacts.items() if isinstance(c.slipping, float)}
        outcomes = contact_outcomes(self._motion, self._physics, self._names) if limits else {}
        for name, limit in limits.items():
            yield Measured(outcomes[name].slide_distance - limit, subject=name)

    def reserve(self) -> Iterator[Measured]:
        """Yield how much more of its cone than its reserve leaves it a contact uses, sticking or coming to rest."""
        default, contacts = self._task.reserve.friction, self._contacts
        left = {name: 1 - (default if one.reserve is None else one.reserve) for name, one in contacts.items()}
        reserved = {name: share for name, share in left.items() if share < 1}
        outcomes = contact_outcomes(self._motion, self._physics, self._names) if reserved else {}
        for name, share in reserved.items():
            rests = contacts[name].slipping == "forbidden" and self._physics.restitution[self._names.index(name)] == 0
            for use in (outcomes[name].sticking, outcomes[name].landing if rests else None):
                if use is not None:
                    yield Measured(use.share - share, use.time, self._interval(use.time), name)

    def _interval(self, time: float) -> int:
        return int(self._motion.interval[self._samples(time)[-1]])

    def simultaneous(self) -> Iterator[Measured]:
        """Yield the largest control of the second strongest set of every group of which one set acts at a time."""
        names = list(self._task.robot.actuators or {})
        for sets in self._task.robot.one_at_a_time.values():
            rows = [[names.index(name) for name in controls] for controls in sets.values()]
            largest_ones = np.array([self._motion.control[:, own].max(axis=1) for own in rows])
            strongest = np.argsort(largest_ones, axis=0)
            for k, second in enumerate(strongest[-2]):
                name = names[rows[second][int(np.argmax(self._motion.control[k, rows[second]]))]]
                yield self._at(k, float(largest_ones[second, k]), name)

    def constraints(self) -> Iterator[Measured]:
        """Yield the violation of every constraint at every state it holds at, stages and states between them."""
        for name, constraint in self._task.constraints.items():
            if isinstance(constraint, BodyPoint):
                found = self._point(constraint)
            elif isinstance(constraint, DistanceConstraint):
                found = self._distance(constraint)
            elif isinstance(constraint, ForbiddenZone):
                found = self._zone(constraint)
            elif isinstance(constraint, ContactWindow):
                found = self._window(constraint)
            elif isinstance(constraint, SwingClearance):
                found = self._swing(constraint)
            else:
                continue
            for one in found:
                yield replace(one, subject=name)

    def _point(self, constraint: BodyPoint) -> Iterator[Measured]:
        for k, q in enumerate(self._states.configuration):
            point = self._position(q, constraint.frame, constraint.offset)
            for value in violations(constraint, point, self._ground):
                yield self._at(k, value)

    def _distance(self, constraint: DistanceConstraint) -> Iterator[Measured]:
        measure = BodyDistances(self._robot, constraint)
        for k, q in enumerate(self._states.configuration):
            yield self._at(k, constraint.minimum - measure.least(q))

    def _zone(self, zone: ForbiddenZone) -> Iterator[Measured]:
        i, motion = self._names.index(zone.contact), self._motion
        frame = self._task.single_contacts[zone.contact].touching_frame
        touching = set(np.flatnonzero(motion.force[:, i, 0] > _TOUCHING_FORCE).tolist())
        touching |= {impact.after for impact in motion.impacts if impact.impulse[i, 0] > _TOUCHING_IMPULSE}
        dense = motion.between
        closed = [mode is not ContactMode.FLIGHT for mode in dense.mode[:, i]]
        touching |= set((len(motion.time) + np.flatnonzero(np.repeat(closed, dense.time.shape[1]))).tolist())
        for k in sorted(touching):
            x = float(self._position(self._states.configuration[k], frame)[0])
            yield self._at(k, min(x - zone.x[0], zone.x[1] - x) - _ZONE_TOLERANCE)

    def _window(self, window: ContactWindow) -> Iterator[Measured]:
        motion, states, (first, last) = self._motion, self._states, window.times
        i = self._names.index(window.contact)
        if window.touch == "forbidden":
            for k in np.flatnonzero((states.time > first + SAME_EVENT) & (states.time <= last + SAME_EVENT)):
                yield self._at(int(k), window.clearance - float(self._physics.gaps(states.configuration[k])[i]))
            return
        for time in motion.clock[(motion.clock >= first - SAME_EVENT) & (motion.clock <= last + SAME_EVENT)]:
            last = self._samples(float(time))[-1]
            yield self._at(last, float(self._physics.gaps(motion.configuration[last])[i]) - window.tolerance)

    def _swing(self, swing: SwingClearance) -> Iterator[Measured]:
        assert swing.speed is not None
        contacts = [self._names.index(name) for name in swing.contacts]
        for k, (q, v) in enumerate(zip(self._states.configuration, self._states.velocity, strict=True)):
            velocities = tangential_rows(self._physics.contact_jacobian(q) @ v, self._physics.rows)
            gaps, speeds = self._physics.gaps(q), np.linalg.norm(velocities, axis=1)
            for i in contacts:
                ratio = (speeds[i] / swing.speed) ** 2
                demand = swing.height * (ratio - 1) / (ratio + 1) - swing.spare
                yield self._at(k, demand - float(gaps[i]))

    def goal(self, initial: tuple[np.ndarray, np.ndarray], goal: tuple[np.ndarray, np.ndarray]) -> Iterator[Measured]:
        """Yield the violations of hard goals, of a period, and of the bounds of a free duration."""
        asked, duration = self._task.goal, self._task.horizon.duration
        names, velocities = self._robot.configuration_names, self._robot.velocity_names
        q, v = self._motion.configuration[-1], self._motion.velocity[-1]
        q0, v0, end = self._motion.configuration[0], self._motion.velocity[0], len(self._motion.time) - 1
        if isinstance(duration, FreeDuration):
            reached = float(self._motion.clock[-1])
            yield self._at(end, max(duration.lower - reached, reached - duration.upper), "the duration")
        if asked.periodic is not None:
            for final, first, subjects in ((q, q0, names), (v, v0, velocities)):
                began = dict(zip(subjects, first, strict=True))
                for name, value in zip(subjects, final, strict=True):
                    source, sign = asked.periodic.source(name)
                    stride = asked.periodic.stride.get(name, 0.0) if subjects is names else 0.0
                    yield self._at(end, float(abs(value - sign * began[source] - stride)), name)
            for i, name in enumerate(names):
                if name in asked.periodic.stride:
                    yield self._at(0, float(abs(q0[i] - initial[0][i])), name)
        else:
            for name, value in zip(names, q0 - initial[0], strict=True):
                yield self._at(0, float(abs(value)), name)
            yield from self._coordinates(asked, goal, end)
        yield from self._points(asked, end)

    def waypoints(self) -> Iterator[Measured]:
        """Yield the violations of hard targets of waypoints."""
        intervals, count = self._task.horizon.intervals, len(self._task.waypoints)
        names, velocities = self._robot.configuration_names, self._robot.velocity_names
        for i, waypoint in enumerate(self._task.waypoints):
            time = waypoint.time
            if time is None:
                time = float(self._motion.clock[-1]) * round((i + 1) * intervals / (count + 1)) / intervals
            wanted = (
                np.array([waypoint.configuration.get(name, np.nan) for name in names]),
                np.array([waypoint.velocity.get(name, np.nan) for name in velocities]),
            )
            missed = [
                largest(itertools.chain(self._coordinates(waypoint, wanted, k), self._points(waypoint, k)))
                for k in self._samples(time)
            ]
            yield min(missed, key=lambda one: one.value)

    def _at(self, k: int, value: float, subject: str = "") -> Measured:
        """Return a value at a state, a sample or one of those between stages behind them."""
        return Measured(value, float(self._states.time[k]), int(self._states.interval[k]), subject)

    def _coordinates(
        self, asked: Goal | Waypoint, wanted: tuple[np.ndarray, np.ndarray], sample: int
    ) -> Iterator[Measured]:
        q, v = self._motion.configuration[sample], self._motion.velocity[sample]
        velocities = self._robot.velocity_names
        groups: list[tuple[Mapping[str, float], Mapping[str, float]]] = [
            (asked.tolerance.configuration, measured_deviation(self._robot.configuration_names, q, wanted[0])),
            (asked.tolerance.velocity, dict(zip(velocities, (v - wanted[1]).tolist(), strict=True))),
        ]
        for widths, deviations in groups:
            for name, width in widths.items():
                yield self._at(sample, abs(deviations[name]) - width, name)

    def _points(self, asked: Goal | Waypoint, sample: int) -> Iterator[Measured]:
        q, v = self._motion.configuration[sample], self._motion.velocity[sample]
        for name, target in asked.frames.items():
            for value in _missed(target, *point_motion(self._robot, q, v, name)):
                yield self._at(sample, value, name)
        if asked.center_of_mass is not None:
            for value in _missed(asked.center_of_mass, *point_motion(self._robot, q, v, None)):
                yield self._at(sample, value, "the centre of mass")

    def _position(self, q: np.ndarray, frame: str, offset: Sequence[float] = (0.0, 0.0, 0.0)) -> np.ndarray:
        pin.framesForwardKinematics(self._robot.model, self._data, q)
        placement = self._data.oMf[self._robot.frame_id(frame)]
        return np.asarray(placement.act(np.asarray(offset, dtype=float)))

    def _samples(self, time: float) -> list[int]:
        """Return the indices of the samples at the end of a control interval, two if it is the time of an impact."""
        near = np.flatnonzero(np.abs(self._motion.time - time) <= SAME_EVENT)
        return near.tolist() or [int(np.argmin(np.abs(self._motion.time - time)))]


def _missed(target: PointTarget, position: np.ndarray, velocity: np.ndarray) -> Iterator[float]:
    for wanted, width, reached in (
        (target.position, target.tolerance, position),
        (target.velocity, target.velocity_tolerance, velocity),
    ):
        if wanted is not None and width is not None:
            for goal, value in zip(wanted, reached, strict=True):
                if goal is not None:
                    yield abs(float(value) - goal) - width


def _offset(point: np.ndarray, center: Sequence[float | None]) -> np.ndarray:
    return np.array([point[i] - value for i, value in enumerate(center) if value is not None])


def _given(values: Sequence[float | None]) -> np.ndarray:
    return np.array([value for value in values if value is not None])
