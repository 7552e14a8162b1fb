"""From a task and its robot to an optimal control problem with contact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
import pinocchio as pin

from fesd_robot.contact import (
    ContactOptions,
    ContactSystem,
    Mechanics,
    PlanarContact,
    Surroundings,
    pair_contact,
)
from fesd_robot.contact import contact_system as build_contact_system
from fesd_robot.errors import RobotError
from fesd_robot.fesd import CrossComplementarity, FesdOptions, OptimalControlProblem, make_tableau
from fesd_robot.ocp.actuation import Actuation, actuators_of, build_actuation
from fesd_robot.ocp.ground import friction_of, surroundings_of
from fesd_robot.ocp.reference import ReferenceMotion, reference_of
from fesd_robot.ocp.vectors import Endpoints, StateLimits, endpoints_of, limits_of, vector
from fesd_robot.robot import (
    Robot,
    configuration_derivative,
    load_robot,
    mass_matrix,
    nonlinear_effects,
)
from fesd_robot.task import CircleCircleContact, Task, check_names, check_values

AUTOMATIC_STRENGTH = 10.0
"""Automatic a_n in units of the robot's weight: a resting contact then slows the clock by a tenth."""

_BELOW_GROUND = 1e-6
"""m; a start this far below the ground is on it, rounded."""


@dataclass(frozen=True)
class MotionProblem:
    """A task with everything that was derived from it on the way to the optimal control problem."""

    task: Task
    robot: Robot
    ground: Surroundings
    mechanics: Mechanics
    actuation: Actuation
    contacts: Sequence[PlanarContact]
    contact_system: ContactSystem
    auxiliary_acceleration: float
    endpoints: Endpoints
    limits: StateLimits
    reference: ReferenceMotion
    ocp: OptimalControlProblem
    fesd: FesdOptions


