"""What one room hands on, in the form that the next room takes; every function here is one arrow of the chain."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from fesd_robot.complementarity import Branch
from fesd_robot.contact import Scene
from fesd_robot.errors import FesdRobotError
from fesd_robot.fesd import Element
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import Certificate, HomotopyOptions, Mpcc, MpccSolution, certify, conflict_at
from fesd_robot.ocp import MotionProblem, with_promises
from fesd_robot.ocp.contact_places import with_contact_frames
from fesd_robot.ocp.free_bodies import joint_values, with_bodies, without_dry_friction
from fesd_robot.plans import assemble
from fesd_robot.plans.audit import MotionLimits, audit
from fesd_robot.plans.audit_record import Audit
from fesd_robot.plans.columns import control_interval
from fesd_robot.plans.conflict_words import conflict_words
from fesd_robot.plans.contact_outcome import contact_outcomes
from fesd_robot.plans.findings import findings_of_notes
from fesd_robot.plans.full_model import full_model_of
from fesd_robot.plans.goal_outcome import goal_entries
from fesd_robot.plans.joint_friction import joint_friction_of, joint_switches_of
from fesd_robot.plans.measured import Names
from fesd_robot.plans.outcome import Outcome
from fesd_robot.plans.plan import Plan, Statistics, Status, Units
from fesd_robot.plans.replay_record import replay_entries
from fesd_robot.plans.requirements import requirements
from fesd_robot.recovery import PhysicalMotion, recover
from fesd_robot.recovery.full_model import FullModel
from fesd_robot.recovery.model_motion import ModelMotion, model_motion
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.replay.intervals import MotionReplay
from fesd_robot.robot import Robot, load_robot, with_joint_properties
from fesd_robot.robot.root import Root, square_placements
from fesd_robot.robot.units import configuration_units, velocity_units
from fesd_robot.strategies.deadline import CERTIFICATE_SECONDS
from fesd_robot.task import Task

logger = logging.getLogger(__name__)

CONFLICT_SECONDS = 10.0
"""Longest time for what stands against each other in a task that is not solved."""

EXACT_PRODUCT = 1e-14
"""Product of a pair that counts as zero in an exact solution: sides up to 1e-8 are zero, the root of it over ten."""


def homotopy_options(task: Task) -> HomotopyOptions:
    """Return the solver's options from the task's section `solver`."""
    solver = task.solver
    return HomotopyOptions(
        tolerance=solver.tolerance,
        sigma_start=solver.sigma_start,
        sigma_factor=solver.sigma_factor,
        velocity_level_ratio=solver.velocity_level_ratio,
        max_iterations=solver.max_iterations,
        time_limit=solver.time_limit,
        relaxation=solver.relaxation,
        steering=solver.steering,
        schedule=solver.schedule,
        linear_solver=solver.linear_solver,
        compile=task.method.compile,
        polish=solver.polish,
        loose_iterations=solver.loose_iterations,
    )


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
    )


def motion_audit(
    motion: MotionProblem,
    physical: PhysicalMotion,
    physics: NumericPhysics,
    replay: MotionReplay | None,
    interval_ends: np.ndarray | None = None,
) -> Audit:
    """Return what the audit says about a motion, held against its task's grid, limits and goals, and its replay.

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
        configuration=configuration_units(motion.robot),
        velocity=velocity_units(motion.robot),
        controls=dict(zip(drive.names, drive.units, strict=True)),
    )


def motion_outcome(motion: MotionProblem, physical: PhysicalMotion, physics: NumericPhysics) -> Outcome:
    """Return by how much a motion misses its task's goal, and what its contacts did."""
    ends = motion.endpoints
    return Outcome(
        goal=goal_entries(motion.task, motion.robot, physical, (ends.goal_configuration, ends.goal_velocity)),
        contacts=contact_outcomes(physical, physics, list(motion.task.contacts)),
    )


def with_promised_goal(motion: MotionProblem) -> MotionProblem:
    """Return a problem that was solved for a soft goal, with a task that promises it, to hold the motion against."""
    task = motion.task
    task = task.model_copy(update={"goal": task.goal.model_copy(update={"soft": False})})
    return replace(motion, task=with_promises(task, motion.robot, motion.limits))


