"""From a task and its robot to an optimal control problem with contact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import pinocchio as pin

from fesd_robot.contact import (
    Contact,
    ContactOptions,
    ContactSystem,
    MultibodyDynamics,
    Scene,
    contact_of,
    needs_space,
)
from fesd_robot.contact import contact_system as build_contact_system
from fesd_robot.errors import GroundError, RobotError
from fesd_robot.fesd import CrossComplementarity, FesdOptions, OptimalControlProblem, make_tableau
from fesd_robot.ocp.actuation import Actuation, build_actuation, check_driven
from fesd_robot.ocp.checks import (
    check_contacts_move,
    check_dry_friction,
    check_forces,
    check_impulses,
    check_inertia,
    check_pace,
)
from fesd_robot.ocp.constraints import add_forbidden_zones, with_swing_speeds
from fesd_robot.ocp.default_costs import RobotScales, scales_of, with_default_costs
from fesd_robot.ocp.guess import guess_of
from fesd_robot.ocp.parts import ProblemParts
from fesd_robot.ocp.points import points_of
from fesd_robot.ocp.problem import optimal_control_problem
from fesd_robot.ocp.promises import with_promises, with_slipping
from fesd_robot.ocp.reference_motion import ReferenceMotion
from fesd_robot.ocp.reference_spline import ReferenceSpline, window_size
from fesd_robot.ocp.reference_types import reference_of
from fesd_robot.ocp.scene import friction_of, restitution_of, scene_of
from fesd_robot.ocp.standing import GAP_TOLERANCE, touching_configuration, with_configurations
from fesd_robot.ocp.task_robot import load_task_robot
from fesd_robot.ocp.timing import TimeGrid, time_grid
from fesd_robot.ocp.vectors import Endpoints, StateLimits, endpoints_of, initial_configuration, limits_of
from fesd_robot.robot import (
    Robot,
    configuration_derivative,
    damping_force,
    is_height,
    mass_matrix,
    nonlinear_effects,
    spring_force,
)
from fesd_robot.task import COST_TERMS, GROUND, CircleCircleContact, Task, TwoBodyContact

AUTOMATIC_AUXILIARY_FORCE = 10.0
"""Automatic a_n in units of the robot's weight: a resting contact then slows the clock by a tenth."""

TOUCHING = 1e-5
"""m; a contact that starts this close to what it touches is closed: positions are often written with five decimals."""


@dataclass(frozen=True)
class MotionProblem:
    """A task with everything that was derived from it on the way to the optimal control problem.

    Attributes:
        task: completed: with the configurations that its postures and `stand_on` give, the tolerances of what its goal
            promises, and the weights that it leaves out.
        default_costs: keys of `costs` whose weights it left out.
        scales: units of the robot, in which these count.
    """

    task: Task
    default_costs: tuple[str, ...]
    scales: RobotScales
    robot: Robot
    scene: Scene
    dynamics: MultibodyDynamics
    actuation: Actuation
    contacts: Sequence[Contact]
    contact_system: ContactSystem
    auxiliary_force: float
    endpoints: Endpoints
    limits: StateLimits
    reference: ReferenceMotion
    reference_spline: ReferenceSpline
    grid: TimeGrid
    ocp: OptimalControlProblem
    fesd: FesdOptions

    @property
    def in_space(self) -> bool:
        """Whether contacts may slip in two directions; all of a robot's do, or none."""
        return any(contact.in_space for contact in self.contacts)


def formulate(task: Task, *, driven: bool = True) -> MotionProblem:
    """Return the optimal control problem of a task.

    Args:
        task: from `load_task`.
        driven: whether a robot without controls is an error; a body that is only let go has none.

    Raises:
        TaskError: a name, value or combination that this robot cannot satisfy, with file, line and key.
    """
    task, robot = load_task_robot(task)
    task = with_slipping(task)
    check_dry_friction(task, robot)
    if driven:
        check_driven(task, robot)
    actuation = build_actuation(task, robot)
    scene = scene_of(task)
    dynamics = _multibody_dynamics(robot, actuation)
    contacts = _contacts(task, robot, dynamics.configuration, scene)
    check_contacts_move(task, contacts, dynamics.configuration)
    check_impulses(task, dynamics, contacts)
    task = with_configurations(task, robot, contacts, dynamics.configuration)
    limits = limits_of(task, robot)
    task = with_promises(task, robot, limits)
    grid = time_grid(task)
    scales = scales_of(task, robot, initial_configuration(task, robot), grid.nominal)
    default_costs = tuple(key for key in COST_TERMS if getattr(task.costs, key) is None)
    task = with_swing_speeds(with_default_costs(task, robot, actuation, scales), scales)
    endpoints = endpoints_of(task, robot)
    _check_above_ground(task, gap_function(dynamics, contacts), endpoints)
    if task.goal.periodic is None:
        endpoints = _touching_at_start(robot, contacts, dynamics, endpoints, limits)
        contacts = _closed_at_start(contacts, dynamics, endpoints)
    gap = gap_function(dynamics, contacts)
    check_inertia(task, robot, endpoints.initial_configuration)
    check_forces(task, actuation, endpoints.initial_configuration)
    auxiliary_force = _auxiliary_force(task, robot)
    formulation = task.method.formulation
    n_q = len(robot.configuration_names)
    parameters = ca.SX.sym("reference", window_size(n_q) if grid.moving else n_q + 1)
    contact_system = build_contact_system(
        dynamics,
        contacts,
        ContactOptions(
            transcription=task.method.contact,
            form=formulation.type,
            gap=formulation.gap,
            baumgarte_gain=formulation.baumgarte_gain,
            gate=formulation.gate,
            regularisation_weight=formulation.step_regularisation_weight,
            auxiliary_force=auxiliary_force,
        ),
        parameters,
    )
    points = points_of(task, robot, dynamics.configuration, dynamics.velocity)
    contact_system = add_forbidden_zones(task, contact_system, contacts, points, endpoints.initial_configuration)
    check_pace(task, robot, endpoints, limits, grid)
    reference = reference_of(task, robot, endpoints, limits, grid)
    reference_spline = ReferenceSpline.of(reference, robot.configuration_names)
    return MotionProblem(
        task=task,
        default_costs=default_costs,
        scales=scales,
        robot=robot,
        scene=scene,
        dynamics=dynamics,
        actuation=actuation,
        contacts=contacts,
        contact_system=contact_system,
        auxiliary_force=auxiliary_force,
        endpoints=endpoints,
        limits=limits,
        reference=reference,
        reference_spline=reference_spline,
        grid=grid,
        ocp=optimal_control_problem(
            ProblemParts(
                task=task,
                dynamics=dynamics,
                actuation=actuation,
                contacts=contacts,
                contact_system=contact_system,
                ground=scene.surfaces[GROUND],
                gap=gap,
                auxiliary_force=auxiliary_force,
                endpoints=endpoints,
                limits=limits,
                reference=reference,
                guess=guess_of(task, robot, reference, grid.nominal),
                grid=grid,
                points=points,
                parameters=parameters,
                reference_spline=reference_spline,
            )
        ),
        fesd=FesdOptions(
            tableau=make_tableau(task.method.scheme, task.method.stages),
            elements=task.method.elements,
            cross_complementarity=_aggregation(task),
            step_equilibration=task.method.step_equilibration.type,
            equilibration_weight=task.method.step_equilibration.weight,
            step_freedom=task.method.step_freedom,
        ),
    )


