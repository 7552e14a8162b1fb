"""What more and less effort than that of the default call costs and gains.

    python scripts/results/effort.py hopper_one_jump block_push --jobs 2

Every task is planned with every `solver.effort`, with refinement and certificate, on one core each. The table goes to
docs/results/effort.md; rows of tasks that are not planned stay as they are.
"""

from __future__ import annotations

import os
import sys
from functools import partial

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from fesd_robot.plans import Plan
from fesd_robot.plans.tables import markdown_table
from fesd_robot.sweeps.planned import planned
from scripts.results.claims import CLAIMS
from scripts.tools.arguments import ROOT
from scripts.tools.table import PROGRAM_IS, Row, Table, cases_of, every_task, solved

EFFORTS = ("balanced", "quick", "best")
"""That of the default call first."""

HEADER = [
    "task",
    *[f"{what}, {effort}" for effort in EFFORTS for what in ("cost", "iterations", "seconds")],
    "program",
]
SUMMARY = ["effort", "does what its task says", "median cost above the default", "largest", "times fewer iterations",
           "times faster"]  # fmt: skip


def measure(result: Plan) -> dict[str, str]:
    """Return what is wrong with a motion that is not the one that the task's first line describes."""
    return {"wrong": "; ".join(CLAIMS[result.name].broken(result))}


def right(row: Row) -> bool:
    """Return whether a row has the motion that its task describes."""
    return solved(row) and not row["wrong"]


def cells(row: Row) -> list[str]:
    """Return the three cells of a row."""
    if row["cost"] is None:
        return [f"✗ {row['verdict']}", "", f"{row['seconds']:.0f}"]
    return [f"{row['cost']:.5g}" + ("" if right(row) else " ✗"), str(row["iterations"]), f"{row['seconds']:.0f}"]


def summary(tasks: list[dict[str, Row]]) -> str:
    """Return a table of what each effort costs and takes beside that of the default call, over all tasks."""
    lines = []
    for effort in EFFORTS:
        pairs = [(task[EFFORTS[0]], task[effort]) for task in tasks]
        done = [(first, own) for first, own in pairs if right(first) and right(own)]
        above = [own["cost"] / first["cost"] - 1 for first, own in done]
        fewer = [first["iterations"] / own["iterations"] for first, own in done]
        faster = [first["seconds"] / max(own["seconds"], 1.0) for first, own in done]
        costs = [f"{100 * value:.3g} %" for value in (np.median(above), max(above))] if done else ["–", "–"]
        ratios = [f"{np.median(each):.3g}" if done else "–" for each in (fewer, faster)]
        lines.append([effort, f"{len(done)} of {len(tasks)}", *costs, *ratios])
    return markdown_table(SUMMARY, lines)


def page_of(rows: list[Row]) -> str:
    """Return the page."""
    tasks = [{row["solver.effort"]: row for row in own} for own in cases_of(rows).values()]
    whole = [task for task in tasks if len(task) == len(EFFORTS)]
    lines = [
        [next(iter(task.values()))["task"], *[cell for effort in EFFORTS for cell in cells(task[effort])],
         ", ".join(dict.fromkeys(TABLE.program(row) for row in task.values()))]
        for task in whole
    ]  # fmt: skip
    return "\n".join(
        [
            "# More and less effort than the default call",
            "",
            TABLE.made_by(rows),
            "",
            "Every effort ends with refinement, audit and certificate, and has the fallback settings of a task that is "
            "not solved. Iterations are those of IPOPT in all attempts; seconds are those of one core, compiled "
            "functions from the cache. ✗: not solved, or not the motion that the first line of the task describes.",
            "",
            summary(whole),
            PROGRAM_IS,
            "",
            markdown_table(HEADER, lines),
        ]
    )


TABLE = Table(
    ROOT / "docs" / "results" / "effort.md",
    {"set": {"solver.processes": 1}, "vary": {"task": every_task(), "solver.effort": list(EFFORTS)}},
    page_of,
    partial(planned, measure=measure),
    {"wrong": str},
)

if __name__ == "__main__":
    TABLE.main(__doc__ or "")
    sys.exit(0)
