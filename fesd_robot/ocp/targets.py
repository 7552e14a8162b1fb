"""Goals and waypoints as rows and costs at the end of a control interval."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import cast

import casadi as ca
import numpy as np

from fesd_robot.fesd import Span, TrajectoryConstraint
from fesd_robot.ocp.constants import GOAL_CONFIGURATION
from fesd_robot.ocp.parts import ProblemParts
from fesd_robot.ocp.points import AXES
from fesd_robot.ocp.reach import check_reach
from fesd_robot.ocp.timing import TimeGrid
from fesd_robot.orientations import COSINE_AND_SINE, QUATERNION, angles_of, deviation_names
from fesd_robot.robot import deviation
from fesd_robot.running import Identity
from fesd_robot.task import Goal, KeyPath, PointTarget, Task, Waypoint

CENTER_OF_MASS = "center of mass"

GOAL = "goal"
"""Name of the constraint that holds the goals of points and orientations."""


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

    def constraint(self, name: str, parts: ProblemParts, intervals: Sequence[int] | Span) -> TrajectoryConstraint:
        width = np.array(self.width)
        rows = ca.vertcat(ca.SX(0, 1), *self.rows)
        parameters = parts.constants.used_in(rows, *self.cost.values())
        return TrajectoryConstraint(
            name,
            "interval_end",
            parts.contact_system.system.state,
            intervals,
            rows,
            -width,
            width,
            self.names,
            self.cost,
            parameters,
            parts.values_of(parameters),
        )


def target_constraints(parts: ProblemParts) -> list[TrajectoryConstraint]:
    """Return a constraint for the goals of frames, the centre of mass and orientations, and one for every waypoint."""
    task, grid, constraints = parts.task, parts.grid, list[TrajectoryConstraint]()
    rows = _Rows()
    if task.goal.has_points:
        _add_points(rows, ("goal",), "goal: ", task.goal, parts)
    _add_orientations(rows, parts)
    if rows.rows or rows.cost:
        constraints.append(rows.constraint(GOAL, parts, grid.between(grid.nominal, grid.nominal)))
    for i, (waypoint, time) in enumerate(zip(task.waypoints, waypoint_times(task, grid), strict=True)):
        rows, name, key = _Rows(), f"waypoint {i + 1}", ("waypoints", str(i))
        _add_coordinates(rows, name, key, waypoint, parts)
        _add_points(rows, key, "", waypoint, parts, cost=name)
        if rows.rows or rows.cost:
            constraints.append(rows.constraint(name, parts, grid.between(time, time)))
    return constraints


def check_targets(parts: ProblemParts, constraints: Iterable[TrajectoryConstraint]) -> None:
    """Raise if a point cannot get to where it should be, or the goal's configuration puts it elsewhere.

    Args:
        constraints: of the problem, the targets' among them.

    Raises:
        TaskError: at the goal or waypoint.
    """
    task = parts.task
    targets: list[tuple[KeyPath, Goal | Waypoint]] = [(("goal",), task.goal)]
    targets += [(("waypoints", str(i)), waypoint) for i, waypoint in enumerate(task.waypoints)]
    for key, target in targets:
        for name, point in target.frames.items():
            check_reach(parts.points, name, point, (*key, "frames", name, "position"))
        if target.center_of_mass is not None:
            check_reach(parts.points, None, target.center_of_mass, (*key, "center_of_mass", "position"))
    for constraint in constraints:
        if constraint.name == GOAL and task.goal.has_points:
            _check_agreement(constraint, parts)


def _add_orientations(rows: _Rows, parts: ProblemParts) -> None:
    """Bound log(R_goal^T R) of orientations that have a tolerance; other coordinates are bounds of the last state."""
    points, widths = parts.points, parts.task.goal.tolerance.configuration
    names = points.robot.configuration_names
    turns = {name for name in deviation_names(names) if name not in names and name in widths}
    if turns:
        goal = parts.constants.goal(GOAL_CONFIGURATION, len(names))
        from_goal = ca.vertsplit(deviation(names, points.q, goal))
        for name, row in zip(deviation_names(names), from_goal, strict=True):
            if name in turns:
                rows.bound(row, widths[name], f"goal: {name}")


def _check_agreement(constraint: TrajectoryConstraint, parts: ProblemParts) -> None:
    """Raise if the goal's configuration puts a point elsewhere than the point's own goal, beyond both tolerances.

    Raises:
        TaskError: at the goal, with the point and how far it would be from its goal.
    """
    points, goal = parts.points, parts.task.goal
    names = points.robot.configuration_names
    q = ca.DM([goal.configuration.get(name, np.nan) for name in names])
    widths = np.array([_width(goal.tolerance.configuration, name) for name in names])
    at_goal = _rows_of_configuration(Identity(constraint.rows, points.q, points.v, constraint.parameters))
    values, slopes, of_velocity = (
        np.asarray(part.full()) for part in at_goal(q, parts.values_of(constraint.parameters))
    )
    for i, (width, name) in enumerate(zip(constraint.upper, constraint.row_names, strict=True)):
        if of_velocity[i]:
            continue
        slope = slopes[i]
        allowed = width + float(np.abs(slope[slope != 0]) @ widths[slope != 0])
        if abs(float(values[i, 0])) > allowed:  # not so where it depends on a coordinate without a goal, which is NaN
            raise parts.task.error(
                "goal.configuration",
                f"found a configuration in which '{name}' is {abs(float(values[i, 0])):.4g} m from its own goal, "
                f"expected at most {allowed:.4g} m or one of the two",
            )


@lru_cache
def _rows_of_configuration(parts: Identity) -> ca.Function:
    """Return (q, p) -> rows at rest, their slopes in q, and whether each depends on the velocity.

    Args:
        parts: rows, q, v and p, SX.
    """
    rows, q, v, p = cast(tuple[ca.SX, ca.SX, ca.SX, ca.SX], parts.parts)
    of_velocity = [float(ca.depends_on(rows[i], v)) for i in range(rows.numel())]
    still = ca.substitute(rows, v, ca.SX.zeros(v.numel()))
    return ca.Function("rows", [q, p], [still, ca.densify(ca.jacobian(still, q)), ca.DM(of_velocity)])


def _width(widths: Mapping[str, float], name: str) -> float:
    """Return by how much an entry of q may miss the goal: of a quaternion half the angle that is allowed."""
    joint, dot, suffix = name.rpartition(".")
    if dot + suffix in QUATERNION:
        return float(np.linalg.norm([widths.get(angle, np.inf) for angle in angles_of(joint)])) / 2
    return widths.get(joint if dot + suffix in COSINE_AND_SINE else name, np.inf)


def waypoint_times(task: Task, grid: TimeGrid) -> list[float]:
    """Return the time of every waypoint, s of the nominal duration: an end of an interval where these stand still.

    Those without a time are evenly spread over such ends.
    """
    count, length = len(task.waypoints), grid.nominal / grid.intervals
    return [
        round((i + 1) * grid.intervals / (count + 1)) * length if waypoint.time is None else grid.at_node(waypoint.time)
        for i, waypoint in enumerate(task.waypoints)
    ]


def _add_coordinates(rows: _Rows, cost: str, key: KeyPath, waypoint: Waypoint, parts: ProblemParts) -> None:
    points, tolerance = parts.points, waypoint.tolerance
    names, velocities = points.robot.configuration_names, points.robot.velocity_names

    def symbol(what: str, name: str, given: Iterable[str]) -> ca.SX:
        one = (*key, what, name)
        return parts.constants[one] if name in given else ca.SX(np.nan)

    wanted = ca.vertcat(*[symbol("configuration", name, waypoint.configuration) for name in names])
    wanted_velocity = ca.vertcat(*[symbol("velocity", name, waypoint.velocity) for name in velocities])
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
    rows: _Rows, key: KeyPath, prefix: str, target: Goal | Waypoint, parts: ProblemParts, cost: str | None = None
) -> None:
    for name, point in target.frames.items():
        motion = parts.points.frame(name)
        _add_point(rows, (*key, "frames", name), point, motion, parts, (f"{prefix}{name}", cost))
    if target.center_of_mass is not None:
        at = (*key, "center_of_mass")
        motion = parts.points.center_of_mass(at)
        _add_point(rows, at, target.center_of_mass, motion, parts, (f"{prefix}{CENTER_OF_MASS}", cost))


def _add_point(
    rows: _Rows,
    key: KeyPath,
    target: PointTarget,
    motion: tuple[ca.SX, ca.SX],
    parts: ProblemParts,
    names: tuple[str, str | None],
) -> None:
    """Add rows and costs of a point.

    Args:
        key: of the target.
        motion: position and velocity of the point.
        names: of the rows and of the cost; without one the cost has that of the rows.
    """
    groups = [
        (target.position, motion[0], target.tolerance, target.weight, "position", "m"),
        (target.velocity, motion[1], target.velocity_tolerance, target.velocity_weight, "velocity", "m/s"),
    ]
    for wanted, value, width, weight, kind, unit in groups:
        for i, axis in enumerate(AXES):
            goal = None if wanted is None else wanted[i]
            if goal is None:
                continue
            number = (*key, kind, axis)
            miss = value[i] - parts.constants[number]
            rows.add_cost(names[1] or names[0], weight, miss**2)
            if width is None:
                continue
            if not value[i].is_constant():
                rows.bound(miss, width, f"{names[0]} {axis} {kind}")
            elif abs(float(value[i]) - goal) > width:
                raise parts.task.error(
                    (*key, kind),
                    f"found {goal:g} {unit} along {axis}, where it always is {float(value[i]):g} {unit}; expected null "
                    "for an axis along which it cannot move",
                )
