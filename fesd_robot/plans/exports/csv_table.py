"""All samples as a table of comma-separated values."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

from fesd_robot.plans.columns import columns_of
from fesd_robot.plans.exports.format import ExportFormat
from fesd_robot.plans.plan import Plan


def csv_table(plan: Plan) -> bytes:
    """Return the trajectory as CSV with a header of names and units.

    An impact has two samples at the same time, before and after; which controls a sample has is said by
    `fesd_robot.plans.columns.CONTROL_CONVENTION`.
    """
    columns, stream = columns_of(plan), io.StringIO(newline="")
    writer = csv.writer(stream)
    joints = plan.joint_friction
    writer.writerow(
        [*columns, *(f"{name} mode" for name in plan.contacts), *(f"{name} dry friction mode" for name in joints)]
    )
    modes: list[Sequence[str]] = [
        *(contact.mode for contact in plan.contacts.values()),
        *(joint.mode for joint in joints.values()),
    ]
    for row in zip(*[values.tolist() for values in columns.values()], *modes, strict=True):
        writer.writerow([repr(value) if isinstance(value, float) else value for value in row])
    return stream.getvalue().encode()


CSV = ExportFormat(
    name="csv",
    stem="trajectory",
    content="all samples with both sides of every impact, one row each under a header of names and units",
    writers={".csv": csv_table},
    with_plan=True,
)
