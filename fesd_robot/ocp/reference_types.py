"""The reference motion that a task asks for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicSpline

from fesd_robot.ocp.reference_file import read_motion
from fesd_robot.ocp.reference_motion import DIFFERENCE_STEP, LineMotion, ReferenceMotion
from fesd_robot.ocp.targets import waypoint_times
from fesd_robot.ocp.timing import TimeGrid
from fesd_robot.ocp.vectors import Endpoints, StateLimits
from fesd_robot.orientations import quaternion_entries, quaternion_of, turn_entries, turn_of, unit_entries
from fesd_robot.robot import Robot, continuous_quaternions, interpolated, root_height, slerp
from fesd_robot.task import FromFile, Jumps, Task, ThroughWaypoints

LONGEST_STANCE = 0.8
"""Of a jump, as a fraction of its time, where the free fall would leave more."""

PIECES_OF_A_TURN = 4
"""Cubic polynomials that follow an orientation from one waypoint to the next."""


@dataclass(frozen=True)
class SampledMotion:
    """A motion given as a function of time, with velocities by difference quotients.

    Attributes:
        at: time, s -> configuration, (n_q).
        duration: s.
        knots: times between which a cubic polynomial follows it closely, s, (n).
    """

    robot: Robot
    at: Callable[[float], np.ndarray]
    duration: float
    knots: np.ndarray

    def configuration(self, time: float) -> np.ndarray:
        """Return the configuration at a time, (n_q)."""
        return self.at(time)

    def velocity(self, time: float) -> np.ndarray:
        """Return the velocity consistent with the configuration, (n_v); at a corner that of the motion after it."""
        step = DIFFERENCE_STEP * self.duration
        first = min(time, self.duration - step)
        return np.asarray(pin.difference(self.robot.model, self.at(first), self.at(first + step))) / step


def reference_of(
    task: Task, robot: Robot, endpoints: Endpoints, limits: StateLimits, grid: TimeGrid
) -> ReferenceMotion:
    """Return the task's reference motion.

    Raises:
        TaskError: a reference file that cannot be used.
    """
    reference, duration = task.reference, grid.nominal
    if isinstance(reference, FromFile):
        times, rows = read_motion(task, "reference.path", reference.path, robot)
        if reference.stretch:
            times = (times - times[0]) * duration / max(times[-1] - times[0], 1e-300)
        return SampledMotion(
            robot, lambda time: between(robot, times, rows, time), duration, _few(times, duration, 2 * grid.intervals)
        )
    if isinstance(reference, ThroughWaypoints):
        ends = np.array([0.0, *waypoint_times(task, grid), duration])
        parts = PIECES_OF_A_TURN if unit_entries(robot.configuration_names) else 1
        knots = np.interp(np.linspace(0, 1, 1 + parts * (len(ends) - 1)), np.linspace(0, 1, len(ends)), ends)
        return SampledMotion(robot, _splines(task, robot, endpoints, limits, grid), duration, knots)
    jumps = reference if isinstance(reference, Jumps) else None
    return LineMotion(
        robot=robot,
        duration=duration,
        start=endpoints.initial_configuration,
        goal=endpoints.goal_configuration,
        count=jumps.count if jumps else 1,
        apex=jumps.apex if jumps else {},
        stance=_stance(jumps, robot, endpoints, duration / jumps.count) if jumps else 0.0,
    )


def _stance(jumps: Jumps, robot: Robot, endpoints: Endpoints, duration: float) -> float:
    """Return the part of a jump's duration T, s, that a free fall from its apex leaves, 1 - 2 sqrt(2 h / g) / T."""
    gravity = float(np.linalg.norm(robot.model.gravity.linear))
    height = root_height(list(jumps.apex))
    if jumps.stance is not None or height is None or gravity == 0:
        return jumps.stance or 0.0
    takeoff = endpoints.initial_configuration[robot.configuration_names.index(height)]
    rise = max(jumps.apex[height] - takeoff, 0.0)
    return float(np.clip(1.0 - 2.0 * np.sqrt(2.0 * rise / gravity) / duration, 0.0, LONGEST_STANCE))


def _few(times: np.ndarray, duration: float, most: int) -> np.ndarray:
    """Return the times between the start and the end, or equally spaced ones where there are too many."""
    inside = times[(times > 0) & (times < duration)]
    return np.unique([0.0, *inside, duration]) if len(inside) < most else np.linspace(0.0, duration, 1 + most)


def between(robot: Robot, times: np.ndarray, rows: np.ndarray, time: float) -> np.ndarray:
    """Interpolate the rows on the configuration manifold; before the first and after the last they hold still."""
    after = int(np.clip(np.searchsorted(times, time, side="right"), 1, len(times) - 1)) if len(times) > 1 else 0
    if after == 0:
        return np.array(rows[0])
    fraction = float(np.clip((time - times[after - 1]) / (times[after] - times[after - 1]), 0.0, 1.0))
    return interpolated(robot, rows[after - 1], rows[after], fraction)


