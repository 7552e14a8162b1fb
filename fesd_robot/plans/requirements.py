"""What a task requires of a motion besides physics and limits, measured on the returned trajectory."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from functools import singledispatch

import numpy as np
import pinocchio as pin

from fesd_robot.contact import Ground
from fesd_robot.errors import ModelError
from fesd_robot.plans.audit_record import largest_violation
from fesd_robot.plans.contact_outcome import contact_outcomes
from fesd_robot.plans.points import point_motion
from fesd_robot.recovery import PhysicalMotion
from fesd_robot.recovery.contact_rows import tangential_rows
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.robot import Robot
from fesd_robot.task import (
    GROUND,
    AvoidBox,
    AvoidEllipse,
    AvoidSphere,
    BodyPoint,
    Clearance,
    ContactWindow,
    ForbiddenZone,
    FrameLimits,
    FreeDuration,
    Goal,
    PointTarget,
    Task,
    Waypoint,
)

_SAME_TIME = 1e-6
"""s; samples this near to the end of a control interval belong to it."""

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
) -> dict[str, float]:
    """Return how far a motion misses its constraints, its goal and its waypoints, each the largest violation.

    Everything is computed with Pinocchio's numeric algorithms from configurations, velocities, forces and times.

    Args:
        task: what was asked for.
        robot: of the task.
        physics: its ground and the gaps of its contacts.
        motion: the trajectory in physical time.
        initial, goal: configuration, (n_q), and velocity, (n_v), with everything filled in that the task leaves out.

    Returns:
        ``max_slip_violation`` in m/s, ``max_slip_distance_violation`` in m, ``max_constraint_violation``,
        ``max_goal_violation``, ``max_waypoint_violation`` in m, rad, m/s or rad/s, zero if nothing is violated.
    """
    checks = _Checks(task, robot, physics, motion)
    return {
        "max_slip_violation": largest_violation(checks.slip()),
        "max_slip_distance_violation": largest_violation(checks.slip_distance()),
        "max_constraint_violation": largest_violation(checks.constraints()),
        "max_goal_violation": largest_violation(checks.goal(initial, goal)),
        "max_waypoint_violation": largest_violation(checks.waypoints()),
    }


@singledispatch
def violations(constraint: BodyPoint, point: np.ndarray, ground: Ground) -> Iterator[float]:
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
def _clearance(constraint: Clearance, point: np.ndarray, ground: Ground) -> Iterator[float]:
    yield constraint.distance - float(ground.distance(point))


@violations.register
def _sphere(constraint: AvoidSphere, point: np.ndarray, ground: Ground) -> Iterator[float]:
    yield constraint.radius - float(np.linalg.norm(_offset(point, constraint.center)))


@violations.register
def _box(constraint: AvoidBox, point: np.ndarray, ground: Ground) -> Iterator[float]:
    half = 0.5 * _given(constraint.size)
    yield float(np.min(half - np.abs(_offset(point, constraint.center))))


@violations.register
def _ellipse(constraint: AvoidEllipse, point: np.ndarray, ground: Ground) -> Iterator[float]:
    axes = _given(constraint.semi_axes)
    yield float(np.min(axes) * (1.0 - np.linalg.norm(_offset(point, constraint.center) / axes)))


@violations.register
def _frame_limits(constraint: FrameLimits, point: np.ndarray, ground: Ground) -> Iterator[float]:
    for value, bounds in zip(point, (constraint.x, constraint.y, constraint.z), strict=True):
        if bounds is not None:
            yield float(max(bounds[0] - value, value - bounds[1]))


class _Checks:
    """Violations of one motion; negative where there is room left."""

    def __init__(self, task: Task, robot: Robot, physics: NumericPhysics, motion: PhysicalMotion) -> None:
        self._task, self._robot, self._physics, self._motion = task, robot, physics, motion
        self._ground = physics.scene.surfaces[GROUND]
        self._data = robot.model.createData()
        self._names = list(task.contacts)

    def slip(self) -> Iterator[float]:
        """Yield the tangential velocity, m/s, of every contact that may not slip, at every stage where it touches."""
        bound = [i for i, contact in enumerate(self._task.contacts.values()) if contact.slipping == "forbidden"]
        for k in np.flatnonzero(self._motion.weight > 0) if bound else ():
            velocity = self._motion.velocity[k]
            tangential = tangential_rows(self._physics.contact_jacobian(self._motion.configuration[k]) @ velocity)
            for i in bound:
                if self._motion.force[k, i, 0] > _TOUCHING_FORCE:
                    yield float(abs(tangential[i]))

    def slip_distance(self) -> Iterator[float]:
        """Yield by how much the slides of every contact with a limit, all together, are longer than that, m."""
        limits = {name: c.slipping for name, c in self._task.contacts.items() if isinstance(c.slipping, float)}
        outcomes = contact_outcomes(self._motion, self._physics, self._names) if limits else {}
        for name, limit in limits.items():
            yield outcomes[name].slide_distance - limit

    def constraints(self) -> Iterator[float]:
        """Yield the violation of every constraint at every sample it holds at."""
        for constraint in self._task.constraints.values():
            if isinstance(constraint, BodyPoint):
                for q in self._motion.configuration:
                    point = self._position(q, constraint.frame, constraint.offset)
                    yield from violations(constraint, point, self._ground)
            elif isinstance(constraint, ForbiddenZone):
                yield from self._zone(constraint)
            elif isinstance(constraint, ContactWindow):
                yield from self._window(constraint)

    def _zone(self, zone: ForbiddenZone) -> Iterator[float]:
        i, motion = self._names.index(zone.contact), self._motion
        frame = self._task.contacts[zone.contact].frame
        touching = set(np.flatnonzero(motion.force[:, i, 0] > _TOUCHING_FORCE).tolist())
        touching |= {impact.after for impact in motion.impacts if impact.impulse[i, 0] > _TOUCHING_IMPULSE}
        for k in sorted(touching):
            x = float(self._position(motion.configuration[k], frame)[0])
            yield min(x - zone.x[0], zone.x[1] - x) - _ZONE_TOLERANCE

    def _window(self, window: ContactWindow) -> Iterator[float]:
        motion, (first, last) = self._motion, window.times
        i = self._names.index(window.contact)
        if window.touch == "forbidden":
            inside = (motion.time > first + _SAME_TIME) & (motion.time <= last + _SAME_TIME)
            for q in motion.configuration[inside]:
                yield window.clearance - float(self._physics.gaps(q)[i])
            return
        for time in motion.clock[(motion.clock >= first - _SAME_TIME) & (motion.clock <= last + _SAME_TIME)]:
            q = motion.configuration[self._samples(float(time))[-1]]
            yield float(self._physics.gaps(q)[i]) - window.tolerance

    def goal(self, initial: tuple[np.ndarray, np.ndarray], goal: tuple[np.ndarray, np.ndarray]) -> Iterator[float]:
        """Yield the violations of hard goals, of a period, and of the bounds of a free duration."""
        asked, duration = self._task.goal, self._task.horizon.duration
        q, v = self._motion.configuration[-1], self._motion.velocity[-1]
        if isinstance(duration, FreeDuration):
            yield duration.lower - float(self._motion.clock[-1])
            yield float(self._motion.clock[-1]) - duration.upper
        if asked.periodic is not None:
            q0, v0 = self._motion.configuration[0], self._motion.velocity[0]
            stride = [asked.periodic.stride.get(name, 0.0) for name in self._robot.configuration_names]
            yield from np.abs(q - q0 - stride)
            yield from np.abs(v - v0)
            for i, name in enumerate(self._robot.configuration_names):
                if name in asked.periodic.stride:
                    yield float(abs(q0[i] - initial[0][i]))
        else:
            yield from np.abs(self._motion.configuration[0] - initial[0])
            yield from self._coordinates(asked, goal, q, v)
        yield from self._points(asked, q, v)

    def waypoints(self) -> Iterator[float]:
        """Yield the violations of hard targets of waypoints."""
        intervals, count = len(self._motion.clock), len(self._task.waypoints)
        names, velocities = self._robot.configuration_names, self._robot.velocity_names
        for i, waypoint in enumerate(self._task.waypoints):
            time = waypoint.time
            if time is None:
                time = float(self._motion.clock[round((i + 1) * intervals / (count + 1)) - 1])
            wanted = (
                np.array([waypoint.configuration.get(name, np.nan) for name in names]),
                np.array([waypoint.velocity.get(name, np.nan) for name in velocities]),
            )
            yield min(self._missing(waypoint, wanted, sample) for sample in self._samples(time))

    def _missing(self, waypoint: Waypoint, wanted: tuple[np.ndarray, np.ndarray], sample: int) -> float:
        q, v = self._motion.configuration[sample], self._motion.velocity[sample]
        return largest_violation(
            itertools.chain(self._coordinates(waypoint, wanted, q, v), self._points(waypoint, q, v))
        )

    def _coordinates(
        self, asked: Goal | Waypoint, wanted: tuple[np.ndarray, np.ndarray], q: np.ndarray, v: np.ndarray
    ) -> Iterator[float]:
        groups: list[tuple[Mapping[str, float], Sequence[str], np.ndarray, np.ndarray]] = [
            (asked.tolerance.configuration, self._robot.configuration_names, q, wanted[0]),
            (asked.tolerance.velocity, self._robot.velocity_names, v, wanted[1]),
        ]
        for widths, names, reached, goal in groups:
            for name, width in widths.items():
                i = names.index(name)
                yield float(abs(reached[i] - goal[i])) - width

    def _points(self, asked: Goal | Waypoint, q: np.ndarray, v: np.ndarray) -> Iterator[float]:
        for name, target in asked.frames.items():
            yield from _missed(target, *point_motion(self._robot, q, v, name))
        if asked.center_of_mass is not None:
            yield from _missed(asked.center_of_mass, *point_motion(self._robot, q, v, None))

    def _position(self, q: np.ndarray, frame: str, offset: Sequence[float] = (0.0, 0.0, 0.0)) -> np.ndarray:
        pin.framesForwardKinematics(self._robot.model, self._data, q)
        placement = self._data.oMf[self._robot.frame_id(frame)]
        return np.asarray(placement.act(np.asarray(offset, dtype=float)))

    def _samples(self, time: float) -> list[int]:
        """Indices of the samples at the end of a control interval, two if it is the time of an impact."""
        near = np.flatnonzero(np.abs(self._motion.time - time) <= _SAME_TIME)
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
