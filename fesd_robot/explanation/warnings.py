"""Warnings about a task: likely mistakes in it, although it is valid."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import casadi as ca
import numpy as np

from fesd_robot.contact import TwoBodies
from fesd_robot.exactness import NO_VELOCITY, ROUNDED, WRITTEN
from fesd_robot.ocp import TOUCHING, MotionProblem, mirrored, numeric_physics, posture_of, touching_configuration
from fesd_robot.plans.overlaps import overlaps
from fesd_robot.recovery import holding_effort, normal_rows
from fesd_robot.robot import ROOT_HEIGHT, configuration_units, immovable_joints
from fesd_robot.task import GROUND, Jumps

NEAR_SURFACE = 0.1
"""m; a contact further from what it may touch than this is not near it."""

REFERENCE_DEPTH = 0.1
"""m; a reference that takes a contact deeper into the ground says little about the motion."""

LONGEST_INTERVAL = 0.2
"""s; controls that stay constant for longer can hardly balance a robot."""

FLOATING = 0.01
"""m; a robot at rest that starts this little above the ground was perhaps to stand on it."""

REFERENCE_SAMPLES = 400

MIRRORED_STATES, MIRRORED_SPAN = 10, 0.5
"""How many states are mirrored, and how far from the start their coordinates are, m or rad."""

SYMMETRIC = 1e-3
"""Of the energy, or of the robot's length; left and right legs of a file that was drawn are alike to some digits."""

_LEAST_DEGREES, _STEP_OF_DEGREES = 10.0, 5.0
"""Nobody writes a multiple of 5 rad from 10 rad on, but many write such angles in degrees."""


def task_warnings(motion: MotionProblem) -> list[str]:
    """Return a sentence for every likely mistake in a task that is valid.

    Of a motion that repeats the start is free, so that nothing is said about what happens there.
    """
    return [
        *motion.robot.warnings,
        *_degrees(motion),
        *_immovable(motion),
        *_far_from_the_ground(motion),
        *([] if motion.task.goal.periodic else _at_the_start(motion)),
        *([] if motion.task.goal.periodic else _overlapping(motion)),
        *_buried_reference(motion),
        *_goal_against_constraints(motion),
        *_long_intervals(motion),
        *_no_symmetry(motion),
    ]


def reference_gaps(motion: MotionProblem) -> np.ndarray:
    """Return the smallest gap of every contact along the reference, m, (n_c)."""
    physics = numeric_physics(motion)
    times = np.linspace(0.0, motion.grid.nominal, REFERENCE_SAMPLES)
    gaps = [physics.gaps(motion.reference.configuration(float(time))) for time in times]
    return np.asarray(np.min(gaps, axis=0))


def _degrees(motion: MotionProblem) -> Iterator[str]:
    task, units = motion.task, configuration_units(motion.robot)
    groups: dict[str, Mapping[str, float]] = {f"postures.{name}": each for name, each in task.postures.items()}
    for path, state in task.states:
        posture = posture_of(task, motion.robot, state.posture)
        own = {name: value for name, value in state.configuration.items() if posture.get(name) != value}
        groups[".".join((*path, "configuration"))] = own
    if isinstance(task.reference, Jumps):
        groups["reference.apex"] = task.reference.apex
    for key, values in groups.items():
        for name, value in values.items():
            if units.get(name, "rad") == "rad" and abs(value) >= _LEAST_DEGREES and value % _STEP_OF_DEGREES == 0:
                yield (
                    f"{key}.{name} is {value:g} rad, {abs(value) / (2 * math.pi):.2g} turns; {value:g} degrees would "
                    f"be {math.radians(value):.6g} rad."
                )


def _immovable(motion: MotionProblem) -> Iterator[str]:
    limits = motion.limits
    return immovable_joints(
        motion.robot,
        (limits.lower_position, limits.upper_position),
        (limits.lower_velocity, limits.upper_velocity),
    )


