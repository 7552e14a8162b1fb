"""Goals of points, waypoints, references, further costs and constraints of a task in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from fesd_robot.ocp import MotionProblem
from fesd_robot.ocp.targets import waypoint_ends
from fesd_robot.task import (
    AvoidBox,
    AvoidEllipse,
    AvoidSphere,
    BodyPoint,
    Clearance,
    Constraint,
    ContactWindow,
    Costs,
    ForbiddenZone,
    FrameLimits,
    FromFile,
    Goal,
    Jumps,
    PointTarget,
    Reference,
    Task,
    ThroughWaypoints,
    Waypoint,
)


def described_points(target: Goal | Waypoint) -> list[str]:
    """Return a sentence for each goal of a frame or of the centre of mass."""
    points = dict(target.frames)
    if target.center_of_mass is not None:
        points["center of mass"] = target.center_of_mass
    return [f"{name}: {_point_target(point)}." for name, point in points.items()]


def _point_target(target: PointTarget) -> str:
    parts = []
    for what, wanted, width, weight, unit in (
        ("at", target.position, target.tolerance, target.weight, "m"),
        ("moving with", target.velocity, target.velocity_tolerance, target.velocity_weight, "m/s"),
    ):
        if wanted is not None:
            hard = f" within {width:g} {unit}" if width is not None else ""
            parts.append(f"{what} {_axes(wanted)} {unit}{hard}, weight {weight:g}")
    return "; ".join(parts)


def _axes(values: Sequence[float | None]) -> str:
    return ", ".join(f"{axis} {value:g}" for axis, value in zip("xyz", values, strict=True) if value is not None)


def described_waypoints(motion: MotionProblem) -> list[str]:
    """Return a sentence for each waypoint, with the end of the interval it belongs to."""
    lines = []
    for waypoint, end in zip(motion.task.waypoints, waypoint_ends(motion.task, motion.grid), strict=True):
        share = "" if motion.grid.free else f", {motion.grid.ends[end - 1]:g} s"
        tolerance = waypoint.tolerance
        parts = [f"{name} {value:g}" for name, value in waypoint.configuration.items()]
        parts += [f"velocity of {name} {value:g}" for name, value in waypoint.velocity.items()]
        parts += [f"{name} within {width:g}" for name, width in tolerance.configuration.items()]
        parts += [f"velocity of {name} within {width:g}" for name, width in tolerance.velocity.items()]
        parts += [sentence.rstrip(".") for sentence in described_points(waypoint)]
        lines.append(f"After interval {end} of {motion.grid.intervals}{share}: {', '.join(parts)}.")
    return lines


def described_reference(reference: Reference) -> str:
    """Return what the reference is."""
    if isinstance(reference, Jumps):
        count, apex = reference.count, _values(reference.apex)
        return f"{count} jump{'s' * (count != 1)} over the line from start to goal, at their middle {apex}."
    if isinstance(reference, ThroughWaypoints):
        return "Cubic splines through the waypoints."
    if isinstance(reference, FromFile):
        return f"The motion in {reference.path}{', stretched to the duration' if reference.stretch else ''}."
    return "The line from start to goal."


def described_costs(costs: Costs) -> list[str]:
    """Return a row for each cost that is there only if it is asked for."""
    groups: list[tuple[str, Mapping[str, float]]] = [
        ("change of control between intervals", costs.control_change),
        ("mean acceleration over intervals", costs.acceleration),
        ("distance of the centre of mass from the reference's", costs.center_of_mass),
        *((f"distance of frame {name} from the reference's", weights) for name, weights in costs.frames.items()),
        ("integral of the normal force (not squared)", costs.force),
        ("duration (not squared)", {"s": costs.time}),
    ]
    used = [(what, {name: weight for name, weight in weights.items() if weight}) for what, weights in groups]
    return [f"  {what}: {_values(weights)}" for what, weights in used if weights]


def described_constraints(task: Task) -> list[str]:
    """Return a sentence for each constraint."""
    return [f"{name}: {_constraint(constraint)}." for name, constraint in task.constraints.items()]


def _constraint(constraint: Constraint) -> str:
    if isinstance(constraint, ContactWindow):
        first, last = constraint.times
        if constraint.touch == "forbidden":
            kept = f"is open by {constraint.clearance:g} m at every stage"
        else:
            kept = f"is closed within {constraint.tolerance:g} m at every interval's end"
        return f"the gap of {constraint.contact} {kept} from {first:g} to {last:g} s"
    if isinstance(constraint, ForbiddenZone):
        lower, upper = constraint.x
        return f"{constraint.contact} does not push on the ground for x in [{lower:g}, {upper:g}] m"
    return f"{_body_point(constraint)} {_place(constraint)}, at every stage"


def _body_point(point: BodyPoint) -> str:
    if not any(point.offset):
        return f"the origin of frame '{point.frame}'"
    return f"the point {_axes(point.offset)} m of frame '{point.frame}'"


def _place(constraint: BodyPoint) -> str:
    if isinstance(constraint, Clearance):
        return f"stays {constraint.distance:g} m above the ground"
    if isinstance(constraint, AvoidSphere):
        return f"stays out of the sphere of radius {constraint.radius:g} m around {_axes(constraint.center)} m"
    if isinstance(constraint, AvoidEllipse):
        return (
            f"stays out of the ellipsoid around {_axes(constraint.center)} m, half axes {_axes(constraint.semi_axes)} m"
        )
    if isinstance(constraint, AvoidBox):
        axes = sum(value is not None for value in constraint.center)
        wider = 100 * (axes ** (1 / constraint.power) - 1)
        return (
            f"stays out of the box around {_axes(constraint.center)} m, size {_axes(constraint.size)} m, rounded "
            f"outwards (up to {wider:.2g} % wider)"
        )
    assert isinstance(constraint, FrameLimits)
    bounds = [(axis, getattr(constraint, axis)) for axis in "xyz"]
    return "stays in " + ", ".join(f"{axis} [{b[0]:g}, {b[1]:g}]" for axis, b in bounds if b is not None) + " m"


def _values(values: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {value:g}" for name, value in values.items())
