"""Families of plans: a sweep file, its rows on all cores or a cluster, and the table, the page and the plans."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "Answer",
    "Limits",
    "Order",
    "Rows",
    "Sweep",
    "SweepSettings",
    "SweepTable",
    "Tally",
    "Verdict",
    "load_sweep",
    "read_sweep",
    "sweep",
    "swept",
    "write_dataset",
]

if TYPE_CHECKING:
    from fesd_robot.sweeps.dataset import write_dataset
    from fesd_robot.sweeps.folder import read_sweep
    from fesd_robot.sweeps.order import Answer, Limits, Order, Verdict
    from fesd_robot.sweeps.rows import Rows
    from fesd_robot.sweeps.run import sweep, swept
    from fesd_robot.sweeps.schema import Sweep, load_sweep
    from fesd_robot.sweeps.settings import SweepSettings
    from fesd_robot.sweeps.table import SweepTable
    from fesd_robot.sweeps.tally import Tally
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.sweeps.dataset": ["write_dataset"],
            "fesd_robot.sweeps.folder": ["read_sweep"],
            "fesd_robot.sweeps.order": ["Answer", "Limits", "Order", "Verdict"],
            "fesd_robot.sweeps.rows": ["Rows"],
            "fesd_robot.sweeps.run": ["sweep", "swept"],
            "fesd_robot.sweeps.schema": ["Sweep", "load_sweep"],
            "fesd_robot.sweeps.settings": ["SweepSettings"],
            "fesd_robot.sweeps.table": ["SweepTable"],
            "fesd_robot.sweeps.tally": ["Tally"],
        },
    )