def certificate_of(
    problem: Mpcc,
    solution: MpccSolution,
    tolerance: float,
    seconds_left: float,
    without: Callable[[np.ndarray], Mpcc | None] | None = None,
) -> Certificate | None:
    """Return what kind of point a solution is, or None if it is not solved or no time is left.

    Args:
        problem: with pairs; on the branch of an exact solution its elements of one mode are equally long.
        tolerance: product of a pair that counts as zero; where a solution is exact, `EXACT_PRODUCT` is taken.
        seconds_left: of the task's time; the certificate may take three quarters of it.
        without: as in `certify`.
    """
    seconds = min(CERTIFICATE_SECONDS, 0.75 * seconds_left)
    if not solution.solved or seconds <= 0:
        return None
    product = EXACT_PRODUCT if solution.exact else tolerance
    return certify(problem, solution.w, tolerance=product, time_limit=seconds, without=without)


def conflict_of(motion: MotionProblem, polisher: BranchTranscription, w: np.ndarray, seconds_left: float) -> str:
    """Return which demands of a task stand against each other at a point that is not feasible; empty if none is found.

    Args:
        motion: the task.
        polisher: of the transcription.
        w: the point, (n).
        seconds_left: of the task's time.
    """
    seconds = min(CONFLICT_SECONDS, 0.5 * seconds_left)
    if seconds <= 0 or not np.isfinite(w).all():
        return ""
    conflict = conflict_at(polisher.problem, polisher.bounds(polisher.branch(w)), w, seconds)
    rubbing = list(motion.robot.dry_friction)
    return conflict_words(conflict, names_of(motion), motion.grid.intervals, rubbing) if conflict else ""


def assembled_plan(
    motion: MotionProblem,
    physical: PhysicalMotion,
    physics: NumericPhysics,
    controls: Mapping[str, np.ndarray],
    *,
    status: Status,
    audit: Audit,
    outcome: Outcome,
    statistics: Statistics,
) -> Plan:
    """Return the plan: every array by the names of the task and the robot.

    Args:
        motion: the formulated task.
        physical: the motion in physical time.
        physics: for the gaps along it.
        controls: ``time``, where intervals begin, s, and every control by name, (N).
        status, audit, outcome, statistics: what is known about the solution.
    """
    task, robot, drive = motion.task, motion.robot, motion.actuation
    contacts = list(task.contacts)
    plan = Plan(
        name=task.name,
        status=status,
        audit=audit,
        units=Units(
            configuration=configuration_units(robot),
            velocity=velocity_units(robot),
            controls=dict(zip(drive.names, drive.units, strict=True)),
        ),
        trajectory=assemble.trajectory_of(physical, robot.configuration_names, robot.velocity_names),
        controls=dict(controls),
        contacts=assemble.contacts_of(physical, contacts, physics),
        switches=assemble.switches_of(physical, contacts),
        impulses=assemble.impulses_of(physical, contacts),
        joint_friction=joint_friction_of(physical, velocity_units(robot)),
        joint_switches=joint_switches_of(physical, robot.velocity_names),
        statistics=statistics,
        provenance=assemble.provenance(task.folder),
        task=task.model_dump(mode="json"),
        outcome=outcome,
        control_limits={
            name: (float(lower), float(upper))
            for name, lower, upper in zip(drive.names, drive.lower, drive.upper, strict=True)
        },
    )
    try:
        return with_full_model(plan, motion, physics)
    except FesdRobotError as error:
        logger.warning("the plan leaves out the joints of the full model, which cannot be read any more: %s", error)
        return plan


def with_full_model(plan: Plan, motion: MotionProblem, physics: NumericPhysics) -> Plan:
    """Return the plan with its motion on all joints of the model file, `fesd_robot.recovery.full_model`.

    Args:
        plan: stays as it is.
        motion: its task, formulated.
        physics: of the task's robot.

    Raises:
        FesdRobotError: the model cannot be read any more.
    """
    full = _full_model(motion).motion(physics, _samples(plan, motion), _dry_friction(plan, motion.robot))
    return plan.model_copy(update={"full_model": full_model_of(full)})