def _far_from_the_ground(motion: MotionProblem) -> Iterator[str]:
    physics, ends = numeric_physics(motion), motion.endpoints
    gaps = np.minimum(physics.every_gap(ends.initial_configuration), physics.every_gap(ends.goal_configuration))
    contacts = [*motion.contacts, *(one.contact for one in motion.compliant)]
    never = [
        contact.name
        for contact in contacts
        if not ca.jacobian_sparsity(contact.gap, motion.dynamics.configuration).nnz()
    ]
    for name in never:
        yield f"Contact '{name}' can never touch: no joint changes its distance from what it may touch."
    # What two bodies do to each other may well happen on the way, as where a bat hits a ball.
    on_surfaces = {
        contact.name: float(gap)
        for contact, gap in zip(contacts, gaps, strict=True)
        if not isinstance(motion.scene.geometries[contact.name], TwoBodies)
    }
    if set(on_surfaces) - set(never) and gaps.min() > NEAR_SURFACE:
        nearest = min(on_surfaces, key=lambda name: on_surfaces[name])
        yield (
            "Neither at the start nor at the goal is any contact near what it may touch; the nearest is "
            f"'{nearest}', {on_surfaces[nearest]:.4g} m away."
        )


def _at_the_start(motion: MotionProblem) -> Iterator[str]:
    yield from _hitting_at_the_start(motion)
    yield from _floating_at_the_start(motion)
    yield from _too_weak(motion)


def _floating_at_the_start(motion: MotionProblem) -> Iterator[str]:
    """Say at which height a robot stands that touches nothing and is just above the ground."""
    physics, ends = numeric_physics(motion), motion.endpoints
    gaps = physics.gaps(ends.initial_configuration)
    falls = motion.robot.model.gravity.linear[2] < 0
    heights = _standing_heights(motion, gaps) if falls and gaps.min(initial=np.inf) > TOUCHING else {}
    if not heights:
        return
    height, first = max(heights.values()), max(heights, key=lambda i: heights[i])
    velocity = physics.contact_jacobian(ends.initial_configuration)[physics.rows * first] @ ends.initial_velocity
    if abs(velocity) <= NO_VELOCITY:
        names = [motion.contacts[i].name for i, own in heights.items() if height - own <= TOUCHING]
        yield (
            f"Contact '{motion.contacts[first].name}' starts {gaps[first]:.4g} m above the ground and falls; to stand, "
            f"write initial.configuration.{ROOT_HEIGHT}: {round(height, 6):.9g} or initial.stand_on: "
            f"[{', '.join(names)}]."
        )


def _standing_heights(motion: MotionProblem, gaps: np.ndarray) -> dict[int, float]:
    """Return for every contact just above the ground, by its number, the height of the robot at which it touches, m."""
    start, heights = motion.endpoints.initial_configuration, {}
    for i, contact in enumerate(motion.contacts):
        own = motion.task.single_contacts[contact.name]
        on_ground = getattr(own, "surface", None) == GROUND and motion.robot.body_of(own.frame) is None
        if on_ground and gaps[i] <= FLOATING and ROOT_HEIGHT in motion.robot.velocity_names:
            symbols = motion.dynamics.configuration
            q, left = touching_configuration(motion.robot, [contact], symbols, [ROOT_HEIGHT], start, motion.limits)
            if abs(left[0]) <= TOUCHING:
                heights[i] = float(q[motion.robot.configuration_names.index(ROOT_HEIGHT)])
    return heights


def _overlapping(motion: MotionProblem) -> Iterator[str]:
    ends = motion.endpoints
    moments = [("At the start", ends.initial_configuration)]
    if not motion.task.goal.has_points:
        moments.append(("At the goal", ends.goal_configuration))
    yield from overlaps(motion.task, motion.robot, motion.scene.surfaces, moments)


def _hitting_at_the_start(motion: MotionProblem) -> Iterator[str]:
    physics, ends = numeric_physics(motion), motion.endpoints
    gaps = physics.gaps(ends.initial_configuration)
    velocities = normal_rows(physics.contact_jacobian(ends.initial_configuration), physics.rows) @ ends.initial_velocity
    for contact, gap, velocity in zip(motion.contacts, gaps, velocities, strict=True):
        if gap <= TOUCHING and velocity < -NO_VELOCITY:
            yield (
                f"Contact '{contact.name}' touches at the start and moves on into what it touches at "
                f"{-velocity:.4g} m/s: the motion begins with an impact."
            )


