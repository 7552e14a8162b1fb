"""The named constraints of a task as trajectory constraints, and forbidden zones as vanishing constraints."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import singledispatch
from typing import Literal

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Complementarity, Label
from fesd_robot.contact import Contact, ContactSystem, Surface
from fesd_robot.errors import ModelError
from fesd_robot.exactness import NO_SQUARE, WRITTEN
from fesd_robot.fesd import Span, TrajectoryConstraint
from fesd_robot.ocp.default_costs import RobotScales
from fesd_robot.ocp.distances import distances_of
from fesd_robot.ocp.parts import ProblemParts
from fesd_robot.ocp.points import AXES, Points
from fesd_robot.task import (
    AvoidBox,
    AvoidEllipse,
    AvoidSphere,
    BodyPoint,
    Clearance,
    ContactWindow,
    DistanceConstraint,
    ForbiddenZone,
    FrameLimits,
    SwingClearance,
    Task,
)

SWING_SPEED = 0.1
"""Speed at which a contact may touch before a swing clearance asks for height, in units of the robot."""

SWING_SPARE = 0.5
"""Part of what the audit spares that a swing clearance may be violated between stages without a refinement."""

BoundedRow = tuple[str, ca.SX, float, float]
"""Name, row, lower and upper bound, m."""


@singledispatch
def point_rows(constraint: BodyPoint, p: ca.SX, ground: Surface) -> list[BoundedRow]:
    """Return the rows of a constraint on the position p of a point, SX (3); all of them are lengths."""
    raise ModelError(f"no rows are known for {type(constraint).__name__}")


@point_rows.register
def _clearance(constraint: Clearance, p: ca.SX, ground: Surface) -> list[BoundedRow]:
    return [("clearance", ground.distance(p) - constraint.distance, 0.0, np.inf)]


@point_rows.register
def _sphere(constraint: AvoidSphere, p: ca.SX, ground: Surface) -> list[BoundedRow]:
    distance = ca.sqrt(ca.sumsqr(_from(constraint.center, p)) + NO_SQUARE)
    return [("distance", distance - constraint.radius, 0.0, np.inf)]


@point_rows.register
def _ellipse(constraint: AvoidEllipse, p: ca.SX, ground: Surface) -> list[BoundedRow]:
    axes = _given(constraint.semi_axes)
    level = ca.sumsqr(_from(constraint.center, p) / ca.DM(axes)) - 1
    return [("level", 0.5 * min(axes) * level, 0.0, np.inf)]  # half the axis: near the surface it is a distance


@point_rows.register
def _box(constraint: AvoidBox, p: ca.SX, ground: Surface) -> list[BoundedRow]:
    half = [0.5 * size for size in _given(constraint.size)]
    power = constraint.power
    mean = ca.sum1((_from(constraint.center, p) / ca.DM(half)) ** power) / len(half)
    return [("level", min(half) * ((mean + NO_SQUARE) ** (1 / power) - 1), 0.0, np.inf)]


@point_rows.register
def _frame_limits(constraint: FrameLimits, p: ca.SX, ground: Surface) -> list[BoundedRow]:
    bounds = [(axis, getattr(constraint, axis)) for axis in AXES]
    return [(axis, p[i], *given) for i, (axis, given) in enumerate(bounds) if given is not None]


def _from(center: Sequence[float | None], p: ca.SX) -> ca.SX:
    """Return p - center along the axes that the centre has."""
    return ca.vertcat(*[p[i] - value for i, value in enumerate(center) if value is not None])


def _given(values: Sequence[float | None]) -> list[float]:
    return [value for value in values if value is not None]


def path_constraints(parts: ProblemParts) -> list[TrajectoryConstraint]:
    """Return the trajectory constraints of all constraints but forbidden zones.

    Those on positions hold at every stage; a forbidden contact has an open gap at every stage of its intervals, a
    required one a closed gap at every end of an interval, from the first time to the last.

    Raises:
        TaskError: a fixed start violates a constraint.
    """
    everywhere: list[BoundedRow] = []
    others: list[TrajectoryConstraint] = []
    for name, constraint in parts.task.constraints.items():
        if isinstance(constraint, BodyPoint | DistanceConstraint):
            rows = _configuration_rows(parts, name, constraint)
            rows = [(f"constraint '{name}', {what}", row, low, high) for what, row, low, high in rows]
            _check_start(parts, name, rows)
            everywhere += [row for row in rows if not row[1].is_constant()]
        elif isinstance(constraint, ContactWindow):
            others += _window(parts, name, constraint)
        elif isinstance(constraint, SwingClearance):
            others.append(_swing(parts, name, constraint))
    if not everywhere:
        return others
    return [*others, _trajectory_constraint(parts, "constraints", "path", parts.grid.everywhere, everywhere)]


def _configuration_rows(
    parts: ProblemParts, name: str, constraint: BodyPoint | DistanceConstraint
) -> Sequence[BoundedRow]:
    """Return the rows of a constraint that is one of the configuration alone."""
    if isinstance(constraint, BodyPoint):
        return point_rows(constraint, parts.points.fixed_to(constraint), parts.ground)
    found = distances_of(name, constraint, parts.points)
    return [(f"distance of {what}", row - constraint.minimum, 0.0, np.inf) for what, row in found]


def with_swing_speeds(task: Task, scales: RobotScales) -> Task:
    """Return the task with a speed for every swing clearance, by default that of the robot's size, three digits."""
    speed = float(f"{SWING_SPEED * scales.of('m/s'):.3g}")
    constraints = {
        name: one.model_copy(update={"speed": speed}) if isinstance(one, SwingClearance) and one.speed is None else one
        for name, one in task.constraints.items()
    }
    return task.model_copy(update={"constraints": constraints})


