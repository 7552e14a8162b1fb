"""The setup of a task: its robot, ground, motors and contacts, whatever the start and the goal are in numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, cast

import casadi as ca
import numpy as np

from fesd_robot.contact import CompliantContact, Contact, MultibodyDynamics, Scene, contact_of, needs_space
from fesd_robot.errors import GroundError, RobotError
from fesd_robot.ocp.actuation import Actuation, build_actuation, check_driven, one_at_a_time_of
from fesd_robot.ocp.checks import check_compliance, check_contacts_move, check_dry_friction, check_impulses
from fesd_robot.ocp.default_tolerances import with_slipping
from fesd_robot.ocp.scene import compliance_of, friction_of, reserve_of, restitution_of, scene_of
from fesd_robot.ocp.task_robot import load_task_robot
from fesd_robot.robot import (
    Robot,
    configuration_derivative,
    damping_force,
    mass_matrix,
    nonlinear_effects,
    spring_force,
)
from fesd_robot.running import Identity
from fesd_robot.task import Task


@dataclass(frozen=True)
class Setup:
    """A task with all that is decided once for it and for tasks that differ from it in numbers.

    What touches where and what faces what is taken from the start of this task; a start that is measured later does not
    change how many contacts there are.

    Attributes:
        asked: the task as it was asked for.
        task: with its contacts in their places, and what each of them may do.
        robot: with frames there.
        actuation: the controls.
        scene: ground, walls and the shapes that touch.
        dynamics: of the robot, as expressions.
        contacts: as expressions, those that are rigid.
        compliant: the others, which give way.
    """

    asked: Task
    task: Task
    robot: Robot
    actuation: Actuation
    scene: Scene
    dynamics: MultibodyDynamics
    contacts: Sequence[Contact]
    compliant: Sequence[CompliantContact]

    @classmethod
    def of(cls, task: Task, *, driven: bool = True) -> Setup:
        """Return the setup of a task.

        Args:
            task: from `load_task`.
            driven: whether a robot without controls is an error; a body that is only let go has none.

        Raises:
            TaskError: a name, value or combination that this robot cannot satisfy, with file, line and key.
        """
        asked = task
        task, robot = load_task_robot(task)
        task = with_slipping(task)
        check_dry_friction(task, robot)
        if driven:
            check_driven(task, robot)
        actuation = build_actuation(task, robot)
        scene = scene_of(task)
        dynamics = replace(_multibody_dynamics(robot, actuation), one_at_a_time=one_at_a_time_of(task, actuation))
        every = _contacts(task, robot, dynamics.configuration, scene)
        check_contacts_move(task, every, dynamics.configuration)
        contacts = [contact for contact in every if contact.name in task.rigid_contacts]
        compliant = [
            CompliantContact(contact, *compliance_of(task)[contact.name])
            for contact in every
            if contact.name in task.compliant_contacts
        ]
        check_compliance(task, compliant)
        check_impulses(task, dynamics, contacts)
        return cls(asked, task, robot, actuation, scene, dynamics, contacts, compliant)


def _multibody_dynamics(robot: Robot, actuation: Actuation) -> MultibodyDynamics:
    q = ca.SX.sym("q", len(robot.configuration_names))
    v = ca.SX.sym("v", len(robot.velocity_names))
    u = ca.SX.sym("u", len(actuation.names))
    return MultibodyDynamics(
        configuration=q,
        velocity=v,
        control=u,
        configuration_derivative=configuration_derivative(robot, q, v),
        mass_matrix=mass_matrix(robot, q),
        force=ca.mtimes(actuation.matrix(q), u)
        - nonlinear_effects(robot, q, v)
        - damping_force(robot, v)
        - spring_force(robot, q),
        configuration_names=robot.configuration_names,
        velocity_names=robot.velocity_names,
        control_names=actuation.names,
        dry_friction=robot.dry_friction,
        limit_surfaces=robot.limit_surfaces,
    )


def _contacts(task: Task, robot: Robot, q: ca.SX, scene: Scene) -> list[Contact]:
    contacts, in_space = [], needs_space(robot, q, scene.geometries)
    for name, geometry in scene.geometries.items():
        try:
            friction = friction_of(task, name)
            contact = contact_of(robot, q, geometry, name=name, friction=friction, in_space=in_space)
        except GroundError as error:
            raise task.error(("contacts", name, "surface"), str(error)) from error
        except RobotError as error:
            raise task.error(("contacts", name, "frame"), str(error)) from error
        contacts.append(
            _with_reserve(
                task,
                replace(contact, slip_distance=_slip_distance(task, contact), restitution=_restitution(task, name)),
            )
        )
    return contacts


def _slip_distance(task: Task, contact: Contact) -> float:
    """Return the distance, m, that a contact may slip, infinite without a limit.

    Raises:
        TaskError: slipping is forbidden or limited where nothing could prevent it, or to the step form.
    """
    slipping = task.contacts[contact.name].slipping
    if slipping in ("allowed", "auto"):
        return np.inf
    key, found = ("contacts", contact.name, "slipping"), "'forbidden'" if slipping == "forbidden" else f"{slipping:g}"
    if contact.friction == 0:
        raise task.error(key, f"found {found} for a contact without friction, expected friction greater than 0")
    if task.method.formulation.type != "multipliers":
        raise task.error(key, f"found {found} beside method.formulation.type 'steps', expected 'multipliers'")
    if slipping != "forbidden" and contact.in_space:
        raise task.error(key, f"found {found} for a contact in space, expected 'allowed', 'forbidden' or 'auto'")
    return 0.0 if slipping == "forbidden" else float(slipping)


def _with_reserve(task: Task, contact: Contact) -> Contact:
    """Return a contact with its reserve of friction; one without friction has none.

    Raises:
        TaskError: the contact's own reserve where it has no friction, or one of a contact that may slip or bounce in a
            form of contact that does not know whether it sticks.
    """
    reserve, own = reserve_of(task, contact.name), bool(task.contacts[contact.name].reserve)
    key = ("contacts", contact.name, "reserve") if own else ("reserve", "friction")
    if own and contact.friction == 0:
        raise task.error(key, f"found {reserve:g} for a contact without friction, expected friction greater than 0")
    if reserve == 0 or contact.friction == 0:
        return contact
    what = f"found {reserve:g} for contact '{contact.name}', which may slip or bounce, beside"
    if not contact.comes_to_rest and task.method.formulation.type != "multipliers":
        raise task.error(key, f"{what} method.formulation.type 'steps', expected 'multipliers', or a reserve of 0")
    if not contact.comes_to_rest and task.method.contact == "impulses":
        raise task.error(key, f"{what} method.contact 'impulses', expected 'freezing', or slipping 'forbidden'")
    return replace(contact, reserve=reserve)


def _restitution(task: Task, name: str) -> float:
    """Return the coefficient of restitution of a contact.

    Raises:
        TaskError: the published form of contact, whose impacts are inelastic, is asked for.
    """
    restitution = restitution_of(task, name)
    if restitution > 0 and task.method.formulation.type != "multipliers":
        raise task.error(
            "method.formulation.type",
            f"found 'steps' beside a restitution of {restitution:g} of contact '{name}', expected 'multipliers', or a "
            "restitution of 0",
        )
    return restitution


def gap_function(dynamics: MultibodyDynamics, contacts: Sequence[Contact]) -> ca.Function:
    """Return q -> gaps of all contacts, m, (n_c); it is made once."""
    return _gaps(Identity(dynamics.configuration, *contacts))


@lru_cache(maxsize=16)
def _gaps(parts: Identity) -> ca.Function:
    configuration, *contacts = cast(tuple[Any, ...], parts.parts)
    return ca.Function("gap", [configuration], [ca.vertcat(*[contact.gap for contact in contacts])])
