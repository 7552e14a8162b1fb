"""Goals and waypoints as rows and costs at the end of a control interval."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from fesd_robot.fesd import TrajectoryConstraint
from fesd_robot.ocp.points import AXES, Points
from fesd_robot.ocp.reach import check_reach
from fesd_robot.ocp.timing import TimeGrid
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

    def constraint(self, name: str, state: ca.SX, interval: int) -> TrajectoryConstraint:
        width = np.array(self.width)
        rows = ca.vertcat(ca.SX(0, 1), *self.rows)
        return TrajectoryConstraint(
            name, "interval_end", state, (interval,), rows, -width, width, self.names, self.cost
        )


def target_constraints(task: Task, points: Points, state: ca.SX, grid: TimeGrid) -> list[TrajectoryConstraint]:
    """Return a constraint for the goals of frames and the centre of mass, and one for every waypoint.

    Args:
        state: x, SX symbols, beginning with the configuration and velocity of `points`.

    Raises:
        TaskError: a frame cannot get to its target.
    """
    constraints = []
    if task.goal.has_points:
        rows = _Rows()
        _add_points(rows, ("goal",), "goal: ", task.goal, points)
        _check_agreement(rows, task, points)
        constraints.append(rows.constraint("goal", state, grid.intervals - 1))
    for i, (waypoint, end) in enumerate(zip(task.waypoints, waypoint_ends(task, grid), strict=True)):
        rows, name = _Rows(), f"waypoint {i + 1}"
        _add_coordinates(rows, name, waypoint, points)
        _add_points(rows, ("waypoints", str(i)), "", waypoint, points, cost=name)
        constraints.append(rows.constraint(name, state, end - 1))
    return constraints


def _check_agreement(rows: _Rows, task: Task, points: Points) -> None:
    """Raise if the goal's configuration puts a point elsewhere than the point's own goal, beyond both tolerances.

    Raises:
        TaskError: at the goal, with the point and how far it would be from its goal.
    """
    goal, names = task.goal, points.robot.configuration_names
    q = ca.DM([goal.configuration.get(name, np.nan) for name in names])
    widths = np.array([goal.tolerance.configuration.get(name, np.inf) for name in names])
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


def waypoint_ends(task: Task, grid: TimeGrid) -> list[int]:
    """Return for every waypoint the number of intervals that lie before it; evenly spread if none has a time."""
    count = len(task.waypoints)
    return [
        round((i + 1) * grid.intervals / (count + 1)) if waypoint.time is None else grid.node(waypoint.time)
        for i, waypoint in enumerate(task.waypoints)
    ]


def _add_coordinates(rows: _Rows, cost: str, waypoint: Waypoint, points: Points) -> None:
    robot, tolerance = points.robot, waypoint.tolerance
    groups: list[tuple[ca.SX, list[str], Mapping[str, float], Mapping[str, float], float, str]] = [
        (points.q, robot.configuration_names, waypoint.configuration, tolerance.configuration, waypoint.weight, ""),
        (points.v, robot.velocity_names, waypoint.velocity, tolerance.velocity, waypoint.velocity_weight, " velocity"),
    ]
    for symbols, names, wanted, widths, weight, kind in groups:
        for name, value in wanted.items():
            deviation = symbols[names.index(name)] - value
            rows.add_cost(cost, weight, deviation**2)
            if name in widths:
                rows.bound(deviation, widths[name], name + kind)


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
            deviation = value[i] - goal
            rows.add_cost(cost or name, weight, deviation**2)
            if width is None:
                continue
            if not deviation.is_constant():
                rows.bound(deviation, width, f"{name} {axis} {kind}")
            elif abs(float(deviation)) > width:
                points, key = where
                raise points.task.error(
                    (*key, kind),
                    f"found {goal:g} {unit} along {axis}, where it always is {float(value[i]):g} {unit}; expected null "
                    "for an axis along which it cannot move",
                )
