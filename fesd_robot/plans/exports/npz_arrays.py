"""All samples as an archive of numpy arrays."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from fesd_robot.plans.columns import control_interval
from fesd_robot.plans.exports.format import ExportFormat
from fesd_robot.plans.full_model import FullModelMotion
from fesd_robot.plans.plan import Plan


def npz_arrays(plan: Plan) -> bytes:
    """Return an archive of numpy arrays: time, configuration (n, n_q), velocity (n, n_v), controls, contacts.

    ``control`` has a row for every interval, and ``control_interval`` the row that acts at every sample, by
    `fesd_robot.plans.columns.CONTROL_CONVENTION`. ``joint_position``, ``joint_velocity`` and ``joint_effort``,
    (n, number of joints), ``base``, (n, 7), and the forces on feet are those of the model file. ``dry_friction`` is
    the force of the dry friction of the velocity coordinates ``dry_friction_names``, if there are any. Of a motion that
    was sampled at a rate there is ``acceleration``, (n, n_v). ``units`` are those of configuration, velocity and
    controls in this order; impulses are in N s.
    """
    trajectory = plan.trajectory
    controls = {name: values for name, values in plan.controls.items() if name != "time"}  # none of a body let go
    contacts, samples = plan.contacts.values(), len(trajectory.time)
    across = [one.lateral_force for one in plan.contacts.values() if one.lateral_force is not None]
    arrays: dict[str, Any] = {
        "time": trajectory.time,
        "configuration": np.column_stack(list(trajectory.configuration.values())),
        "velocity": np.column_stack(list(trajectory.velocity.values())),
        "configuration_names": np.array(list(trajectory.configuration)),
        "velocity_names": np.array(list(trajectory.velocity)),
        "control_names": np.array(list(controls), dtype=str),
        "control_time": plan.controls["time"],
        "control": _columns(list(controls.values()), len(plan.controls["time"])),
        "control_interval": control_interval(plan),
        "contact_names": np.array(list(plan.contacts), dtype=str),
        "gap": _columns([contact.gap for contact in contacts], samples),
        "normal_force": _columns([contact.normal_force for contact in contacts], samples),
        "tangential_force": _columns([contact.tangential_force for contact in contacts], samples),
        **({"lateral_force": np.column_stack(across)} if across else {}),
        "mode": _columns([contact.mode for contact in contacts], samples, dtype=str),
        **_fact_arrays(plan),
        **({"acceleration": np.column_stack(list(rates.values()))} if (rates := trajectory.acceleration) else {}),
        **(_dry_friction_arrays(plan) if plan.joint_friction else {}),
        **(_full_model_arrays(plan.full_model, samples) if plan.full_model else {}),
    }
    content = io.BytesIO()
    np.savez_compressed(content, **arrays)
    return content.getvalue()


def _columns(values: Sequence[Sequence[Any] | np.ndarray], samples: int, dtype: type = float) -> np.ndarray:
    """Return one column for each of some values, (samples, n); there may be none."""
    return np.array(values, dtype=dtype).reshape(len(values), samples).T


def _fact_arrays(plan: Plan) -> dict[str, np.ndarray]:
    units, impulses, switches = plan.units, plan.impulses, plan.switches
    lateral = [each.lateral for each in impulses if each.lateral is not None]
    return {
        "solved": np.array(plan.status.solved),
        "verdict": np.array(plan.status.message),
        "units": np.array(
            [
                *(units.configuration[name] for name in plan.trajectory.configuration),
                *(units.velocity[name] for name in plan.trajectory.velocity),
                *(units.controls[name] for name in plan.controls if name != "time"),
            ]
        ),
        "impulse_time": np.array([each.time for each in impulses]),
        "impulse_contact": np.array([each.contact for each in impulses], dtype=str),
        "impulse_normal": np.array([each.normal for each in impulses]),
        "impulse_tangential": np.array([each.tangential for each in impulses]),
        **({"impulse_lateral": np.array(lateral)} if lateral else {}),
        "switch_time": np.array([each.time for each in switches]),
        "switch_contact": np.array([each.contact for each in switches], dtype=str),
        "switch_kind": np.array([each.kind for each in switches], dtype=str),
    }


def _dry_friction_arrays(plan: Plan) -> dict[str, np.ndarray]:
    joints = plan.joint_friction.values()
    return {
        "dry_friction_names": np.array(list(plan.joint_friction)),
        "dry_friction": np.column_stack([joint.force for joint in joints]),
        "dry_friction_mode": np.column_stack([joint.mode for joint in joints]),
    }


def _full_model_arrays(model: FullModelMotion, samples: int) -> dict[str, np.ndarray]:
    joints, feet = model.joints.values(), model.feet.values()
    arrays = {
        "joint_names": np.array(list(model.joints), dtype=str),
        "joint_position": _columns([joint.position for joint in joints], samples),
        "joint_velocity": _columns([joint.velocity for joint in joints], samples),
        "joint_effort": _columns([joint.effort for joint in joints], samples),
    }
    if model.base:
        arrays |= {"base_names": np.array(list(model.base)), "base": np.column_stack(list(model.base.values()))}
    if model.feet:
        arrays |= {
            "foot_names": np.array(list(model.feet)),
            "foot_normal_force": np.column_stack([foot.normal_force for foot in feet]),
            "foot_tangential_force": np.column_stack([foot.tangential_force for foot in feet]),
        }
    return arrays


NPZ = ExportFormat(
    name="npz",
    stem="trajectory",
    content="all samples with both sides of every impact, as numpy arrays with their names beside them",
    writers={".npz": npz_arrays},
    with_plan=True,
)