def with_gaps(plan: Plan, motion: MotionProblem, physics: NumericPhysics) -> Plan:
    """Return the plan with the gaps of its contacts at its samples, computed again from its robot."""
    names = motion.robot.configuration_names
    samples = zip(*[plan.trajectory.configuration[name] for name in names], strict=True)
    gaps = np.array([physics.gaps(np.array(q)) for q in samples])
    contacts = {
        contact.name: plan.contacts[contact.name].model_copy(update={"gap": gaps[:, i]})
        for i, contact in enumerate(motion.contacts)
    }
    return plan.model_copy(update={"contacts": contacts})


def model_motion_of(plan: Plan, motion: MotionProblem, physics: NumericPhysics) -> ModelMotion:
    """Return the plan's samples as states of the model of its file, `fesd_robot.recovery.model_motion`.

    Args:
        plan: with the motion of all joints of the model file.
        motion: its task, formulated.
        physics: of the task's robot.

    Raises:
        FesdRobotError: the model cannot be read any more.
    """
    task, full = motion.task, _full_model(motion)
    free = full.robot
    if any(section.root != "fixed" for section in (task.robot, *task.bodies.values())):
        root: Root = "fixed" if task.robot.root == "fixed" else "free_flyer"
        free = load_robot(task.locate_model(), root=root, search_path=task.folder)
        if task.robot.root == "sagittal":
            square_placements(free.model)
        free = with_bodies(task, free, locked=False, floating=True)
    joints = plan.full_model.joints if plan.full_model else {}
    efforts = {name: joint.effort for name, joint in joints.items()}
    return model_motion(full, free, physics, _samples(plan, motion), _dry_friction(plan, motion.robot), efforts)


def _full_model(motion: MotionProblem) -> FullModel:
    section, contacts = motion.task.robot, [contact.name for contact in motion.contacts]
    scene = Scene(motion.scene.surfaces, {name: motion.scene.geometries[name] for name in contacts})
    full = _full_robot(motion)
    locked = joint_values(motion.task, "locked")
    return FullModel(motion.robot, full, locked, section.coupled, scene, in_space=motion.in_space)


def _samples(plan: Plan, motion: MotionProblem) -> list[tuple[np.ndarray, ...]]:
    """Return q, v, u and f, (n_c, rows), of every sample of a plan."""
    trajectory, interval, robot = plan.trajectory, control_interval(plan), motion.robot
    contacts = [plan.contacts[contact.name] for contact in motion.contacts]
    forces = np.stack([contact.force for contact in contacts], axis=1)
    return list(
        zip(
            np.column_stack([trajectory.configuration[name] for name in robot.configuration_names]),
            np.column_stack([trajectory.velocity[name] for name in robot.velocity_names]),
            np.array([plan.controls[name][interval] for name in motion.actuation.names]).reshape(-1, len(interval)).T,
            forces,
            strict=True,
        )
    )


def _dry_friction(plan: Plan, robot: Robot) -> np.ndarray:
    """Return the force of the dry friction of joints at every sample, N or N m, (n, n_v)."""
    none = np.zeros_like(plan.trajectory.time)
    joints = plan.joint_friction
    return np.column_stack([joints[name].force if name in joints else none for name in robot.velocity_names])


def _full_robot(motion: MotionProblem) -> Robot:
    """Return the task's robot with nothing locked or coupled.

    Armature, damping and dry friction that the task gives to joints in unison are for all of them: each has an equal
    part.
    """
    task = motion.task
    section = task.robot
    if not joint_values(task, "locked") and not section.coupled:
        return motion.robot
    armature, damping, friction = (joint_values(task, key) for key in ("armature", "damping", "dry_friction"))
    parts = {name: [name] for name in {*armature, *damping, *friction}}
    for follower, leader in section.coupled.items():
        parts.setdefault(leader, [leader]).append(follower)

    def shared(values: Mapping[str, float]) -> dict[str, float]:
        return {joint: value / len(parts[name]) for name, value in values.items() for joint in parts[name]}

    full = load_robot(task.locate_model(), root=section.root, search_path=task.folder)
    full = with_bodies(task, without_dry_friction(section, full), locked=False)
    full = with_contact_frames(task, full)
    return with_joint_properties(
        full, armature=shared(armature), damping=shared(damping), dry_friction=shared(friction)
    )
