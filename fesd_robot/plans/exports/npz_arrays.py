"""All samples as an archive of numpy arrays."""

from __future__ import annotations

import io

import numpy as np

from fesd_robot.plans.exports.format import ExportFormat
from fesd_robot.plans.plan import Plan


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


NPZ = ExportFormat(
    name="npz",
    stem="trajectory",
    content="all samples with both sides of every impact, as numpy arrays with their names beside them",
    writers={".npz": npz_arrays},
    with_plan=True,
)
