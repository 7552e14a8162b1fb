"""From a task and its robot to an optimal control problem with contact, and to others that differ in numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin

from fesd_robot.contact import (
    CompliantContact,
    Contact,
    ContactOptions,
    ContactSystem,
    MultibodyDynamics,
    Scene,
    StepOptions,
)
from fesd_robot.contact import contact_system as build_contact_system
from fesd_robot.errors import OptionError
from fesd_robot.fesd import CrossComplementarity, FesdOptions, OptimalControlProblem, make_tableau
from fesd_robot.ocp.actuation import Actuation
from fesd_robot.ocp.checks import check_forces, check_inertia, check_pace, check_size
from fesd_robot.ocp.constants import Constants, constant_values
from fesd_robot.ocp.constraints import add_forbidden_zones, with_swing_speeds
from fesd_robot.ocp.contact_places import names_of_places, with_names_of_places
from fesd_robot.ocp.default_costs import RobotScales, reference_posture, scales_of, with_default_costs
from fesd_robot.ocp.default_tolerances import with_default_tolerances
from fesd_robot.ocp.guess import guess_of
from fesd_robot.ocp.parts import ProblemParts
from fesd_robot.ocp.points import points_of
from fesd_robot.ocp.problem import ocp_numbers, optimal_control_problem
from fesd_robot.ocp.reference_motion import ReferenceMotion
from fesd_robot.ocp.reference_spline import ReferenceSpline, window_size
from fesd_robot.ocp.reference_types import reference_of
from fesd_robot.ocp.rolling import Rolling, rollings_of
from fesd_robot.ocp.setup import Setup, gap_function
from fesd_robot.ocp.standing import with_configurations
from fesd_robot.ocp.start import check_above_ground, closed_at_start, touching_at_start
from fesd_robot.ocp.targets import check_targets
from fesd_robot.ocp.timing import TimeGrid, time_grid
from fesd_robot.ocp.vectors import Endpoints, StateLimits, endpoints_of, limits_of
from fesd_robot.robot import STANDARD_GRAVITY, Robot
from fesd_robot.task import COST_TERMS, GROUND, KeyPath, Task

AUTOMATIC_AUXILIARY_FORCE = 10.0
"""Automatic a_n in units of the robot's weight: a resting contact then slows the clock by a tenth."""

NUMBERS = ("initial", "goal", "waypoints", "reference", "costs", "solver")
"""Sections of a task whose numbers may be others in the same equations."""


