"""The controls of a task as columns of generalized forces."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.errors import nearest
from fesd_robot.robot import Robot, angle_expressions, velocity_units
from fesd_robot.task import GeneralizedForceActuator, JointActuator, Task, evaluate_expression

_CASADI_FUNCTIONS = {"sin": ca.sin, "cos": ca.cos, "tan": ca.tan, "sqrt": ca.sqrt, "exp": ca.exp}


@dataclass(frozen=True)
class Actuation:
    """Controls u with generalized force B(q) u.

    Attributes:
        names: control names, (n_u).
        lower, upper: limits, N or N m, (n_u).
        planned_lower, planned_upper: bounds of what a plan may use of them, N or N m, (n_u).
        units: ``N`` or ``N m`` by control, that of the first coordinate it pushes.
        matrix: q -> B, CasADi function, (n_v, n_u).
    """

    names: list[str]
    lower: np.ndarray
    upper: np.ndarray
    planned_lower: np.ndarray
    planned_upper: np.ndarray
    units: list[str]
    matrix: ca.Function

    @cached_property
    def numeric(self) -> Callable[[np.ndarray], np.ndarray]:
        """The function q -> B in numbers, (n_v, n_u); directions that do not depend on q are computed once."""
        if self.matrix.jac_sparsity(0, 0).nnz():
            return lambda q: np.asarray(self.matrix(q).full())
        constant = np.asarray(self.matrix(0).full())
        return lambda _: constant


def actuators_of(task: Task, robot: Robot) -> dict[str, JointActuator | GeneralizedForceActuator]:
    """Return the task's actuators; by default one for every joint with an effort limit that is not said to be passive.

    Joints of the root move nothing by themselves, and joints without an effort limit may well have no motor. Motors of
    the model file that push several joints follow.
    """
    if task.robot.actuators is not None:
        return dict(task.robot.actuators)
    driven = dict(zip(robot.velocity_names, robot.driven, strict=True))
    single = {
        name: JointActuator(type="joint", joint=name)
        for name in robot.joint_names
        if name in driven
        and name not in robot.root_names
        and name not in task.robot.passive
        and (driven[name] or name in task.limits.effort)
    }
    several = {
        name: GeneralizedForceActuator(
            type="generalized_force", force=dict(drive.force), lower=drive.lower, upper=drive.upper
        )
        for name, drive in robot.drives.items()
    }
    return {**single, **several}


def build_actuation(task: Task, robot: Robot) -> Actuation:
    """Return the control directions and bounds of a task.

    Raises:
        TaskError: a joint actuator that has neither bounds in the task nor in the model, that has
            them twice in the task, or that drives a joint with more than one degree of freedom, or an effort limit of a
            joint that no actuator drives.
    """
    actuators = actuators_of(task, robot)
    _check_effort_limits(task, actuators)
    q = ca.SX.sym("q", len(robot.configuration_names))
    values = dict(zip(robot.configuration_names, ca.vertsplit(q), strict=True))
    values |= angle_expressions(robot.configuration_names, q)
    speed_units = velocity_units(robot)
    columns, lower, upper, planned, units = [], [], [], [], []
    for name, actuator in actuators.items():
        column = ca.SX(len(robot.velocity_names), 1)
        if isinstance(actuator, JointActuator):
            row, low, high = _joint_drive(task, robot, name, actuator)
            column[row] = 1
            first = actuator.joint
        else:
            low, high = actuator.lower, actuator.upper
            first = next(iter(actuator.force))
            for coordinate, force in actuator.force.items():
                value = evaluate_expression(force, values, _CASADI_FUNCTIONS)
                column[robot.velocity_names.index(coordinate)] = value
        columns.append(column)
        lower.append(low)
        upper.append(high)
        planned.append(_planned(task, name, actuator, (low, high)))
        units.append("N" if speed_units[first] == "m/s" else "N m")
    directions = ca.horzcat(*columns) if columns else ca.SX(len(robot.velocity_names), 0)
    matrix = ca.Function("B", [q], [directions])
    planned_lower, planned_upper = np.array(planned).reshape(-1, 2).T
    return Actuation(
        names=list(actuators),
        lower=np.array(lower),
        upper=np.array(upper),
        planned_lower=planned_lower,
        planned_upper=planned_upper,
        units=units,
        matrix=matrix,
    )


def _planned(
    task: Task, name: str, actuator: JointActuator | GeneralizedForceActuator, limits: tuple[float, float]
) -> tuple[float, float]:
    """Return what a plan may use of the limits of a control, each of which is a largest size of its sign.

    Raises:
        TaskError: limits of one sign between which the reserve leaves nothing.
    """
    own = actuator.reserve is not None
    reserve = task.reserve.effort if actuator.reserve is None else actuator.reserve
    low, high = limits
    planned = low * (1 - reserve) if low < 0 else low, high * (1 - reserve) if high > 0 else high
    if not planned[0] < planned[1]:
        raise task.error(
            ("robot", "actuators", name, "reserve") if own else ("reserve", "effort"),
            f"found {reserve:g}, which leaves nothing of the limits [{low:g}, {high:g}] of '{name}', expected less",
        )
    return planned


def check_driven(task: Task, robot: Robot) -> None:
    """Raise if a task that is to be planned leaves nothing to choose.

    Raises:
        TaskError: the robot has no control at all.
    """
    if not actuators_of(task, robot):
        raise task.error(
            "robot",
            "found no actuators and no joint with an effort limit that is not passive, expected an entry 'actuators' "
            "or one in limits.effort; without controls it can only be simulated",
        )


def one_at_a_time_of(task: Task, actuation: Actuation) -> dict[str, dict[str, list[str]]]:
    """Return the groups of a task's controls of which one set acts at a time.

    Raises:
        TaskError: a control that may be negative, or a control grid or form of contact that does not know such groups.
    """
    groups = task.robot.one_at_a_time
    if not groups:
        return {}
    key = ("robot", "one_at_a_time")
    for option, found, expected in (
        ("formulation.type", task.method.formulation.type, "multipliers"),
        ("contact", task.method.contact, "freezing"),
    ):
        if found != expected:
            raise task.error(f"method.{option}", f"found '{found}' beside robot.one_at_a_time, expected '{expected}'")
    lower = dict(zip(actuation.names, actuation.lower, strict=True))
    for group, sets in groups.items():
        for name, controls in sets.items():
            for i, control in enumerate(controls):
                if lower[control] < 0:
                    raise task.error(
                        (*key, group, name, str(i)),
                        f"found control '{control}', which may be as low as {lower[control]:g}, expected one with "
                        "lower: 0, and a second one for the other direction",
                    )
    return {group: {name: list(controls) for name, controls in sets.items()} for group, sets in groups.items()}


def _joint_drive(task: Task, robot: Robot, name: str, actuator: JointActuator) -> tuple[int, float, float]:
    written = task.robot.actuators is not None
    key = ("robot", "actuators", name, "joint") if written else ("robot",)
    if actuator.joint not in robot.velocity_names:
        raise task.error(
            key, f"found joint '{actuator.joint}' with several degrees of freedom, expected a joint with one; "
            "use type: generalized_force for others"
        )  # fmt: skip
    row = robot.velocity_names.index(actuator.joint)
    own = float(robot.lower_effort[row]), float(robot.upper_effort[row])
    low, high = task.limits.effort.get(actuator.joint, own)
    low = actuator.lower if actuator.lower is not None else low
    high = actuator.upper if actuator.upper is not None else high
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        limited = actuator.joint in task.limits.effort
        limits = f"with effort limits [{low + 0.0:g}, {high:g}]" if low or high else "without effort limit"
        raise task.error(
            ("limits", "effort", actuator.joint) if limited else key,
            f"found joint '{actuator.joint}' {limits}, expected finite bounds with lower < upper"
            + ("" if limited else "; write 'lower' and 'upper' beside it"),
        )
    return row, low, high


def _check_effort_limits(task: Task, actuators: Mapping[str, JointActuator | GeneralizedForceActuator]) -> None:
    """Refuse effort limits of joints that are not driven, or that have bounds in their actuator already."""
    drives = {each.joint: name for name, each in actuators.items() if isinstance(each, JointActuator)}
    for joint in task.limits.effort:
        key = ("limits", "effort", joint)
        if joint not in drives:
            raise task.error(
                key, f"found joint '{joint}', expected one that an actuator drives{nearest(joint, drives)}"
            )
        actuator = actuators[drives[joint]]
        if actuator.lower is not None or actuator.upper is not None:
            raise task.error(
                key, f"found limits of joint '{joint}', whose actuator '{drives[joint]}' has its own, expected them in "
                "one place"
            )  # fmt: skip
