"""Goals of points, waypoints, costs, constraints and the reserve of a task in words."""

from __future__ import annotations

from fesd_robot.ocp import MotionProblem, standings_of, waypoint_times
from fesd_robot.orientations import with_angles
from fesd_robot.robot import deviation_units
from fesd_robot.task import COST_TERMS, Goal, PointTarget, Task, Waypoint, along_axes, listed


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
            parts.append(f"{what} {along_axes(wanted)} {unit}{hard}, weight {weight:g}")
    return "; ".join(parts)


def described_reserve(motion: MotionProblem) -> list[str]:
    """Return what a plan may use of friction and efforts, and what it is checked against; nothing without a reserve."""
    by_share: dict[float, list[str]] = {}
    for contact in motion.contacts:
        if contact.reserve > 0:
            by_share.setdefault(contact.reserve, []).append(contact.name)
    drive, lines = motion.actuation, []
    if by_share:
        parts = [f"{100 * (1 - share):g} % of it in {', '.join(names)}" for share, names in by_share.items()]
        lines.append(f"Friction where a contact sticks or lands: at most {'; '.join(parts)}. A slide has all of it.")
    limits, planned = (
        zip(drive.lower, drive.upper, strict=True),
        zip(drive.planned_lower, drive.planned_upper, strict=True),
    )
    efforts = [
        f"{name} [{own[0]:.4g}, {own[1]:.4g}] {unit}"
        for name, unit, own, all_of_it in zip(drive.names, drive.units, planned, limits, strict=True)
        if own != all_of_it
    ]
    if efforts:
        lines.append(f"Controls within {', '.join(efforts)}.")
    return [*lines, "The audit checks against all of what there is."] if lines else []


def described_waypoints(motion: MotionProblem) -> list[str]:
    """Return a sentence for each waypoint, with its time, and the end of the interval it belongs to if that stands."""
    lines, grid = [], motion.grid
    for waypoint, at in zip(motion.task.waypoints, waypoint_times(motion.task, grid), strict=True):
        time = f"{at / grid.nominal:.3g} of the duration" if grid.free else f"{at:g} s"
        where = f"At {time}" if grid.moving else f"After interval {grid.node(at)} of {grid.intervals}, {time}"
        tolerance = waypoint.tolerance
        parts = [f"{name} {value:g}" for name, value in with_angles(waypoint.configuration).items()]
        parts += [f"velocity of {name} {value:g}" for name, value in waypoint.velocity.items()]
        parts += [f"{name} within {width:g}" for name, width in tolerance.configuration.items()]
        parts += [f"velocity of {name} within {width:g}" for name, width in tolerance.velocity.items()]
        parts += [sentence.rstrip(".") for sentence in described_points(waypoint)]
        lines.append(f"{where}: {', '.join(parts)}.")
    return lines


def described_limits(motion: MotionProblem) -> list[str]:
    """Say where limits are from that are not those of their joint in the file, unless the task replaces them."""
    given = {"position": motion.task.limits.position, "velocity": motion.task.limits.velocity}
    return [text for (kind, name), text in motion.robot.limit_notes.items() if name not in given[kind]]


def described_standing(motion: MotionProblem) -> list[str]:
    """Return a sentence for each `stand_on`, with the coordinates that were found for it."""
    units, states, lines = deviation_units(motion.robot), dict(motion.task.states), []
    for standing in standings_of(motion.task, motion.robot):
        found = with_angles(states[standing.path].configuration)
        values = ", ".join(f"{name} {found[name]:.6g} {units[name]}" for name in standing.adjust)
        key, *number = standing.path
        where = {"initial": "the start", "goal": "the goal"}.get(key) or f"waypoint {int(number[0]) + 1}"
        rests = ", all through the last control interval" if key == "goal" and motion.task.goal.rests_on else ""
        wanted = ", ".join(f"{name} {value:g} {units[name]}" for name, value in standing.prefer.items())
        nearest = f", as near as possible to {wanted}" if wanted else ""
        lines.append(f"At {where} standing on {', '.join(standing.contacts)}{rests}{nearest}: {values}.")
    return lines


def described_costs(motion: MotionProblem) -> list[str]:
    """Return a row for each term of the cost; one that has no default only where it has a weight."""
    rows = ["Weights of squares:"]
    for key, term in COST_TERMS.items():
        if term.goal and motion.task.goal.periodic is not None:
            continue
        for _, words, weights in term.parts(key, getattr(motion.task.costs, key)):
            used = {name: weight for name, weight in (weights or {}).items() if weight}
            default = " (default)" if key in motion.default_costs else ""
            if used or term.default:
                rows.append(f"  {words}: {listed(used) if used else 'none'}{default}")
    if motion.default_costs:
        scales = motion.scales
        rows.append(
            f"Defaults count in units of the robot: {scales.mass:.3g} kg, {scales.length:.3g} m, {scales.time:.3g} s, "
            f"{scales.force:.3g} N, {scales.force * scales.length:.3g} N m."
        )
    return rows


def described_constraints(task: Task) -> list[str]:
    """Return a sentence for each constraint."""
    return [f"{name}: {constraint.in_words()}." for name, constraint in task.constraints.items()]
