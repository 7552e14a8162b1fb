"""The named constraints of a task as rows at the stages, rows at ends of intervals, and exclusions."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import singledispatch

import casadi as ca
import numpy as np

from fesd_robot.complementarity import Complementarity, Label
from fesd_robot.contact import ContactSystem, Ground, PlanarContact
from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd import TrajectoryConstraint
from fesd_robot.ocp.points import AXES, Points
from fesd_robot.ocp.timing import TimeGrid
from fesd_robot.task import (
    AvoidBox,
    AvoidEllipse,
    AvoidSphere,
    BodyPoint,
    Clearance,
    ContactWindow,
    ForbiddenZone,
    FrameLimits,
    PointConstraint,
    Task,
)

_ROUNDED = 1e-12
"""Keeps roots differentiable at zero: added to a sum of squares or higher powers, m2 or without unit."""

_VIOLATED = 1e-6
"""m; a start that violates a constraint by less is on its boundary, rounded."""

Bounded = tuple[str, ca.SX, float, float]
"""Name, row, lower and upper bound, m."""


@singledispatch
def point_rows(constraint: PointConstraint, p: ca.SX, ground: Ground) -> list[Bounded]:
    """Return the rows of a constraint on the position p of a point, SX (3); all of them are lengths."""
    raise TypeError(f"no rows are known for {type(constraint).__name__}")


@point_rows.register
def _clearance(constraint: Clearance, p: ca.SX, ground: Ground) -> list[Bounded]:
    return [("clearance", ground.distance(p) - constraint.distance, 0.0, np.inf)]


@point_rows.register
def _sphere(constraint: AvoidSphere, p: ca.SX, ground: Ground) -> list[Bounded]:
    distance = ca.sqrt(ca.sumsqr(_from(constraint.center, p)) + _ROUNDED)
    return [("distance", distance - constraint.radius, 0.0, np.inf)]


@point_rows.register
def _ellipse(constraint: AvoidEllipse, p: ca.SX, ground: Ground) -> list[Bounded]:
    axes = _given(constraint.semi_axes)
    level = ca.sumsqr(_from(constraint.center, p) / ca.DM(axes)) - 1
    return [("level", 0.5 * min(axes) * level, 0.0, np.inf)]  # half the axis: near the surface it is a distance


@point_rows.register
def _box(constraint: AvoidBox, p: ca.SX, ground: Ground) -> list[Bounded]:
    half = [0.5 * size for size in _given(constraint.size)]
    power = constraint.power
    mean = ca.sum1((_from(constraint.center, p) / ca.DM(half)) ** power) / len(half)
    return [("level", min(half) * ((mean + _ROUNDED) ** (1 / power) - 1), 0.0, np.inf)]


@point_rows.register
def _frame_limits(constraint: FrameLimits, p: ca.SX, ground: Ground) -> list[Bounded]:
    bounds = [(axis, getattr(constraint, axis)) for axis in AXES]
    return [(axis, p[i], *given) for i, (axis, given) in enumerate(bounds) if given is not None]


def _from(center: Sequence[float | None], p: ca.SX) -> ca.SX:
    """p - center along the axes that the centre has."""
    return ca.vertcat(*[p[i] - value for i, value in enumerate(center) if value is not None])


def _given(values: Sequence[float | None]) -> list[float]:
    return [value for value in values if value is not None]


def path_constraints(
    task: Task,
    system: ComplementaritySystem,
    points: Points,
    contacts: Sequence[PlanarContact],
    ground: Ground,
    grid: TimeGrid,
    start: np.ndarray,
) -> list[TrajectoryConstraint]:
    """Return the conditions of all constraints but forbidden zones.

    Those on positions are held at every stage; a forbidden contact has an open gap at every stage of its intervals, a
    required one a closed gap at every end of an interval, from the first time to the last.

    Args:
        start: initial configuration; a fixed one has to satisfy the constraints.

    Raises:
        TaskError: the start violates a constraint.
    """
    variables = ca.vertcat(system.state, system.control, system.algebraic)
    fixed = task.goal.periodic is None
    gaps = {contact.name: contact.gap for contact in contacts}
    held: list[Bounded] = []
    found: list[TrajectoryConstraint] = []
    for name, constraint in task.constraints.items():
        if isinstance(constraint, BodyPoint):
            rows = point_rows(constraint, points.fixed_to(constraint), ground)
            rows = [(f"constraint '{name}', {what}", row, low, high) for what, row, low, high in rows]
            if fixed:
                _check_start(task, name, points, rows, start)
            held += [row for row in rows if not row[1].is_constant()]
        elif isinstance(constraint, ContactWindow):
            first, last = (grid.node(time) for time in constraint.times)
            gap, label = gaps[constraint.contact], f"constraint '{name}', gap"
            forbidden = constraint.touch == "forbidden"
            low, high = (constraint.clearance, np.inf) if forbidden else (-np.inf, constraint.tolerance)
            if first == 0 and fixed:
                _check_start(task, name, points, [(label, gap, low, high)], start)
            intervals = range(first, last) if forbidden else range(max(first, 1) - 1, last)
            found.append(
                _condition(
                    name,
                    [(label, gap, low, high)],
                    variables if forbidden else system.state,
                    intervals,
                    stages=forbidden,
                )
            )
    if held:
        found.append(_condition("constraints", held, variables, range(grid.intervals), stages=True))
    return found


def _condition(
    name: str, rows: Sequence[Bounded], variables: ca.SX, intervals: Sequence[int], *, stages: bool
) -> TrajectoryConstraint:
    return TrajectoryConstraint(
        name,
        "path" if stages else "interval_end",
        variables,
        intervals,
        ca.vertcat(*[row for _, row, _, _ in rows]),
        np.array([low for _, _, low, _ in rows]),
        np.array([high for _, _, _, high in rows]),
        [label for label, _, _, _ in rows],
    )


def _check_start(task: Task, name: str, points: Points, rows: Sequence[Bounded], start: np.ndarray) -> None:
    values = ca.Function("rows", [points.q], [ca.vertcat(*[row for _, row, _, _ in rows])])(start)
    violation = max(
        max(low - value, value - high)
        for (_, _, low, high), value in zip(rows, np.asarray(values).ravel().tolist(), strict=True)
    )
    if violation > _VIOLATED:
        raise task.error(
            ("constraints", name),
            f"found a start that violates this by {violation:.4g} m, expected a constraint that the initial "
            "configuration satisfies",
        )


def add_forbidden_zones(
    task: Task, contact_system: ContactSystem, contacts: Sequence[PlanarContact], points: Points, start: np.ndarray
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
        position, _ = points.frame(task.contacts[zone.contact].frame)
        depth = _depth(zone)(position[0])
        if task.goal.periodic is None:
            at = ca.Function("start", [points.q], [contacts[i].gap, position[0], depth])
            gap, x, inside = (float(value) for value in at(start))
            if gap <= _VIOLATED and inside > _VIOLATED:
                raise task.error(
                    ("constraints", name),
                    f"found contact '{zone.contact}' touching at x = {x:.4g} m at the start, inside this zone; "
                    "expected a zone where it does not touch at the start",
                )
        plus, minus = contact_system.theta_auxiliary[i]
        label = Label(f"contact in zone '{name}'", zone.contact, contact=zone.contact)
        conditions.append(Complementarity(label, depth, plus + minus, vanishing=True))
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