@dataclass(frozen=True)
class MotionProblem:
    """A task with everything that was derived from it on the way to the optimal control problem.

    Attributes:
        setup: what was decided once.
        parts: what costs, constraints and bounds were built from.
        task: completed: with the configurations that its postures and `stand_on` give, the tolerances of a hard
            goal, and the weights that it leaves out.
        default_costs: keys of `costs` whose weights it left out.
        scales: units of the robot, in which these count.
        rollings: what rolls, whose coordinates have no default weights where they have to follow others.
    """

    setup: Setup
    parts: ProblemParts
    task: Task
    default_costs: tuple[str, ...]
    scales: RobotScales
    rollings: Sequence[Rolling]
    ocp: OptimalControlProblem
    fesd: FesdOptions

    @property
    def robot(self) -> Robot:
        """With frames at its contacts."""
        return self.setup.robot

    @property
    def scene(self) -> Scene:
        """Ground, walls and the shapes that touch."""
        return self.setup.scene

    @property
    def dynamics(self) -> MultibodyDynamics:
        """Of the robot, as expressions."""
        return self.parts.dynamics

    @property
    def actuation(self) -> Actuation:
        """The controls."""
        return self.parts.actuation

    @property
    def contacts(self) -> Sequence[Contact]:
        """Those that are rigid, as expressions, closed where they are at the start."""
        return self.parts.contacts

    @property
    def compliant(self) -> Sequence[CompliantContact]:
        """The contacts that give way, as expressions."""
        return self.parts.compliant

    @property
    def every_contact(self) -> list[str]:
        """Names of the rigid contacts, and behind them of those that give way."""
        return [*(one.name for one in self.contacts), *(one.name for one in self.compliant)]

    @property
    def contact_system(self) -> ContactSystem:
        """The complementarity system."""
        return self.parts.contact_system

    @property
    def auxiliary_force(self) -> float:
        """a_n, N."""
        return self.parts.auxiliary_force

    @property
    def endpoints(self) -> Endpoints:
        """Start and goal."""
        return self.parts.endpoints

    @property
    def limits(self) -> StateLimits:
        """Of positions and velocities."""
        return self.parts.limits

    @property
    def reference(self) -> ReferenceMotion:
        """The motion that the costs compare with."""
        return self.parts.reference

    @property
    def reference_spline(self) -> ReferenceSpline:
        """The reference as a function of time."""
        return self.parts.reference_spline

    @property
    def grid(self) -> TimeGrid:
        """The control intervals in time."""
        return self.parts.grid

    @property
    def in_space(self) -> bool:
        """Whether contacts may slip in two directions; all of a robot's do, or none."""
        return any(contact.in_space for contact in self.contacts)

    def with_numbers_of(self, task: Task) -> MotionProblem:
        """Return the problem of another task that differs from this one in numbers: no function is made for it.

        Start, goal, waypoints, reference and weights may be others. What was decided from the start of the first task,
        as which places of a body touch, stays. Whether path constraints hold at the start is not looked at.

        Args:
            task: from `load_task`, of the same robot and ground.

        Raises:
            OptionError: something else is different, so that the equations are; the message names it.
            TaskError: a value that this robot cannot satisfy.
        """
        setup, robot, limits, parts = self.setup, self.robot, self.limits, self.parts
        _check_same_equations(setup.asked, task)
        asked = with_names_of_places(task, names_of_places(setup.asked, setup.task))
        task = self.task.model_copy(update={key: getattr(asked, key) for key in NUMBERS})
        task = with_configurations(task, robot, setup.contacts, self.dynamics.configuration)
        task = with_default_tolerances(task, robot, limits)
        task = with_default_costs(task, robot, self.actuation, self.scales, self.rollings)
        endpoints = endpoints_of(task, robot)
        check_above_ground(task, parts.gap, endpoints)
        if task.goal.periodic is None:
            endpoints = touching_at_start(robot, self.contacts, self.dynamics, endpoints, limits, exactly=True)
        check_inertia(task, robot, endpoints.initial_configuration)
        check_forces(task, self.actuation, endpoints.initial_configuration)
        check_pace(task, robot, endpoints, limits, self.grid)
        reference = reference_of(task, robot, endpoints, limits, self.grid)
        spline = ReferenceSpline.of(reference, robot.configuration_names)
        numbers = constant_values(task, endpoints)
        _check_same_keys(parts.constants.numbers, numbers)
        parts = replace(
            parts,
            task=task,
            endpoints=endpoints,
            reference=reference,
            reference_spline=spline,
            guess=guess_of(task, robot, reference, self.grid.nominal),
            values=np.array(list(numbers.values())),
        )
        constraints = [
            one if one.values is None or (values := parts.constants.read(one.parameters, parts.values)) is None
            else replace(one, values=values)
            for one in self.ocp.constraints
        ]  # fmt: skip
        check_targets(parts, constraints)
        ocp = replace(self.ocp, constraints=constraints, **ocp_numbers(parts))
        return replace(self, parts=parts, task=task, ocp=ocp)


def _check_same_equations(asked: Task, other: Task) -> None:
    """Refuse a task that differs in more than numbers.

    Raises:
        OptionError: the message names the section.
    """
    for section in type(asked).model_fields:
        if section not in NUMBERS and getattr(asked, section) != getattr(other, section):
            raise OptionError(f"another '{section}' changes the equations of the task, expected other numbers only")
    masked = [_without_numbers({key: getattr(task, key) for key in ("goal", "waypoints")}) for task in (asked, other)]
    if masked[0] != masked[1]:
        raise OptionError("another goal has other names, tolerances or weights, expected other numbers only")


def _check_same_keys(known: Mapping[KeyPath, int], found: Mapping[KeyPath, float]) -> None:
    for key in [*known, *found]:
        if (key in known) != (key in found):
            how = "no longer given" if key in known else "new"
            raise OptionError(f"'{'.'.join(key)}' is {how}, which changes the equations of the task")


def _without_numbers(sections: Mapping[str, Any]) -> Any:
    """Return goal and waypoints without the values that equations know as parameters."""

    def masked(value: Any, within: str) -> Any:
        if isinstance(value, Mapping):
            return {key: masked(one, within if within in VALUES else key) for key, one in value.items()}
        if isinstance(value, list | tuple):
            return [masked(one, within) for one in value]
        return None if within in VALUES and isinstance(value, float | int) else value

    plain = {key: _plain(section) for key, section in sections.items()}
    return masked(plain, "")


def _plain(section: Any) -> Any:
    return [one.model_dump() for one in section] if isinstance(section, list | tuple) else section.model_dump()


VALUES = ("configuration", "velocity", "position", "posture", "stand_on")
"""Keys of a goal under which there are such values."""


