"""A task in words: what will be solved, as seen after every name and default has been resolved."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping

import numpy as np
import pinocchio as pin

from fesd_robot.contact import Contact as PhysicalContact
from fesd_robot.errors import RobotError
from fesd_robot.explanation.descriptions import (
    described_constraints,
    described_costs,
    described_limits,
    described_points,
    described_reserve,
    described_standing,
    described_waypoints,
)
from fesd_robot.explanation.forces import described_forces
from fesd_robot.explanation.space import described_space
from fesd_robot.explanation.table import indented
from fesd_robot.explanation.warnings import reference_gaps, task_warnings
from fesd_robot.mpcc import Mpcc
from fesd_robot.ocp import TOUCHING, MotionProblem, ground_of, homotopy_options, numeric_physics
from fesd_robot.orientations import with_angles
from fesd_robot.robot import deviation_units, velocity_units
from fesd_robot.task import (
    GROUND,
    CircleBoxContact,
    CircleContact,
    Contact,
    Goal,
    GroundShape,
    SingleContact,
    SolidSurface,
    Task,
    TwoBodyContact,
    Wall,
    along_axes,
    enumerated,
    listed,
)
from fesd_robot.task import Robot as RobotSection

WIDTH = 100
LABEL = 12
_SCHEMES = {"radau_iia": "Radau IIA", "gauss_legendre": "Gauss-Legendre"}


def explanation(motion: MotionProblem, problem: Mpcc) -> str:
    """Describe the problem that will be solved, in sections with a label each.

    Args:
        motion: the task, formulated.
        problem: the same task, transcribed.
    """
    warnings = task_warnings(motion)
    sections = {
        "Warnings": warnings,
        "Robot": _robot(motion),
        "Controls": _controls(motion),
        "Ground": _ground(motion),
        "Contacts": _contacts(motion),
        "Reserve": described_reserve(motion),
        "Standing": described_standing(motion),
        "Horizon": _horizon(motion),
        "Goal": _goal(motion),
        "Reference": _reference(motion),
        "Waypoints": described_waypoints(motion),
        "Costs": described_costs(motion),
        "Constraints": described_constraints(motion.task),
        "Problem": _problem(motion, problem),
        "Left out": list(motion.robot.notes) or ["nothing of what the model file says"],
    }
    count = f", with {len(warnings)} warning{'s' * (len(warnings) != 1)}" if warnings else ""
    lines = [f"{motion.task.name}: the task fits its robot; this is what will be solved{count}."]
    for label, paragraphs in sections.items():
        if not paragraphs:
            continue
        lines.append("")
        for number, paragraph in enumerate(paragraphs):
            lines += _paragraph(label if number == 0 else "", paragraph)
    return "\n".join(lines)


def _paragraph(label: str, text: str) -> list[str]:
    """Return one paragraph beside its label; rows of a table, which begin with a blank, are not wrapped."""
    if text.startswith(" "):
        return [f"{label:<{LABEL}}{text}"]
    return textwrap.wrap(text, WIDTH, initial_indent=f"{label:<{LABEL}}", subsequent_indent=" " * LABEL)


def _robot(motion: MotionProblem) -> list[str]:
    robot, task = motion.robot, motion.task
    mass = pin.computeTotalMass(robot.model)
    first = (
        f"'{robot.name}' from {task.robot.model}, root {task.robot.root.replace('_', ' ')}; {mass:.6g} kg, "
        f"{len(robot.configuration_names)} configuration and {len(robot.velocity_names)} velocity coordinates:"
    )
    units, limits, ends = deviation_units(robot), motion.limits, motion.endpoints
    rows = [["coordinate", "unit", "start", "goal", "limits"]]
    arrays = ends.initial_configuration, ends.goal_configuration, limits.lower_position, limits.upper_position
    start, goal, lower, upper = (dict(zip(robot.configuration_names, each.tolist(), strict=True)) for each in arrays)
    start, goal = with_angles(start), with_angles(goal)
    for name, unit in units.items():
        own = motion.task.limits.position.get(name, (-np.inf, np.inf))
        bounds = lower.get(name, own[0]), upper.get(name, own[1])
        rows.append([name, unit, f"{start[name]:.4g}", f"{goal[name]:.4g}", _interval(*bounds)])
    velocity_unit = velocity_units(robot)
    velocity_rows = [["velocity", "unit", "start", "goal", "limits"]]
    for i, name in enumerate(robot.velocity_names):
        velocity_rows.append(
            [
                name,
                velocity_unit[name],
                f"{ends.initial_velocity[i]:.4g}",
                f"{ends.goal_velocity[i]:.4g}",
                _interval(limits.lower_velocity[i], limits.upper_velocity[i]),
            ]
        )
    armature = [f"Armature: {listed(task.robot.armature)} (kg or kg m2)."] if task.robot.armature else []
    return [
        first,
        *_reduction(task.robot),
        *_bodies(motion),
        *indented(rows),
        *indented(velocity_rows),
        *armature,
        *described_forces(robot),
        *described_limits(motion),
        *_shapes(motion),
    ]


def _bodies(motion: MotionProblem) -> list[str]:
    """Say what is beside the robot."""
    robot = motion.robot
    return [
        f"Body '{name}': {body.in_words()}, root {body.root.replace('_', ' ')}; "
        f"{pin.computeTotalMass(robot.bodies[name].model):.6g} kg."
        for name, body in motion.task.bodies.items()
    ]


def _reduction(section: RobotSection) -> list[str]:
    """Say which joints of the model are no coordinates."""
    pairs = ", ".join(f"{name} with {leader}" for name, leader in section.coupled.items())
    return [
        *([f"Locked: {listed(section.locked)} (rad or m)."] if section.locked else []),
        *([f"Coupled, as one body each: {pairs}."] if pairs else []),
    ]


def _shapes(motion: MotionProblem) -> list[str]:
    """Say what the page would miss."""
    if not motion.task.output.page:
        return []
    try:
        shapes = motion.robot.visual_model.ngeoms
    except RobotError as error:
        return [f"Page: it cannot be written. {error}"]
    return [] if shapes else ["Page: the model has no visual shapes, so the page will show no robot."]


def _controls(motion: MotionProblem) -> list[str]:
    drive = motion.actuation
    rows = [["control", "unit", "limits"]]
    for name, unit, lower, upper in zip(drive.names, drive.units, drive.lower, drive.upper, strict=True):
        rows.append([name, unit, _interval(lower, upper)])
    speed = motion.task.limits.speed_of_time
    count = len(drive.names)
    pace = f", and the speed of time in {_interval(speed.lower, speed.upper)}"
    if motion.grid.moving or not (motion.contact_system.clock_stops or motion.grid.free):
        pace = ""
    return [
        f"{count} control{'s' * (count != 1)}, constant on every interval{pace}:",
        *indented(rows),
        *_one_at_a_time(motion),
        _driven(motion),
    ]


def _one_at_a_time(motion: MotionProblem) -> list[str]:
    """Say which sets of controls act one at a time."""
    return [
        f"One at a time acts ({group}): "
        + "; ".join(f"{name} ({', '.join(controls)})" for name, controls in sets.items())
        + "."
        for group, sets in motion.dynamics.one_at_a_time.items()
    ]


def _driven(motion: MotionProblem) -> str:
    """Say which degrees of freedom controls push, and which none ever does."""
    names = motion.robot.velocity_names
    rows = set(motion.actuation.matrix.sparsity_out(0).get_triplet()[0])
    driven = [name for row, name in enumerate(names) if row in rows]
    free = [name for name in names if name not in driven]
    first = f"Driven: {', '.join(driven)}, {len(driven)} of {len(names)} degrees of freedom."
    if not free:
        return first
    return f"{first} Not driven: {', '.join(free)}; gravity, contacts and the other coordinates move them."


def _ground(motion: MotionProblem) -> list[str]:
    if not motion.task.contacts and not motion.task.constraints:
        return []
    ground, heights = motion.task.ground, ground_of(motion.task).heights_in_words()
    lines = [f"{ground.in_words()}; {_law(ground)} unless a contact has its own.", *([heights] if heights else [])]
    lines += [f"Wall '{name}' {wall.in_words()}; {_law(wall)}." for name, wall in ground.walls.items()]
    return lines + [
        f"Surface '{name}': {surface.in_words()}; {_law(surface)}." for name, surface in motion.task.surfaces.items()
    ]


def _contacts(motion: MotionProblem) -> list[str]:
    if not motion.task.contacts:
        return ["None: nothing touches the robot."]
    physics, ends = numeric_physics(motion), motion.endpoints
    start, goal = (
        dict(zip(motion.every_contact, physics.every_gap(q), strict=True))
        for q in (ends.initial_configuration, ends.goal_configuration)
    )
    lines, rigid = [], {contact.name: contact for contact in motion.contacts}
    for name, contact in motion.task.single_contacts.items():
        what, where = _touching(motion.task, contact)
        law = (
            f"{_law(rigid[name])}{_inelastic(rigid[name])}{_slipping(contact)}" if name in rigid else _springs(contact)
        )
        gaps = f"{_gap(start[name], where)} at the start, {_gap(goal[name], where)} at the goal"
        lines.append(f"{name}: {what}, {law}; {gaps}.")
    lines += described_space(motion)
    if not rigid:
        return lines
    if not motion.contact_system.clock_stops:
        return [*lines, "Impacts are impulses between two finite elements."]
    origin = "chosen from the weight" if motion.task.method.auxiliary_force == "auto" else "as given"
    force = f"auxiliary force a_n = {motion.auxiliary_force:g} N, {origin}"
    return [*lines, f"Impacts are resolved while the clock stands still ({force})."]


def _law(one: GroundShape | Wall | SolidSurface | PhysicalContact) -> str:
    """Return friction and restitution of a surface or a contact."""
    bounce = f", restitution {one.restitution:g}" if one.restitution else ""
    return f"friction {one.friction:g}{bounce}"


def _inelastic(contact: PhysicalContact) -> str:
    return "" if contact.restitution else ", inelastic"


def _springs(contact: SingleContact) -> str:
    """Return what a compliant contact pushes with, and from where on if its damping begins before it touches."""
    damping = f" and damping {contact.damping:g} N s/m" if contact.damping else ""
    return f"gives way with stiffness {contact.stiffness:g} N/m{damping}, without friction"


def _slipping(contact: Contact) -> str:
    if contact.slipping == "allowed":
        return ""
    if contact.slipping == "forbidden":
        return ", may not slip"
    return f", may slip {contact.slipping:g} m in all"


def _touching(task: Task, contact: SingleContact) -> tuple[str, str]:
    """Return the shape that touches, and the point from which its gap is counted."""
    if isinstance(contact, TwoBodyContact):
        if isinstance(contact, CircleBoxContact):
            assert contact.other_size is not None
            other = f"the box of {' x '.join(f'{length:g} m' for length in contact.other_size)}"
        else:
            other = f"that of {contact.other_radius:g} m"
        round_one = "circle" if contact.facing is None else "ball"
        what = f"the {round_one} of {contact.radius:g} m about frame '{contact.frame}'"
        return f"{what} against {other} about frame '{contact.other_frame}'", "apart"
    place = f"frame '{contact.frame}'"
    if any(contact.offset):
        place = f"the point {along_axes(contact.offset)} m of {place}"
    what = place if any(contact.offset) else f"the origin of {place}"
    if isinstance(contact, CircleContact):
        what = f"the circle of {contact.radius:g} m about {place}"
    if contact.surface == GROUND:
        return what, "above the ground"
    if contact.surface in task.ground.walls:
        return f"{what} against wall '{contact.surface}'", "from the wall"
    return f"{what} on '{contact.surface}'", f"from '{contact.surface}'"


def _horizon(motion: MotionProblem) -> list[str]:
    grid, fesd, tableau = motion.grid, motion.fesd, motion.fesd.tableau
    length, duration = grid.nominal / grid.intervals, f"{grid.nominal:g} s"
    if grid.free:
        duration = f"{grid.lower:g} to {grid.upper:g} s, first taken as {grid.nominal:g} s,"
    counts = [fesd.elements] if isinstance(fesd.elements, int) else sorted(set(fesd.elements))
    elements = " or ".join(str(count) for count in counts)
    scheme = (
        f"{_SCHEMES.get(tableau.scheme, tableau.scheme)} with {tableau.stages} stage{'s' * (tableau.stages != 1)}, "
        f"of order {tableau.order} also across switches."
    )
    intervals = f"{grid.intervals} interval{'s' * (grid.intervals != 1)}"
    if grid.moving:
        first = f"{duration} in {intervals}, equally long."
        if motion.contact_system.system.complementarities:
            first = (
                f"{duration} in about {intervals} that move with the contacts: as many in a phase, in which no contact "
                "changes, as its part of the duration, equally long. When contacts change is free, and there controls "
                "may change, too."
            )
        return [first, f"One finite element each, {scheme}"]
    longest = " or ".join(f"{(1 + fesd.gamma) * length / count:.4g}" for count in counts)
    steps = f"of free length up to {longest} s" if fesd.gamma > 0 else f"of fixed length {longest} s"
    return [
        f"{duration} in {intervals} of {length:.4g} s; "
        f"{elements} finite element{'s' * (counts != [1])} each, {steps} (numerical time).",
        scheme,
        *[capacity(count) for count in counts],
    ]


def capacity(elements: int) -> str:
    """Return the events that an interval of so many elements can hold."""
    rule = (
        "Elements end at switches, and an impact fills one of its own, in which the clock stands still; so an impact "
        "inside an interval needs 3 elements, a take-off or a change between sticking and sliding 2."
    )
    if elements == 1:
        return f"{rule} With 1, no impact is possible, and everything else happens between intervals."
    if elements == 2:
        return (
            f"{rule} With 2, an interval can hold an impact only at its start or its end, or one other switch, besides "
            "switches at its ends."
        )
    impacts = (elements - 1) // 2
    return (
        f"{rule} With {elements}, an interval can hold {impacts} impact{'s' * (impacts != 1)}, or up to {elements - 1} "
        "other switches, besides switches at its ends."
    )


def _goal(motion: MotionProblem) -> list[str]:
    goal, robot = motion.task.goal, motion.robot
    positions, velocities = deviation_units(robot), velocity_units(robot)
    if goal.periodic is not None:
        shifts = ", ".join(f"{name} by {value:g} {positions[name]}" for name, value in goal.periodic.stride.items())
        stride = f", shifted by one stride: {shifts}" if shifts else ""
        image = "mirror image of the state" if goal.periodic.mirror else "state"
        first = f"Periodic: the motion ends in the {image} it begins in{stride}; the start is free within the limits."
        pairs = ", ".join(f"{name} as {partner}" for name, partner in goal.periodic.mirror.items())
        mirror = [f"Mirrored, each ends as the other began: {pairs}; all else ends as it began."] if pairs else []
        return [first, *mirror, *described_points(goal)]
    widths = goal.tolerance
    hard = [*_hard(widths.configuration, positions), *_hard_velocities(goal, velocities)]
    if not hard:
        soft = "All coordinates are" if goal.has_points else "The whole goal is"
    elif len(widths.configuration) + len(widths.velocity) == len(positions) + len(velocities):
        soft = ""
    else:
        soft = "all other coordinates are" if goal.has_points else "all else is"
    sentence = [f"Hard: {', '.join(hard)}"] if hard else []
    sentence += [f"{soft} soft, with weights in the terminal costs only"] if soft else []
    return [f"{'; '.join(sentence)}.", *described_points(goal)]


def _hard_velocities(goal: Goal, units: Mapping[str, str]) -> list[str]:
    """Say how closely velocities are reached: in one phrase if all are to be zero, and equally closely."""
    widths = goal.tolerance.velocity
    if goal.rests and len(widths) == len(units) and len(set(widths.values())) == 1:
        return [f"at rest within {next(iter(widths.values())):g} {' and '.join(dict.fromkeys(units.values()))}"]
    return _hard(widths, units, "velocity of ")


def _hard(widths: Mapping[str, float], units: Mapping[str, str], what: str = "") -> list[str]:
    """Return a phrase for all coordinates of one unit that are reached equally closely."""
    groups: dict[tuple[float, str], list[str]] = {}
    for name, unit in units.items():
        if name in widths:
            groups.setdefault((widths[name], unit), []).append(name)
    return [f"{what}{enumerated(names)} within {width:g} {unit}" for (width, unit), names in groups.items()]


def _reference(motion: MotionProblem) -> list[str]:
    what, gaps = motion.task.reference.in_words(), reference_gaps(motion)
    lines = [f"{what} The solver starts from it, and the costs compare with it."]
    for least, (name, contact) in zip(gaps, motion.task.rigid_contacts.items(), strict=True):
        if least < -TOUCHING:
            where = "too far" if isinstance(contact, TwoBodyContact) else motion.task.inside(contact.surface)
            lines.append(f"Along it {name} gets {-least:.4g} m {where}; the planned motion will not.")
    return lines


def _problem(motion: MotionProblem, problem: Mpcc) -> list[str]:
    options, count = homotopy_options(motion.task), len(motion.task.contacts)
    seconds = motion.task.solver.time_limit
    limit = "without a time limit" if seconds is None else f"{seconds:g} s in all at most"
    return [
        f"MPCC with {problem.size} variables, {problem.constraints} constraints and {problem.pairs} complementarity "
        f"pairs ({count} contact{'s' * (count != 1)}).",
        f"Solved by IPOPT (linear solver {options.linear_solver}), relaxed by sigma from {options.sigma_start:g} to "
        f"{options.tolerance:g}; at most {options.max_iterations} iterations for each sigma, {limit}.",
    ]


def _gap(gap: float, where: str) -> str:
    if abs(gap) <= TOUCHING:
        return "touching"
    return f"compressed by {-gap:.4g} m" if gap < 0 else f"{gap:.4g} m {where}"


def _interval(lower: float, upper: float) -> str:
    return "none" if np.isinf(lower) and np.isinf(upper) else f"[{lower:.4g}, {upper:.4g}]"
