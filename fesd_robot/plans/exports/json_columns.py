"""All samples as one JSON object."""

from __future__ import annotations

import json

from fesd_robot.plans.columns import CONTROL_CONVENTION, columns_of
from fesd_robot.plans.exports.facts import facts
from fesd_robot.plans.exports.format import ExportFormat
from fesd_robot.plans.plan import Plan


def json_columns(plan: Plan) -> bytes:
    """Return name, verdict, units, impulses, switches, columns by name with unit, their controls, and modes.

    Modes are those of contacts, and of joints with dry friction if there are any.
    """
    joints = plan.joint_friction
    content = {
        **facts(plan),
        "controls": CONTROL_CONVENTION,
        "columns": {name: values.tolist() for name, values in columns_of(plan).items()},
        "modes": {name: contact.mode for name, contact in plan.contacts.items()},
        **({"joint_modes": {name: joint.mode for name, joint in joints.items()}} if joints else {}),
    }
    return (json.dumps(content, indent=1) + "\n").encode()


JSON = ExportFormat(
    name="json",
    stem="trajectory",
    content="all samples with both sides of every impact, as columns by name with unit",
    writers={".json": json_columns},
)
