"""The trajectory of a plan as named columns."""

from __future__ import annotations

import numpy as np

from fesd_robot.plans.plan import Plan


def columns_of(plan: Plan) -> dict[str, np.ndarray]:
    """Return the trajectory as named columns with units, controls held over their interval."""
    trajectory, units = plan.trajectory, plan.units
    columns = {"time [s]": trajectory.time}
    for name, values in trajectory.configuration.items():
        columns[f"{name} [{units.configuration[name]}]"] = values
    for name, values in trajectory.velocity.items():
        columns[f"{name} velocity [{units.velocity[name]}]"] = values
    starts = plan.controls["time"]
    interval = np.clip(np.searchsorted(starts, trajectory.time - 1e-9, side="right") - 1, 0, len(starts) - 1)
    for name, values in plan.controls.items():
        if name != "time":
            columns[f"{name} [{units.controls[name]}]"] = values[interval]
    for name, contact in plan.contacts.items():
        columns[f"{name} gap [m]"] = contact.gap
        columns[f"{name} normal force [N]"] = contact.normal_force
        columns[f"{name} tangential force [N]"] = contact.tangential_force
    return columns