def formulate(task: Task, *, driven: bool = True, steps: StepOptions = StepOptions()) -> MotionProblem:
    """Return the optimal control problem of a task.

    Args:
        task: from `load_task`.
        driven: whether a robot without controls is an error; a body that is only let go has none.
        steps: variant of the step form, for tasks with method.formulation.type steps.

    Raises:
        OptionError: a variant of the step form for a task in another form.
        TaskError: a name, value or combination that this robot cannot satisfy, with file, line and key.
    """
    setup = Setup.of(task, driven=driven)
    task, robot, actuation, dynamics, contacts = (
        setup.task,
        setup.robot,
        setup.actuation,
        setup.dynamics,
        setup.contacts,
    )
    task = with_configurations(task, robot, contacts, dynamics.configuration)
    limits = limits_of(task, robot)
    task = with_default_tolerances(task, robot, limits)
    grid = time_grid(task)
    scales = scales_of(task, robot)
    default_costs = tuple(key for key in COST_TERMS if getattr(task.costs, key) is None)
    rollings = rollings_of(task, robot, setup.scene, reference_posture(robot), limits)
    task = with_swing_speeds(with_default_costs(task, robot, actuation, scales, rollings), scales)
    endpoints = endpoints_of(task, robot)
    check_above_ground(task, gap_function(dynamics, contacts), endpoints)
    if task.goal.periodic is None:
        endpoints = touching_at_start(robot, contacts, dynamics, endpoints, limits)
        contacts = closed_at_start(contacts, dynamics, endpoints)
    check_inertia(task, robot, endpoints.initial_configuration)
    check_forces(task, actuation, endpoints.initial_configuration)
    auxiliary_force = _auxiliary_force(task, robot)
    n_q, numbers = len(robot.configuration_names), constant_values(task, endpoints)
    compared = ca.SX.sym("reference", window_size(n_q) if grid.moving else n_q + 1)
    constants, formulation = Constants.of(numbers), task.method.formulation
    contact_system = build_contact_system(
        dynamics,
        contacts,
        ContactOptions(
            transcription=task.method.contact,
            form=formulation.type,
            baumgarte_gain=formulation.baumgarte_gain,
            auxiliary_force=auxiliary_force,
            steps=steps,
        ),
        ca.vertcat(compared, constants.symbols),
        setup.compliant,
    )
    points = points_of(task, robot, dynamics.configuration, dynamics.velocity)
    contact_system = add_forbidden_zones(task, contact_system, contacts, points, endpoints.initial_configuration)
    check_pace(task, robot, endpoints, limits, grid)
    reference = reference_of(task, robot, endpoints, limits, grid)
    parts = ProblemParts(
        task=task,
        dynamics=dynamics,
        actuation=actuation,
        contacts=contacts,
        compliant=setup.compliant,
        contact_system=contact_system,
        ground=setup.scene.surfaces[GROUND],
        gap=gap_function(dynamics, contacts),
        auxiliary_force=auxiliary_force,
        endpoints=endpoints,
        limits=limits,
        reference=reference,
        guess=guess_of(task, robot, reference, grid.nominal),
        grid=grid,
        points=points,
        compared=compared,
        constants=constants,
        values=np.array(list(numbers.values())),
        reference_spline=ReferenceSpline.of(reference, robot.configuration_names),
    )
    ocp = optimal_control_problem(parts)
    check_targets(parts, ocp.constraints)
    options = FesdOptions(
        tableau=make_tableau(task.method.scheme, task.method.stages),
        elements=task.method.elements,
        cross_complementarity=_aggregation(task),
        step_equilibration=task.method.step_equilibration.type,
        equilibration_weight=task.method.step_equilibration.weight,
        step_freedom=task.method.step_freedom,
    )
    if driven:
        check_size(task, ocp, options)
    return MotionProblem(
        setup=setup,
        parts=parts,
        task=task,
        default_costs=default_costs,
        scales=scales,
        rollings=rollings,
        ocp=ocp,
        fesd=options,
    )


def _aggregation(task: Task) -> CrossComplementarity:
    return "theta_sum" if task.method.formulation.type == "multipliers" else "lambda_sum"


def _auxiliary_force(task: Task, robot: Robot) -> float:
    chosen = task.method.auxiliary_force
    if chosen != "auto":
        return float(chosen)
    gravity = float(np.linalg.norm(robot.model.gravity.linear)) or STANDARD_GRAVITY
    weight = pin.computeTotalMass(robot.model) * gravity
    if not task.contacts:
        return 1.0  # N; nothing pushes with it
    if weight <= 0:
        raise task.error(
            "method.auxiliary_force",
            "found 'auto' for a robot without weight, expected a number greater than 0 (N)",
        )
    return AUTOMATIC_AUXILIARY_FORCE * weight
