"""Plans refined on a control grid twice as fine: what they cost, and what they take of the first plan's time.

    python scripts/results/finer_grid.py                            # every task
    python scripts/results/finer_grid.py hopper_one_jump block_push

Every task is planned by its default call, and again as `fesd-robot refine` does it with twice as many intervals. A
finer grid contains the coarse one, so that the motion may cost no more. The table goes to docs/results/finer_grid.md.
Exit code 1 if a motion costs more than the plan it was made from, is not solved, or takes more than a third of its
time.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

from fesd_robot import load_task, plan
from fesd_robot.plans import task_to_refine
from fesd_robot.plans.files import write_plan
from fesd_robot.plans.tables import markdown_table
from fesd_robot.sweeps import Answer, Order, Verdict
from fesd_robot.sweeps.planned import values_of
from scripts.tools.arguments import ROOT
from scripts.tools.table import PROGRAM_IS, Row, Table, every_task, solved

COSTLIER = 1e-4
"""Of the cost: refinement of another grid may add as much."""

MOST_TIME = 1 / 3
COLUMNS = ("task", "intervals", "cost before", "cost after", "seconds before", "seconds after", "part", "iterations",
           "as it should be", "program")  # fmt: skip


def refined(order: Order, file: Path) -> Answer:
    """Plan a task, and again from that plan on the finer grid."""
    task, begin = load_task(file, order.overrides), time.perf_counter()
    first = plan(task)
    between = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        write_plan(first, Path(folder) / "plan")
        second = plan(task_to_refine(Path(folder) / "plan", [f"horizon.intervals={2 * task.horizon.intervals}"]))
    values = {
        "intervals": task.horizon.intervals,
        "cost_before": first.statistics.objective,
        "solved_before": first.status.solved,
        "seconds_before": between - begin,
        "seconds_after": time.perf_counter() - between,
    }
    verdict = Verdict.SOLVED if second.status.solved else Verdict.NOT_SOLVED
    return Answer(order.number, verdict, {**values_of(second), **values}, second.status.message)


def right(row: Row) -> bool:
    """Return whether a row is solved, costs no more than the plan that it was made from, and takes a third of it."""
    if not solved(row):
        return False
    cheap = row["cost"] <= row["cost_before"] + COSTLIER * abs(row["cost_before"])
    return bool(cheap and row["seconds_after"] <= MOST_TIME * row["seconds_before"])


def line(row: Row) -> list[str]:
    """Return the line of a task."""
    last = ["yes" if right(row) else "no", TABLE.program(row)]
    if row["cost"] is None:
        return [row["task"], "", f"✗ {row['verdict']}", "", f"{row['seconds']:.0f}", "", "", "", *last]
    seconds = (row["seconds_before"], row["seconds_after"])
    return [
        row["task"],
        f"{row['intervals']} -> {2 * row['intervals']}",
        f"{row['cost_before']:.6g}" + ("" if row["solved_before"] else " ✗"),
        f"{row['cost']:.6g}" + ("" if solved(row) else " ✗"),
        f"{seconds[0]:.0f}",
        f"{seconds[1]:.1f}",
        f"{seconds[1] / seconds[0]:.2f}",
        str(row["iterations"]),
        *last,
    ]


def page_of(rows: list[Row]) -> str:
    """Return the page."""
    return "\n".join(
        [
            "# Plans refined on a grid twice as fine",
            "",
            TABLE.made_by(rows),
            "",
            f"✗: not solved. Seconds are those of the clock, without drawing. {PROGRAM_IS}",
            "",
            f"**{sum(map(right, rows))} of {len(rows)}** are solved, cost at most {COSTLIER:.2%} more than the plan "
            "they were made from, and take at most a third of its time.",
            "",
            markdown_table(COLUMNS, [line(row) for row in rows]),
        ]
    )


TABLE = Table(
    ROOT / "docs" / "results" / "finer_grid.md",
    {"vary": {"task": every_task()}},
    page_of,
    refined,
    {"intervals": int, "cost_before": float, "solved_before": bool, "seconds_before": float, "seconds_after": float},
)

if __name__ == "__main__":
    sys.exit(0 if all(map(right, TABLE.main(__doc__ or ""))) else 1)
