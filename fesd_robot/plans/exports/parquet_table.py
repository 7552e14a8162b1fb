"""All samples as a table of Apache Parquet."""

from __future__ import annotations

import io
import json

from fesd_robot.plans.columns import CONTROL_CONVENTION, columns_of
from fesd_robot.plans.exports.facts import facts
from fesd_robot.plans.exports.format import ExportFormat
from fesd_robot.plans.plan import Plan


def parquet_table(plan: Plan) -> bytes:
    """Return the columns of the CSV file as Parquet, numbers as doubles and modes as dictionaries.

    Verdict, units, impulses, switches and `fesd_robot.plans.columns.CONTROL_CONVENTION` are JSON in the file's
    metadata, under the key ``fesd_robot``.
    """
    import pyarrow as pa  # an extra
    import pyarrow.parquet as pq

    columns = {name: pa.array(values) for name, values in columns_of(plan).items()}
    for name, contact in plan.contacts.items():
        columns[f"{name} mode"] = pa.array(contact.mode).dictionary_encode()
    for name, joint in plan.joint_friction.items():
        columns[f"{name} dry friction mode"] = pa.array(list(joint.mode)).dictionary_encode()
    known = json.dumps({**facts(plan), "controls": CONTROL_CONVENTION})
    content = io.BytesIO()
    pq.write_table(pa.table(columns).replace_schema_metadata({"fesd_robot": known}), content)
    return content.getvalue()


PARQUET = ExportFormat(
    name="parquet",
    stem="trajectory",
    content="the columns of the CSV file for pandas, Polars or DuckDB, verdict, units, impulses and switches in its "
    "metadata",
    writers={".parquet": parquet_table},
    extra="parquet",
    packages=("pyarrow",),
)
