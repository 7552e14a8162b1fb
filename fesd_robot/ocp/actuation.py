"""What can push: the controls of a task as columns of generalized forces."""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np

from fesd_robot.robot import Robot
from fesd_robot.robot.units import velocity_units
from fesd_robot.task import GeneralizedForceActuator, JointActuator, Task, evaluate_expression

_CASADI_FUNCTIONS = {"sin": ca.sin, "cos": ca.cos, "tan": ca.tan, "sqrt": ca.sqrt, "exp": ca.exp}


@dataclass(frozen=True)
class Actuation:
    """Controls u with generalized force B(q) u.

    Attributes:
        names: control names, (n_u).
        lower, upper: bounds, N or N m, (n_u).
        units: ``N`` or ``N m`` by control, that of the first coordinate it pushes.
        matrix: q -> B, CasADi function, (n_v, n_u).
    """

    names: list[str]
    lower: np.ndarray
    upper: np.ndarray
    units: list[str]
    matrix: ca.Function


def actuators_of(task: Task, robot: Robot) -> dict[str, JointActuator | GeneralizedForceActuator]:
    """Return the task's actuators; by default one for every joint with a positive effort limit."""
    if task.robot.actuators is not None:
        return dict(task.robot.actuators)
    return {
        name: JointActuator(type="joint", joint=name)
        for name, effort in zip(robot.velocity_names, robot.effort_limit, strict=True)
        if effort > 0 and name in robot.model.names
    }


def build_actuation(task: Task, robot: Robot) -> Actuation:
    """Return the control directions and bounds of a task.

    Raises:
        TaskError: no control at all, or a joint actuator that has neither bounds in the task nor in the model, or that
            drives a joint with more than one degree of freedom.
    """
    actuators = actuators_of(task, robot)
    if not actuators:
        raise task.error(
            "robot", "found no actuators and no joint with an effort limit in the model, expected an entry 'actuators'"
        )
    q = ca.SX.sym("q", len(robot.configuration_names))
    values = dict(zip(robot.configuration_names, ca.vertsplit(q), strict=True))
    speed_units = velocity_units(robot)
    columns, lower, upper, units = [], [], [], []
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
        units.append("N" if speed_units[first] == "m/s" else "N m")
    matrix = ca.Function("B", [q], [ca.horzcat(*columns)])
    return Actuation(list(actuators), np.array(lower), np.array(upper), units, matrix)


def _joint_drive(task: Task, robot: Robot, name: str, actuator: JointActuator) -> tuple[int, float, float]:
    written = task.robot.actuators is not None
    key = ("robot", "actuators", name, "joint") if written else ("robot",)
    if actuator.joint not in robot.velocity_names:
        raise task.error(
            key, f"found joint '{actuator.joint}' with several degrees of freedom, expected a joint with one; "
            "use type: generalized_force for others"
        )  # fmt: skip
    row = robot.velocity_names.index(actuator.joint)
    effort = float(robot.effort_limit[row])
    low = actuator.lower if actuator.lower is not None else -effort
    high = actuator.upper if actuator.upper is not None else effort
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise task.error(
            key, f"found joint '{actuator.joint}' with effort limits [{low:g}, {high:g}], expected finite bounds with "
            "lower < upper; write 'lower' and 'upper' beside it"
        )  # fmt: skip
    return row, low, high
