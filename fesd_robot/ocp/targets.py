"""Goals and waypoints as rows and costs at the end of a control interval."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from fesd_robot.fesd import Span, TrajectoryConstraint
from fesd_robot.ocp.points import AXES, Points
from fesd_robot.ocp.reach import check_reach
from fesd_robot.ocp.timing import TimeGrid
from fesd_robot.orientations import QUATERNION, angles_of, deviation_names
from fesd_robot.robot import deviation
from fesd_robot.task import Goal, PointTarget, Task, Waypoint

CENTER_OF_MASS = "center of mass"


@dataclass
class _Rows:
    """Rows that are within `width` of zero, and a cost, collected one by one."""

    rows: list[ca.SX] = field(default_factory=list)
    width: list[float] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    cost: dict[str, ca.SX] = field(default_factory=dict)

    def bound(self, row: ca.SX, width: float, name: str) -> None:
        self.rows.append(row)
        self.width.append(width)
        self.names.append(name)

    def add_cost(self, name: str, weight: float, square: ca.SX) -> None:
        if weight:
            self.cost[name] = self.cost.get(name, ca.SX(0)) + weight * square

    def constraint(self, name: str, state: ca.SX, intervals: Sequence[int] | Span) -> TrajectoryConstraint:
        width = np.array(self.width)
        rows = ca.vertcat(ca.SX(0, 1), *self.rows)
        return TrajectoryConstraint(name, "interval_end", state, intervals, rows, -width, width, self.names, self.cost)


def target_constraints(
    task: Task, points: Points, state: ca.SX, grid: TimeGrid, goal: np.ndarray
) -> list[TrajectoryConstraint]:
    """Return a constraint for the goals of frames, the centre of mass and orientations, and one for every waypoint.

    Args:
        state: x, SX symbols, beginning with the configuration and velocity of `points`.
        goal: the whole goal configuration, (n_q).

    Raises:
        TaskError: a frame cannot get to its target.
    """
    constraints = []
    rows = _Rows()
    if task.goal.has_points:
        _add_points(rows, ("goal",), "goal: ", task.goal, points)
        _check_agreement(rows, task, points)
    _add_orientations(rows, task, points, goal)
    if rows.rows or rows.cost:
        constraints.append(rows.constraint("goal", state, grid.between(grid.nominal, grid.nominal)))
    for i, (waypoint, time) in enumerate(zip(task.waypoints, waypoint_times(task, grid), strict=True)):
        rows, name = _Rows(), f"waypoint {i + 1}"
        _add_coordinates(rows, name, waypoint, points)
        _add_points(rows, ("waypoints", str(i)), "", waypoint, points, cost=name)
        if rows.rows or rows.cost:
            constraints.append(rows.constraint(name, state, grid.between(time, time)))
    return constraints


def _add_orientations(rows: _Rows, task: Task, points: Points, goal: np.ndarray) -> None:
    """Bound log(R_goal^T R) of orientations that have a tolerance; other coordinates are bounds of the last state."""
    names, widths = points.robot.configuration_names, task.goal.tolerance.configuration
    turns = {name for name in deviation_names(names) if name not in names and name in widths}
    if turns:
        from_goal = ca.vertsplit(deviation(names, points.q, ca.SX(ca.DM(goal))))
        for name, row in zip(deviation_names(names), from_goal, strict=True):
            if name in turns:
                rows.bound(row, widths[name], f"goal: {name}")


def _check_agreement(rows: _Rows, task: Task, points: Points) -> None:
    """Raise if the goal's configuration puts a point elsewhere than the point's own goal, beyond both tolerances.

    Raises:
        TaskError: at the goal, with the point and how far it would be from its goal.
    """
    goal, names = task.goal, points.robot.configuration_names
    q = ca.DM([goal.configuration.get(name, np.nan) for name in names])
    widths = np.array([_width(goal.tolerance.configuration, name) for name in names])
    for row, width, name in zip(rows.rows, rows.width, rows.names, strict=True):
        if ca.depends_on(row, points.v):
            continue
        at_goal = ca.Function("row", [points.q], [row, ca.densify(ca.jacobian(row, points.q))])
        value, slope = (np.asarray(each).ravel() for each in at_goal(q))
        allowed = width + float(np.abs(slope[slope != 0]) @ widths[slope != 0])
        if abs(float(value[0])) > allowed:  # not so where it depends on a coordinate without a goal, which is NaN
            raise task.error(
                "goal.configuration",
                f"found a configuration in which '{name}' is {abs(float(value[0])):.4g} m from its own goal, expected "
                f"at most {allowed:.4g} m or one of the two",
            )


def _width(widths: Mapping[str, float], name: str) -> float:
    """Return by how much an entry of q may miss the goal: of a quaternion half the angle that is allowed."""
    joint, dot, suffix = name.rpartition(".")
    if dot + suffix in QUATERNION:
        return float(np.linalg.norm([widths.get(angle, np.inf) for angle in angles_of(joint)])) / 2
    return widths.get(name, np.inf)


def waypoint_times(task: Task, grid: TimeGrid) -> list[float]:
    """Return the time of every waypoint, s of the nominal duration: an end of an interval where these stand still.

    Those without a time are evenly spread over such ends.
    """
    count, length = len(task.waypoints), grid.nominal / grid.intervals
    return [
        round((i + 1) * grid.intervals / (count + 1)) * length if waypoint.time is None else grid.at_node(waypoint.time)
        for i, waypoint in enumerate(task.waypoints)
    ]


def _add_coordinates(rows: _Rows, cost: str, waypoint: Waypoint, points: Points) -> None:
    robot, tolerance = points.robot, waypoint.tolerance
    names, velocities = robot.configuration_names, robot.velocity_names
    wanted = ca.SX(ca.DM([waypoint.configuration.get(name, np.nan) for name in names]))
    wanted_velocity = ca.SX(ca.DM([waypoint.velocity.get(name, np.nan) for name in velocities]))
    from_wanted = dict(zip(deviation_names(names), ca.vertsplit(deviation(names, points.q, wanted)), strict=True))
    too_fast = dict(zip(velocities, ca.vertsplit(points.v - wanted_velocity), strict=True))
    listed = deviation_names(waypoint.configuration)
    groups: list[tuple[dict[str, ca.SX], Iterable[str], Mapping[str, float], float, str]] = [
        (from_wanted, listed, tolerance.configuration, waypoint.weight, ""),
        (too_fast, waypoint.velocity, tolerance.velocity, waypoint.velocity_weight, " velocity"),
    ]
    for deviations, given, widths, weight, kind in groups:
        for name in given:
            rows.add_cost(cost, weight, deviations[name] ** 2)
            if name in widths:
                rows.bound(deviations[name], widths[name], name + kind)


def _add_points(
    rows: _Rows, key: tuple[str, ...], prefix: str, target: Goal | Waypoint, points: Points, cost: str | None = None
) -> None:
    for name, point in target.frames.items():
        at = (*key, "frames", name)
        check_reach(points, name, point, (*at, "position"))
        _add_point(rows, point, points.frame(name), f"{prefix}{name}", cost, (points, at))
    if target.center_of_mass is not None:
        at = (*key, "center_of_mass")
        symbols = points.center_of_mass(at)
        check_reach(points, None, target.center_of_mass, (*at, "position"))
        _add_point(rows, target.center_of_mass, symbols, f"{prefix}{CENTER_OF_MASS}", cost, (points, at))


def _add_point(
    rows: _Rows,
    target: PointTarget,
    motion: tuple[ca.SX, ca.SX],
    name: str,
    cost: str | None,
    where: tuple[Points, tuple[str, ...]],
) -> None:
    groups = [
        (target.position, motion[0], target.tolerance, target.weight, "position", "m"),
        (target.velocity, motion[1], target.velocity_tolerance, target.velocity_weight, "velocity", "m/s"),
    ]
    for wanted, value, width, weight, kind, unit in groups:
        for i, axis in enumerate(AXES):
            goal = None if wanted is None else wanted[i]
            if goal is None:
                continue
            miss = value[i] - goal
            rows.add_cost(cost or name, weight, miss**2)
            if width is None:
                continue
            if not miss.is_constant():
                rows.bound(miss, width, f"{name} {axis} {kind}")
            elif abs(float(miss)) > width:
                points, key = where
                raise points.task.error(
                    (*key, kind),
                    f"found {goal:g} {unit} along {axis}, where it always is {float(value[i]):g} {unit}; expected null "
                    "for an axis along which it cannot move",
                )
