"""The trajectory of a plan as named columns."""

from __future__ import annotations

import numpy as np

from fesd_robot.instants import SAME_NODE
from fesd_robot.orientations import columns_with_angles
from fesd_robot.plans.full_model import BASE_UNITS, FullModelMotion
from fesd_robot.plans.plan import Plan

CONTROL_CONVENTION = (
    "controls are constant on every interval; a sample at the end of an interval carries those of the interval that "
    "ends there, the second sample of an impact those that act from then on"
)
"""Which controls and efforts belong to a sample, in all exports."""


def control_interval(plan: Plan) -> np.ndarray:
    """Return the control interval of every sample, by `CONTROL_CONVENTION`; integers, (n,).

    The force of a contact and the acceleration at a sample are those under these controls, so that the equations of
    motion hold at every sample.
    """
    time, starts = plan.trajectory.time, plan.controls["time"]
    margin = SAME_NODE * (starts[1] - starts[0] if len(starts) > 1 else 1.0)
    second = np.append(False, np.diff(time) <= margin)
    moment = np.where(second, time + margin, time - margin)
    return np.clip(np.searchsorted(starts, moment, side="right") - 1, 0, len(starts) - 1)


def columns_of(plan: Plan) -> dict[str, np.ndarray]:
    """Return the trajectory as named columns with units, controls by `CONTROL_CONVENTION`.

    First the plan's own coordinates, with roll, pitch and yaw behind those of orientations, controls, contacts and dry
    friction of joints, then all joints of the model file, its base, and the feet of contacts that stand for several.
    """
    trajectory, units = plan.trajectory, plan.units
    columns = {"time [s]": trajectory.time}
    for name, values in trajectory.configuration.items():
        columns[f"{name} [{units.configuration[name]}]"] = values
    for name, values in columns_with_angles(trajectory.configuration).items():
        if name not in trajectory.configuration:
            columns[f"{name} [rad]"] = values
    for name, values in trajectory.velocity.items():
        columns[f"{name} velocity [{units.velocity[name]}]"] = values
    for name, values in trajectory.acceleration.items():
        columns[f"{name} acceleration [{units.velocity[name]}²]"] = values
    interval = control_interval(plan)
    for name, values in plan.controls.items():
        if name != "time":
            columns[f"{name} [{units.controls[name]}]"] = values[interval]
    for name, contact in plan.contacts.items():
        columns[f"{name} gap [m]"] = contact.gap
        columns[f"{name} normal force [N]"] = contact.normal_force
        columns[f"{name} tangential force [N]"] = contact.tangential_force
        if contact.lateral_force is not None:
            columns[f"{name} lateral force [N]"] = contact.lateral_force
    for name, joint in plan.joint_friction.items():
        columns[f"{name} dry friction [{joint.unit}]"] = joint.force
    return columns | (_full_model_columns(plan.full_model) if plan.full_model else {})


def _full_model_columns(model: FullModelMotion) -> dict[str, np.ndarray]:
    columns: dict[str, np.ndarray] = {}
    for name, joint in model.joints.items():
        columns[f"joint {name} position [{joint.unit}]"] = joint.position
        columns[f"joint {name} velocity [{joint.unit}/s]"] = joint.velocity
        columns[f"joint {name} effort [{joint.effort_unit}]"] = joint.effort
    for name, values in (model.base or {}).items():
        columns[f"base {name} [{BASE_UNITS[name]}]"] = values
    for name, foot in model.feet.items():
        columns[f"foot {name} normal force [N]"] = foot.normal_force
        columns[f"foot {name} tangential force [N]"] = foot.tangential_force
    return columns