def formulate(task: Task) -> MotionProblem:
    """Return the optimal control problem of a task.

    Raises:
        TaskError: a name, value or combination that this robot cannot satisfy, with file, line and key.
    """
    robot = _load(task)
    actuation = build_actuation(task, robot)
    endpoints, limits = endpoints_of(task, robot), limits_of(task, robot)
    ground = surroundings_of(task)
    mechanics = _mechanics(robot, actuation)
    contacts = _contacts(task, robot, mechanics.configuration, ground)
    gap = ca.Function("gap", [mechanics.configuration], [ca.vertcat(*[contact.gap for contact in contacts])])
    _check_above_ground(task, gap, endpoints)
    strength = _auxiliary_acceleration(task, robot)
    formulation = task.method.formulation
    n_q = len(robot.configuration_names)
    parameters = ca.SX.sym("reference", n_q + 1)
    contact_system = build_contact_system(
        mechanics,
        contacts,
        ContactOptions(
            form=formulation.type,
            gap=formulation.gap,
            gap_feedback=formulation.gap_feedback,
            gate=formulation.gate,
            selection_weight=formulation.step_selection_weight,
            auxiliary_acceleration=strength,
        ),
        parameters,
    )
    reference = reference_of(task, robot, endpoints)
    return MotionProblem(
        task=task,
        robot=robot,
        ground=ground,
        mechanics=mechanics,
        actuation=actuation,
        contacts=contacts,
        contact_system=contact_system,
        auxiliary_acceleration=strength,
        endpoints=endpoints,
        limits=limits,
        reference=reference,
        ocp=_optimal_control_problem(
            task, mechanics, actuation, contact_system, gap, endpoints, limits, reference, parameters
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
    chosen = task.method.cross_complementarity
    if chosen != "auto":
        return chosen
    return "theta_sum" if task.method.formulation.type == "multipliers" else "lambda_sum"


def _load(task: Task) -> Robot:
    """Load the robot and check every name and value of the task against it."""
    source = task.locate_model()
    try:
        bare = load_robot(source, root=task.robot.root)
    except RobotError as error:
        raise task.error("robot.model", str(error)) from error
    check_names(
        task,
        bare.configuration_names,
        bare.velocity_names,
        list(bare.model.names)[1:],
        bare.frame_names,
        list(actuators_of(task, bare)),
    )
    robot = load_robot(source, root=task.robot.root, armature=task.robot.armature)
    positions = zip(robot.lower_position, robot.upper_position, strict=True)
    check_values(
        task,
        dict(zip(robot.configuration_names, positions, strict=True)),
        {name: (-v, v) for name, v in zip(robot.velocity_names, robot.velocity_limit, strict=True)},
    )
    return robot


def _mechanics(robot: Robot, actuation: Actuation) -> Mechanics:
    q = ca.SX.sym("q", len(robot.configuration_names))
    v = ca.SX.sym("v", len(robot.velocity_names))
    u = ca.SX.sym("u", len(actuation.names))
    return Mechanics(
        configuration=q,
        velocity=v,
        control=u,
        configuration_derivative=configuration_derivative(robot, q, v),
        mass_matrix=mass_matrix(robot, q),
        force=ca.mtimes(actuation.matrix(q), u) - nonlinear_effects(robot, q, v),
        configuration_names=robot.configuration_names,
        velocity_names=robot.velocity_names,
        control_names=actuation.names,
    )


def _contacts(task: Task, robot: Robot, q: ca.SX, ground: Surroundings) -> list[PlanarContact]:
    found = []
    for name, pair in ground.pairs.items():
        try:
            found.append(pair_contact(robot, q, pair, name=name, friction=friction_of(task, name)))
        except RobotError as error:
            raise task.error(("contacts", name, "frame"), str(error)) from error
    return found


def _check_above_ground(task: Task, gap: ca.Function, endpoints: Endpoints) -> None:
    for key, configuration in (
        ("initial", endpoints.initial_configuration),
        ("goal", endpoints.goal_configuration),
    ):
        gaps = np.asarray(gap(configuration)).ravel()
        worst = int(np.argmin(gaps))
        if gaps[worst] < -_BELOW_GROUND:
            name = list(task.contacts)[worst]
            raise task.error((key, "configuration"), _overlap(task, name, -gaps[worst]))


def _overlap(task: Task, name: str, depth: float) -> str:
    contact = task.contacts[name]
    if isinstance(contact, CircleCircleContact):
        return f"found the circles of contact '{name}' overlapping by {depth:.6g} m, expected them apart or touching"
    wall = task.ground.walls.get(contact.surface)
    if wall is None:
        return f"found contact '{name}' {depth:.6g} m below the ground, expected it on or above the ground"
    return (
        f"found contact '{name}' {depth:.6g} m beyond the wall '{contact.surface}', expected it on its {wall.side} side"
    )


def _auxiliary_acceleration(task: Task, robot: Robot) -> float:
    chosen = task.method.auxiliary_acceleration
    if chosen != "auto":
        return float(chosen)
    weight = pin.computeTotalMass(robot.model) * float(np.linalg.norm(robot.model.gravity.linear))
    if weight <= 0:
        raise task.error(
            "method.auxiliary_acceleration",
            "found 'auto' for a robot without weight, expected a number greater than 0 (N)",
        )
    return AUTOMATIC_STRENGTH * weight


def _optimal_control_problem(
    task: Task,
    mechanics: Mechanics,
    actuation: Actuation,
    contact_system: ContactSystem,
    gap: ca.Function,
    endpoints: Endpoints,
    limits: StateLimits,
    reference: ReferenceMotion,
    parameters: ca.SX,
) -> OptimalControlProblem:
    n_q, n_v = mechanics.configuration.numel(), mechanics.velocity.numel()
    q, v, u = mechanics.configuration, mechanics.velocity, mechanics.control
    state = contact_system.system.state
    n_gap = state.numel() - n_q - n_v - 1
    duration, intervals = task.horizon.duration, task.horizon.intervals
    ends = duration * np.arange(1, intervals + 1) / intervals

    def full_state(configuration: np.ndarray, velocity: np.ndarray, time: float) -> np.ndarray:
        gaps = np.maximum(np.asarray(gap(configuration)).ravel(), 0.0) if n_gap else np.zeros(0)
        return np.concatenate([configuration, velocity, [time], gaps])

    def guess(time: float) -> np.ndarray:
        velocity = np.clip(reference.velocity(time), limits.lower_velocity, limits.upper_velocity)
        return full_state(reference.configuration(time), velocity, time)

    def bounds(position: np.ndarray, velocity: np.ndarray, clock: float, gaps: float) -> np.ndarray:
        return np.concatenate([position, velocity, [clock], np.full(n_gap, gaps)])

    initial = full_state(endpoints.initial_configuration, endpoints.initial_velocity, 0.0)
    goal_lower, goal_upper = _goal_box(task, mechanics, endpoints)
    costs, rate = task.costs, contact_system.clock_rate
    deviation = q - parameters[:n_q]
    to_goal, velocity_to_goal = q - endpoints.goal_configuration, v - endpoints.goal_velocity
    names, velocities = mechanics.configuration_names, mechanics.velocity_names

    def square(x: ca.SX, keys: Sequence[str], weights: dict[str, float] | None, default: float) -> ca.SX:
        values = vector(keys, weights or {}, default if weights is None else 0.0)
        return ca.dot(ca.SX(ca.DM(values)), x**2)

    speed = task.limits.speed_of_time
    return OptimalControlProblem(
        system=contact_system.system,
        duration=duration,
        intervals=intervals,
        parameters=np.vstack([np.array([reference.configuration(end) for end in ends]).T, ends]),
        initial_lower=initial,
        initial_upper=initial,
        state_lower=bounds(limits.lower_position, limits.lower_velocity, -np.inf, contact_system.gap_lower),
        state_upper=bounds(limits.upper_position, limits.upper_velocity, np.inf, np.inf),
        terminal_lower=np.concatenate([goal_lower, np.full(1 + n_gap, -np.inf)]),
        terminal_upper=np.concatenate([goal_upper, np.full(1 + n_gap, np.inf)]),
        control_lower=np.append(actuation.lower, speed.lower),
        control_upper=np.append(actuation.upper, speed.upper),
        state_guess=guess,
        control_guess=np.tile(np.append(np.clip(0.0, actuation.lower, actuation.upper), 1.0), (intervals, 1)).T,
        running_cost={
            "configuration": rate * square(deviation, names, costs.configuration, 1.0),
            "velocity": rate * square(v, velocities, costs.velocity, 0.1),
            "control": rate * square(u, mechanics.control_names, costs.control, 1e-3),
        },
        terminal_cost={
            "terminal configuration": square(to_goal, names, costs.terminal_configuration, 100.0),
            "terminal velocity": square(velocity_to_goal, velocities, costs.terminal_velocity, 10.0),
        },
        interval_end=state[n_q + n_v] - parameters[n_q],
        interval_end_names=("clock",),
    )


def _goal_box(task: Task, mechanics: Mechanics, endpoints: Endpoints) -> tuple[np.ndarray, np.ndarray]:
    tolerance = task.goal.tolerance
    width = np.concatenate(
        [
            vector(mechanics.configuration_names, tolerance.configuration, np.inf),
            vector(mechanics.velocity_names, tolerance.velocity, np.inf),
        ]
    )
    goal = np.concatenate([endpoints.goal_configuration, endpoints.goal_velocity])
    return goal - width, goal + width