def _aggregation(task: Task) -> CrossComplementarity:
    return "theta_sum" if task.method.formulation.type == "multipliers" else "lambda_sum"


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
            replace(contact, slip_distance=_slip_distance(task, contact), restitution=_restitution(task, name))
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
    """Return q -> gaps of all contacts, m, (n_c)."""
    return ca.Function("gap", [dynamics.configuration], [ca.vertcat(*[contact.gap for contact in contacts])])


def _touching_at_start(
    robot: Robot,
    contacts: Sequence[Contact],
    dynamics: MultibodyDynamics,
    endpoints: Endpoints,
    limits: StateLimits,
) -> Endpoints:
    """Return the ends with a start in which contacts touch whose gaps are up to `TOUCHING`, if there is one nearby.

    The heights of robot and bodies are adjusted if that is enough, else all coordinates that are lengths or angles.
    A ground that is lower for the plan by a few micrometres is another one for the foot that lands on it softly.
    """
    start = endpoints.initial_configuration
    near = [
        contact
        for contact, gap in zip(contacts, np.asarray(gap_function(dynamics, contacts)(start)).ravel(), strict=True)
        if abs(gap) <= TOUCHING
    ]
    lengths_and_angles = [name for name in robot.configuration_names if name in robot.velocity_names]
    for adjust in ([name for name in lengths_and_angles if is_height(name)], lengths_and_angles):
        if near and adjust:
            q, gaps = touching_configuration(robot, near, dynamics.configuration, adjust, start, limits)
            if np.abs(gaps).max() <= GAP_TOLERANCE:
                return replace(endpoints, initial_configuration=q)
    return endpoints


def _closed_at_start(contacts: Sequence[Contact], dynamics: MultibodyDynamics, endpoints: Endpoints) -> list[Contact]:
    """Return the contacts with gaps that are exactly zero at the start where what is left of them is up to `TOUCHING`.

    A foot that stands half a micrometre above the ground because of rounding would have to land first, or to push from
    a distance: no point fulfils such a complementarity exactly.
    """
    gaps = np.asarray(gap_function(dynamics, contacts)(endpoints.initial_configuration)).ravel()
    return [
        replace(contact, gap=contact.gap - gap) if 0 < abs(gap) <= TOUCHING else contact
        for contact, gap in zip(contacts, gaps, strict=True)
    ]


def _check_above_ground(task: Task, gap: ca.Function, endpoints: Endpoints) -> None:
    for key, configuration in (
        ("initial", endpoints.initial_configuration),
        ("goal", endpoints.goal_configuration),
    ):
        gaps = np.asarray(gap(configuration)).ravel()
        worst = int(np.argmin(gaps))
        if gaps[worst] < -TOUCHING:
            name = list(task.contacts)[worst]
            raise task.error((key, "configuration"), _overlap(task, name, -gaps[worst]))


def _overlap(task: Task, name: str, depth: float) -> str:
    contact = task.contacts[name]
    if isinstance(contact, TwoBodyContact):
        what = "circles" if isinstance(contact, CircleCircleContact) else "circle and the box"
        return f"found the {what} of contact '{name}' overlapping by {depth:.6g} m, expected them apart or touching"
    if contact.surface == GROUND:
        expected = "on or above the ground"
    else:
        wall = task.ground.walls.get(contact.surface)
        expected = "outside" if wall is None else f"on its {wall.side} side" if wall.side else "on its free side"
    return f"found contact '{name}' {depth:.6g} m {task.inside(contact.surface)}, expected it {expected}"


def _auxiliary_force(task: Task, robot: Robot) -> float:
    chosen = task.method.auxiliary_force
    if chosen != "auto":
        return float(chosen)
    weight = pin.computeTotalMass(robot.model) * float(np.linalg.norm(robot.model.gravity.linear))
    if weight <= 0:
        raise task.error(
            "method.auxiliary_force",
            "found 'auto' for a robot without weight, expected a number greater than 0 (N)",
        )
    return AUTOMATIC_AUXILIARY_FORCE * weight
