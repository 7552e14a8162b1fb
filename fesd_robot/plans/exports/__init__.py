"""The trajectory of a plan in the formats that other programs read."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from typing import Any

from ruamel.yaml import YAML

from fesd_robot.errors import PlanFileError, nearest
from fesd_robot.plans.joint_trajectory import joint_trajectory
from fesd_robot.plans.plan import Plan
from fesd_robot.plans.tables import columns_of, csv_table, npz_arrays

EXPORTS = {
    "csv": "trajectory.csv",
    "npz": "trajectory.npz",
    "json": "trajectory.json",
    "joint-trajectory": "joint_trajectory.yaml",
}
"""Format -> usual name of its file."""


def export(plan: Plan, kind: str, *, joints: Sequence[str] | None = None, as_json: bool = False) -> bytes:
    """Return the trajectory of a plan as the content of a file.

    Args:
        kind: a key of `EXPORTS`. ``csv``, ``npz`` and ``json`` hold all samples, both sides of an impact;
            ``joint-trajectory`` holds the fields of a ROS message.
        joints: of a ``joint-trajectory``, see `fesd_robot.plans.joint_trajectory`.
        as_json: whether a ``joint-trajectory`` is JSON instead of YAML.

    Raises:
        PlanFileError: no such format, or joints for a format that always holds all of them.
        FesdRobotError: the plan cannot be written in this format.
    """
    if kind not in EXPORTS:
        raise PlanFileError(f"found format '{kind}', expected one of {', '.join(EXPORTS)}{nearest(kind, EXPORTS)}")
    if joints is not None and kind != "joint-trajectory":
        raise PlanFileError(f"found joints for format '{kind}', which holds all of them; expected joint-trajectory")
    if kind == "csv":
        return csv_table(plan)
    if kind == "npz":
        return npz_arrays(plan)
    if kind == "json":
        return _json(_columns(plan))
    message = joint_trajectory(plan, joints)
    return _json(message) if as_json else _yaml(message)


def _columns(plan: Plan) -> dict[str, Any]:
    """Return name, verdict, columns by name with unit, and the modes of the contacts along them."""
    return {
        "name": plan.name,
        "solved": plan.status.solved,
        "columns": {name: values.tolist() for name, values in columns_of(plan).items()},
        "modes": {name: contact.mode for name, contact in plan.contacts.items()},
    }


def _json(value: Any) -> bytes:
    return (json.dumps(value, indent=1) + "\n").encode()


def _yaml(value: Any) -> bytes:
    yaml, stream = YAML(typ="safe", pure=True), io.BytesIO()
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.width = 4096
    yaml.dump(value, stream)
    return stream.getvalue()
