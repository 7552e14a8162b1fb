"""The trajectory of a plan as tables: named columns, CSV, numpy arrays."""

from __future__ import annotations

import csv
import io

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


def csv_table(plan: Plan) -> bytes:
    """Return the trajectory as CSV with a header of names and units; an impact stands twice at the same time."""
    columns, stream = columns_of(plan), io.StringIO(newline="")
    writer = csv.writer(stream)
    writer.writerow([*columns, *(f"{name} mode" for name in plan.contacts)])
    modes = [contact.mode for contact in plan.contacts.values()]
    for row in zip(*[values.tolist() for values in columns.values()], *modes, strict=True):
        writer.writerow([repr(value) if isinstance(value, float) else value for value in row])
    return stream.getvalue().encode()


def npz_arrays(plan: Plan) -> bytes:
    """Return an archive of numpy arrays: time, configuration (n, n_q), velocity (n, n_v), controls, contacts."""
    trajectory = plan.trajectory
    arrays = {
        "time": trajectory.time,
        "configuration": np.column_stack(list(trajectory.configuration.values())),
        "velocity": np.column_stack(list(trajectory.velocity.values())),
        "configuration_names": np.array(list(trajectory.configuration)),
        "velocity_names": np.array(list(trajectory.velocity)),
        "control_names": np.array([name for name in plan.controls if name != "time"]),
        "control_time": plan.controls["time"],
        "control": np.column_stack([values for name, values in plan.controls.items() if name != "time"]),
        "contact_names": np.array(list(plan.contacts)),
        "gap": np.column_stack([contact.gap for contact in plan.contacts.values()]),
        "normal_force": np.column_stack([contact.normal_force for contact in plan.contacts.values()]),
        "tangential_force": np.column_stack([contact.tangential_force for contact in plan.contacts.values()]),
        "mode": np.column_stack([contact.mode for contact in plan.contacts.values()]),
    }
    content = io.BytesIO()
    np.savez_compressed(content, **arrays)  # type: ignore[arg-type]
    return content.getvalue()
