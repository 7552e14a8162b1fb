"""The robot of a task: read from its file, reduced as the task says, and checked against all names and values."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pinocchio as pin

from fesd_robot.errors import JointError, RobotError
from fesd_robot.exactness import ROUNDED
from fesd_robot.ocp.actuation import actuators_of
from fesd_robot.ocp.contact_places import with_contact_frames, with_contact_places
from fesd_robot.ocp.free_bodies import joint_values, limit_surfaces_of, scale_of, with_bodies, without_dry_friction
from fesd_robot.ocp.two_bodies import with_two_bodies
from fesd_robot.robot import Robot, configuration_units, load_scaled, with_joint_properties, with_limit_surfaces
from fesd_robot.task import Task, TwoBodyContact, check_names, check_orientations, check_values


def load_task_robot(task: Task) -> tuple[Task, Robot]:
    """Return a task with its contacts in their places, and its robot with frames there.

    Raises:
        TaskError: the model cannot be read, a joint cannot be locked or coupled, a name is not the robot's, a value
            lies outside its limits, a body has no shapes that can touch, or two contacts are at the same place; with
            file, line and key.
    """
    section, source = task.robot, task.locate_model()
    try:
        robot = load_scaled(
            source,
            scale_of(section),
            root=section.root,
            locked=section.locked,
            coupled=section.coupled,
            search_path=task.folder,
        )
    except JointError as error:
        raise task.error(("robot", error.option, error.joint), str(error)) from error
    except RobotError as error:
        raise task.error("robot.model", str(error)) from error
    robot = with_bodies(task, without_dry_friction(section, robot))
    check_names(
        task,
        robot.configuration_names,
        robot.velocity_names,
        robot.joint_names,
        robot.frame_names,
        list(actuators_of(task, robot)),
        list(robot.postures),
    )
    check_orientations(task, robot.configuration_names)
    robot = with_joint_properties(
        robot,
        armature=joint_values(task, "armature"),
        damping=joint_values(task, "damping"),
        dry_friction=joint_values(task, "dry_friction"),
    )
    robot = with_limit_surfaces(robot, limit_surfaces_of(task))
    positions = zip(robot.lower_position, robot.upper_position, strict=True)
    check_values(
        task,
        dict(zip(robot.configuration_names, positions, strict=True)),
        {name: (0.0 - v, v) for name, v in zip(robot.velocity_names, robot.velocity_limit, strict=True)},
        configuration_units(robot),
        robot.postures,
        robot.limit_notes,
    )
    task = with_contact_places(task, robot)
    robot = with_contact_frames(task, robot)
    task = with_two_bodies(task, robot)
    _check_distinct_contacts(task, robot)
    return task, robot


def _check_distinct_contacts(task: Task, robot: Robot) -> None:
    """Refuse two contacts that touch together wherever the robot is: their forces would be undetermined."""
    model = robot.model
    data, paths = model.createData(), []
    points = {name: one for name, one in task.single_contacts.items() if not isinstance(one, TwoBodyContact)}
    frames = {name: robot.frame_id(contact.touching_frame) for name, contact in points.items()}
    for first_step in (0.0, 0.3, -0.7):
        q = pin.integrate(model, robot.neutral, np.linspace(first_step, 1, model.nv))
        pin.framesForwardKinematics(model, data, q)
        paths.append({name: data.oMf[frame].translation[[0, 2]] for name, frame in frames.items()})
    unplaced = {"frame": "", "offset": (0, 0, 0), "friction": None}
    kinds = {name: contact.model_copy(update=unplaced) for name, contact in points.items()}
    for first, second in combinations(frames, 2):
        if kinds[first] == kinds[second] and all(np.abs(path[first] - path[second]).max() <= ROUNDED for path in paths):
            raise task.error(
                ("contacts", second),
                f"found a contact that is always where '{first}' is in the x-z plane, expected one of the two: its "
                "force is the sum of both",
            )