def _swing(parts: ProblemParts, name: str, swing: SwingClearance) -> TrajectoryConstraint:
    """Return g - h (v_t^2 - c^2) / (v_t^2 + c^2) >= 0 of every contact; at rest it is g + h: stance is no bound."""
    assert swing.speed is not None
    rows: list[BoundedRow] = []
    for contact in parts.contacts:
        if contact.name in swing.contacts:
            square = sum(speed**2 for speed in contact.tangential_velocities(parts.dynamics.velocity))
            slow = swing.speed**2
            row = contact.gap - swing.height * (square - slow) / (square + slow)
            rows.append((f"constraint '{name}', {contact.name}", row, 0.0, np.inf))
    _check_start(parts, name, rows)
    everywhere = _trajectory_constraint(parts, name, "path", parts.grid.everywhere, rows)
    return replace(everywhere, spare=SWING_SPARE * swing.spare)


def _window(parts: ProblemParts, name: str, window: ContactWindow) -> list[TrajectoryConstraint]:
    """Return the constraints on the gap of a contact that must, or must not, touch during some time.

    One that must touch does so where the window begins, and at all ends of intervals from there to its end.
    """
    begin, end = (parts.grid.at_node(time) for time in window.times)
    (gap,) = (contact.gap for contact in parts.contacts if contact.name == window.contact)
    forbidden = window.touch == "forbidden"
    low, high = (window.clearance, np.inf) if forbidden else (-np.inf, window.tolerance)
    rows = [(f"constraint '{name}', gap", gap, low, high)]
    if begin == 0:
        _check_start(parts, name, rows)
    if forbidden:
        return [_trajectory_constraint(parts, name, "path", parts.grid.between(begin, end), rows)]
    places = parts.grid.ends_from(begin, end)
    return [_trajectory_constraint(parts, name, "interval_end", where, rows) for where in places]


def _trajectory_constraint(
    parts: ProblemParts,
    name: str,
    kind: Literal["path", "interval_end"],
    intervals: Sequence[int] | Span,
    rows: Sequence[BoundedRow],
) -> TrajectoryConstraint:
    system = parts.contact_system.system
    at_stage = ca.vertcat(system.state, system.control, system.algebraic)
    return TrajectoryConstraint(
        name,
        kind,
        at_stage if kind == "path" else system.state,
        intervals,
        ca.vertcat(*[row for _, row, _, _ in rows]),
        np.array([low for _, _, low, _ in rows]),
        np.array([high for _, _, _, high in rows]),
        [label for label, _, _, _ in rows],
    )


def _check_start(parts: ProblemParts, name: str, rows: Sequence[BoundedRow]) -> None:
    """Raise if a start that is not free violates the rows of a constraint."""
    if parts.task.goal.periodic is not None:
        return
    symbols = [parts.points.q, parts.points.v]
    values = ca.Function("rows", symbols, [ca.vertcat(*[row for _, row, _, _ in rows])])(
        parts.endpoints.initial_configuration, parts.endpoints.initial_velocity
    )
    violation = max(
        max(low - value, value - high)
        for (_, _, low, high), value in zip(rows, np.asarray(values).ravel().tolist(), strict=True)
    )
    if violation > WRITTEN:
        raise parts.task.error(
            ("constraints", name),
            f"found a start that violates this by {violation:.4g} m, expected a constraint that the initial "
            "configuration satisfies",
        )


def add_forbidden_zones(
    task: Task, contact_system: ContactSystem, contacts: Sequence[Contact], points: Points, start: np.ndarray
) -> ContactSystem:
    """Return the contact system in which no contact pushes inside its forbidden zones.

    max(depth, 0) * (theta_+ + theta_-) = 0 with depth = (x - from)(to - x) / (to - from), or the distance from the only
    end there is: one more vanishing constraint, held like those of the contact logic.

    Raises:
        TaskError: a contact touches inside a zone at the start.
    """
    zones = {name: c for name, c in task.constraints.items() if isinstance(c, ForbiddenZone)}
    if not zones:
        return contact_system
    indices = {contact.name: i for i, contact in enumerate(contacts)}
    conditions = []
    for name, zone in zones.items():
        i = indices[zone.contact]
        position, _ = points.frame(task.single_contacts[zone.contact].touching_frame)
        depth = _depth(zone)(position[0])
        if task.goal.periodic is None:
            at = ca.Function("start", [points.q], [contacts[i].gap, position[0], depth])
            gap, x, inside = (float(value) for value in at(start))
            if gap <= WRITTEN and inside > WRITTEN:
                raise task.error(
                    ("constraints", name),
                    f"found contact '{zone.contact}' touching at x = {x:.4g} m at the start, inside this zone; "
                    "expected a zone where it does not touch at the start",
                )
        label = Label("contact in a zone", name, contact=zone.contact)
        conditions.append(Complementarity(label, depth, contact_system.theta_auxiliary[i].normal, vanishing=True))
    system = contact_system.system
    system = replace(system, complementarities=[*system.complementarities, *conditions])
    return replace(contact_system, system=system)


def _depth(zone: ForbiddenZone) -> Callable[[ca.SX], ca.SX]:
    lower, upper = zone.x
    if math.isinf(lower):
        return lambda x: upper - x
    if math.isinf(upper):
        return lambda x: x - lower
    return lambda x: (x - lower) * (upper - x) / (upper - lower)