def _too_weak(motion: MotionProblem) -> Iterator[str]:
    """Compare the controls with the weight, for a robot that starts at rest on something."""
    physics, q, drive = numeric_physics(motion), motion.endpoints.initial_configuration, motion.actuation
    closed = physics.gaps(q) <= TOUCHING
    if motion.endpoints.initial_velocity.any() or not closed.any():
        return
    effort = holding_effort(physics, q, (drive.planned_lower, drive.planned_upper), closed)
    if effort is None or effort[0] <= 1 + WRITTEN:
        return
    times_limits, u = effort
    over = [
        f"{name} {value:.4g} {unit}"
        for name, value, unit, lower, upper in zip(
            drive.names, u, drive.units, drive.planned_lower, drive.planned_upper, strict=True
        )
        if not lower - WRITTEN <= value <= upper + WRITTEN
    ]
    reserved = (drive.planned_lower != drive.lower) | (drive.planned_upper != drive.upper)
    limits = "what the reserve leaves of their limits" if reserved.any() else "their limits"
    yield (
        f"The controls cannot hold the weight at the start: standing still takes {times_limits:.3g} times {limits} "
        f"({', '.join(over)}), so the robot sinks."
    )


def _buried_reference(motion: MotionProblem) -> Iterator[str]:
    for (name, contact), least in zip(motion.task.rigid_contacts.items(), reference_gaps(motion), strict=True):
        if least < -REFERENCE_DEPTH and getattr(contact, "surface", None) == GROUND:
            yield (
                f"The reference takes contact '{name}' {-least:.4g} m below the ground; one that stays above it is a "
                "better start for the solver."
            )


def _goal_against_constraints(motion: MotionProblem) -> Iterator[str]:
    if motion.task.goal.periodic is not None or motion.task.goal.has_points:
        return
    for constraint in motion.ocp.constraints:
        if constraint.name != "constraints":
            continue
        point = np.zeros(constraint.variables.numel())
        q = motion.endpoints.goal_configuration
        point[: len(q)] = q
        values = np.asarray(ca.Function("rows", [constraint.variables], [constraint.rows])(point)).ravel()
        missing = np.maximum(constraint.lower - values, values - constraint.upper)
        for name, depth in zip(constraint.row_names, missing, strict=True):
            if depth > WRITTEN:
                yield f"The goal itself violates {name}, by {depth:.4g} m."


def _long_intervals(motion: MotionProblem) -> Iterator[str]:
    length = motion.grid.upper / motion.grid.intervals
    if length > LONGEST_INTERVAL * (1 + ROUNDED):
        least = math.ceil(motion.grid.upper / LONGEST_INTERVAL - ROUNDED)
        yield (
            f"The controls are constant for {length:.4g} s at a time, which is long for a robot that has to balance; "
            f"horizon.intervals of {least} or more make it at most {LONGEST_INTERVAL:g} s."
        )


def _no_symmetry(motion: MotionProblem) -> Iterator[str]:
    """Compare energies and gaps of random states with those of their mirror images, which a symmetry leaves alike."""
    periodic = motion.task.goal.periodic
    if periodic is None or not periodic.mirror:
        return
    physics, ends, generator = numeric_physics(motion), motion.endpoints, np.random.default_rng(0)
    names, velocities, energies, gaps = motion.robot.configuration_names, motion.robot.velocity_names, [], []
    for _ in range(MIRRORED_STATES):
        q = ends.initial_configuration + generator.uniform(-MIRRORED_SPAN, MIRRORED_SPAN, len(names))
        v = generator.uniform(-1.0, 1.0, len(velocities))
        image = mirrored(motion.task, names, q), mirrored(motion.task, velocities, v)
        own = physics.energy(q, v) - physics.energy(ends.initial_configuration, 0 * v)
        energies.append((own, physics.energy(*image) - physics.energy(q, v)))
        gaps.append(np.abs(np.sort(physics.gaps(image[0])) - np.sort(physics.gaps(q))).max())
    scale, difference = np.abs(energies).max(axis=0)
    if difference > SYMMETRIC * scale or max(gaps) > SYMMETRIC * motion.scales.length:
        yield (
            f"goal.periodic.mirror is no symmetry of this robot: energies of mirrored states differ by up to "
            f"{100 * difference / scale:.2g} %, their gaps by up to {max(gaps):.2g} m; the mirror image of the motion "
            "is not what would follow it."
        )
