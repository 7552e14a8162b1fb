"""The plan of a motion, by the names of its task and its robot, on the joints of the task and of the model file."""

from __future__ import annotations

import logging
from collections.abc import Mapping

import numpy as np

from fesd_robot.contact import Scene
from fesd_robot.errors import FesdRobotError
from fesd_robot.ocp.contact_places import with_contact_frames
from fesd_robot.ocp.formulation import MotionProblem
from fesd_robot.ocp.free_bodies import joint_values, limit_surfaces_of, scale_of, with_bodies, without_dry_friction
from fesd_robot.plans import (
    Audit,
    Outcome,
    Plan,
    Statistics,
    Status,
    Units,
    assemble,
    control_interval,
    full_model_of,
    joint_friction_of,
    joint_switches_of,
)
from fesd_robot.recovery import IN_THE_PLANE, FullModel, ModelMotion, NumericPhysics, PhysicalMotion
from fesd_robot.recovery.model_motion import model_motion
from fesd_robot.robot import (
    Robot,
    Root,
    configuration_units,
    load_scaled,
    square_placements,
    velocity_units,
    with_joint_properties,
    with_limit_surfaces,
)

logger = logging.getLogger(__name__)


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
    contacts, compliant = ([one.name for one in own] for own in (motion.contacts, motion.compliant))
    histories = {**assemble.contacts_of(physical, contacts, physics), **assemble.compliant_of(physical, physics)}
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
        contacts={name: histories[name] for name in task.contacts},
        switches=assemble.switches_of(physical, contacts, compliant),
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
    gaps = np.array([physics.every_gap(np.array(q)) for q in samples])
    updated = {
        name: plan.contacts[name].model_copy(update={"gap": gaps[:, i]}) for i, name in enumerate(motion.every_contact)
    }
    contacts = {name: updated[name] for name in motion.task.contacts}
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
        free = load_scaled(task.locate_model(), scale_of(task.robot), root=root, search_path=task.folder)
        if task.robot.root == "sagittal":
            square_placements(free.model)
        free = with_bodies(task, free, locked=False, floating=True)
    joints = plan.full_model.joints if plan.full_model else {}
    efforts = {name: joint.effort for name, joint in joints.items()}
    return model_motion(full, free, physics, _samples(plan, motion), _dry_friction(plan, motion.robot), efforts)


def _full_model(motion: MotionProblem) -> FullModel:
    section, contacts = motion.task.robot, motion.every_contact
    scene = Scene(motion.scene.surfaces, {name: motion.scene.geometries[name] for name in contacts})
    full = _full_robot(motion)
    locked = joint_values(motion.task, "locked")
    return FullModel(motion.robot, full, locked, section.coupled, scene, in_space=motion.in_space)


def _samples(plan: Plan, motion: MotionProblem) -> list[tuple[np.ndarray, ...]]:
    """Return q, v, u and f of rigid and then of compliant contacts, (n_c + n_s, rows), of every sample of a plan."""
    trajectory, interval, robot = plan.trajectory, control_interval(plan), motion.robot
    contacts = [plan.contacts[name] for name in motion.every_contact]
    forces = np.zeros((len(interval), 0, IN_THE_PLANE))
    if contacts:
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

    full = load_scaled(task.locate_model(), scale_of(section), root=section.root, search_path=task.folder)
    full = with_bodies(task, without_dry_friction(section, full), locked=False)
    full = with_contact_frames(task, full)
    full = with_joint_properties(
        full, armature=shared(armature), damping=shared(damping), dry_friction=shared(friction)
    )
    return with_limit_surfaces(full, limit_surfaces_of(task))