@dataclass(frozen=True)
class _Turning:
    """An orientation that turns evenly from each of its values to the next.

    Attributes:
        at: entries of the quaternion in q.
        times: s, increasing, (k); values: quaternions, (k, 4).
    """

    at: slice
    times: np.ndarray
    values: np.ndarray

    def __call__(self, time: float) -> np.ndarray:
        """Return the quaternion at a time, (4)."""
        after = int(np.clip(np.searchsorted(self.times, time, side="right"), 1, len(self.times) - 1))
        first, last = self.times[after - 1], self.times[after]
        fraction = float(np.clip((time - first) / (last - first), 0.0, 1.0))
        return slerp(self.values[after - 1], self.values[after], fraction)


def _turning(
    at: slice,
    names: Sequence[str],
    ends: tuple[float, np.ndarray, np.ndarray],
    passing: Sequence[tuple[float, Mapping[str, float]]],
) -> _Turning:
    """Return how an orientation turns through the waypoints that give it.

    Args:
        at, names: of its quaternion's entries in q.
        ends: duration, s, quaternion at the start and at the end.
        passing: time, s, and values of every waypoint.
    """
    duration, start, goal = ends
    passed = [(time, [given[name] for name in names]) for time, given in passing if names[0] in given]
    times, values = zip((0.0, start), *passed, (duration, goal), strict=True)
    return _Turning(at, np.array(times), continuous_quaternions(np.array(values)))


def _circling(
    names: Sequence[str],
    at: slice,
    ends: tuple[np.ndarray, np.ndarray],
    slopes: Sequence[np.ndarray],
    passing: Sequence[tuple[float, Mapping[str, float]]],
    duration: float,
) -> CubicSpline:
    """Return the cubic spline of the angle of a joint without limits, rad, from each value the short way to the next.

    Args:
        names, at: of its cosine and sine, and their entries in q.
        ends: q at the start and at the end, (n_q).
        slopes: dq/dt there, (n_q) each.
        passing: time, s, and values of every waypoint.
        duration: s.
    """
    passed = [(time, [given[name] for name in names]) for time, given in passing if names[0] in given]
    times, pairs = zip((0.0, ends[0][at]), *passed, (duration, ends[1][at]), strict=True)
    angles = np.unwrap([np.arctan2(sine, cosine) for cosine, sine in pairs])
    rates = [float(q[at][0] * slope[at][1] - q[at][1] * slope[at][0]) for q, slope in zip(ends, slopes, strict=True)]
    return CubicSpline(times, angles, bc_type=((1, rates[0]), (1, rates[1])))


def _splines(
    task: Task, robot: Robot, endpoints: Endpoints, limits: StateLimits, grid: TimeGrid
) -> Callable[[float], np.ndarray]:
    """Return the cubic spline of every coordinate through the waypoints that give it, moved into its limits.

    Its ends have the slopes of the initial and the goal velocity. Orientations turn evenly from one to the next.
    """
    start, goal, model = endpoints.initial_configuration, endpoints.goal_configuration, robot.model
    slopes = [
        (np.asarray(pin.integrate(model, q, DIFFERENCE_STEP * v)) - q) / DIFFERENCE_STEP
        for q, v in ((start, endpoints.initial_velocity), (goal, endpoints.goal_velocity))
    ]
    passing = list(zip(waypoint_times(task, grid), (each.configuration for each in task.waypoints), strict=True))
    turns = [
        _turning(at, quaternion_of(joint), (grid.nominal, start[at], goal[at]), passing)
        for joint, at in quaternion_entries(robot.configuration_names).items()
    ]
    splines = []
    for i, name in enumerate(robot.configuration_names):
        passed = [(t, given[name]) for t, given in passing if name in given]
        times, values = zip((0.0, start[i]), *passed, (grid.nominal, goal[i]), strict=True)
        splines.append(CubicSpline(times, values, bc_type=((1, slopes[0][i]), (1, slopes[1][i]))))

    circles = {
        joint: _circling(turn_of(joint), at, (start, goal), slopes, passing, grid.nominal)
        for joint, at in turn_entries(robot.configuration_names).items()
    }
    entries = turn_entries(robot.configuration_names)

    def at(time: float) -> np.ndarray:
        values = np.array([float(spline(time)) for spline in splines])
        for joint, circle in circles.items():
            angle = float(circle(time))
            values[entries[joint]] = np.cos(angle), np.sin(angle)
        for turn in turns:
            values[turn.at] = turn(time)
        return np.asarray(pin.normalize(model, np.clip(values, limits.lower_position, limits.upper_position)))

    return at
