"""A motion held against its task: its audit, its outcome, and demands that conflict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.fesd import Element
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import conflict_at
from fesd_robot.ocp.default_tolerances import with_default_tolerances
from fesd_robot.ocp.formulation import MotionProblem
from fesd_robot.plans import (
    Audit,
    MotionLimits,
    Names,
    Outcome,
    compliant_outcomes,
    contact_outcomes,
    findings_of_notes,
    goal_entries,
    replay_entries,
)
from fesd_robot.plans.audit import audit
from fesd_robot.plans.conflict_words import conflict_words
from fesd_robot.plans.requirements import requirements
from fesd_robot.recovery import NumericPhysics, PhysicalMotion, recover
from fesd_robot.replay import MotionReplay
from fesd_robot.robot import configuration_units, velocity_units


def numeric_physics(motion: MotionProblem) -> NumericPhysics:
    """Return Pinocchio's numeric view of the same robot, scene and contacts."""
    friction = {contact.name: contact.friction for contact in motion.contacts}
    return NumericPhysics(
        motion.robot,
        motion.scene,
        friction,
        motion.actuation.numeric,
        in_space=motion.in_space,
        restitution={contact.name: contact.restitution for contact in motion.contacts},
        compliance={one.name: (one.stiffness, one.damping) for one in motion.compliant},
        impacts_at_once=not motion.contact_system.clock_stops,
    )


def physical_motion(motion: MotionProblem, elements: Sequence[Element], branch: Branch) -> PhysicalMotion:
    """Return the motion in physical time from the finite elements of a solution in numerical time and its branch."""
    return recover(
        elements,
        branch,
        motion.fesd.tableau,
        motion.dynamics,
        motion.contacts,
        motion.contact_system,
        motion.auxiliary_force,
        motion.compliant,
    )


def motion_audit(
    motion: MotionProblem,
    physical: PhysicalMotion,
    physics: NumericPhysics,
    replay: MotionReplay | None,
    interval_ends: np.ndarray | None = None,
) -> Audit:
    """Audit a motion against its task's grid, limits and goals, and its replay.

    Args:
        motion: the formulated task.
        physical, physics: the motion, and the robot.
        replay: of the motion; left out of the audit if None.
        interval_ends: of the control intervals, s; those of the task's grid if omitted.
    """
    grid, limits, ends = motion.grid, motion.limits, motion.endpoints
    if interval_ends is None:
        count = len(physical.clock)
        interval_ends = grid.duration(physical.clock) * np.arange(1, count + 1) / count
    names = names_of(motion)
    found = audit(
        physical,
        physics,
        names=names,
        interval_ends=interval_ends,
        limits=MotionLimits(
            position=(limits.lower_position, limits.upper_position),
            velocity=(limits.lower_velocity, limits.upper_velocity),
            control=(motion.actuation.lower, motion.actuation.upper),
            entries=motion.task.audit.given,
            angles={
                name: each for name, each in motion.task.limits.position.items() if name not in names.configuration
            },
        ),
        others={
            **requirements(
                motion.task,
                motion.robot,
                physics,
                physical,
                (ends.initial_configuration, ends.initial_velocity),
                (ends.goal_configuration, ends.goal_velocity),
            ),
            **(replay_entries(replay, physical, names) if replay else {}),
        },
    )
    return found.model_copy(update={"findings": [*found.findings, *findings_of_notes(replay)]}) if replay else found


def names_of(motion: MotionProblem) -> Names:
    """Return the names of a task's contacts, coordinates and controls."""
    drive = motion.actuation
    return Names(
        contacts=[contact.name for contact in motion.contacts],
        compliant=[one.name for one in motion.compliant],
        configuration=configuration_units(motion.robot),
        velocity=velocity_units(motion.robot),
        controls=dict(zip(drive.names, drive.units, strict=True)),
    )


def motion_outcome(motion: MotionProblem, physical: PhysicalMotion, physics: NumericPhysics) -> Outcome:
    """Return the misses of a task's goal by a motion, and the events of its contacts."""
    ends = motion.endpoints
    contacts = {
        **contact_outcomes(physical, physics, [contact.name for contact in motion.contacts]),
        **compliant_outcomes(physical, physics),
    }
    return Outcome(
        goal=goal_entries(motion.task, motion.robot, physical, (ends.goal_configuration, ends.goal_velocity)),
        contacts={name: contacts[name] for name in motion.task.contacts},
    )


def conflict_of(motion: MotionProblem, polisher: BranchTranscription, w: np.ndarray, seconds: float) -> str:
    """Name the conflicting demands of a task at a point that is not feasible; empty if none is found.

    Args:
        motion: the task.
        polisher: of the transcription.
        w: the point, (n).
        seconds: longest time.
    """
    if seconds <= 0 or not np.isfinite(w).all():
        return ""
    conflict = conflict_at(polisher.problem, polisher.bounds(polisher.branch(w)), w, seconds)
    friction_coordinates = list(motion.robot.dry_friction)
    return conflict_words(conflict, names_of(motion), motion.grid.intervals, friction_coordinates) if conflict else ""


def with_hard_goal(motion: MotionProblem) -> MotionProblem:
    """Return a problem that was solved for a soft goal, with a task in which it is hard, to hold the motion against."""
    task = motion.task
    task = task.model_copy(update={"goal": task.goal.model_copy(update={"soft": False})})
    return replace(motion, task=with_default_tolerances(task, motion.robot, motion.limits))
