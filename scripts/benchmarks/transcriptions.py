"""Both transcriptions of contact on the same tasks: with a clock that stops in impacts, and with impulses.

    python scripts/benchmarks/transcriptions.py
    python scripts/benchmarks/transcriptions.py hopper_one_jump --time-limit 150

Every task is planned twice, without fallback settings. The table goes to docs/results/transcriptions.md.
"""

from __future__ import annotations

import os
from functools import partial

os.environ.setdefault("OMP_NUM_THREADS", "1")

from fesd_robot.plans import Plan
from fesd_robot.plans.tables import markdown_table
from fesd_robot.sweeps.planned import planned
from scripts.tools.arguments import ROOT
from scripts.tools.table import PROGRAM_IS, Row, Table, cases_of, solved

TASKS = ("hopper_one_jump", "block_push", "biped_step", "solo12_jump")
COLUMNS = ("task", "contact", "solved", "cost", "variables", "pairs", "iterations", "impacts", "time / freezing",
           "program", "if not solved")  # fmt: skip


def measure(result: Plan) -> dict[str, int]:
    """Return the size of the problem, and how many impacts the motion has."""
    statistics, times = result.statistics, {impulse.time for impulse in result.impulses}
    return {"variables": statistics.variables, "pairs": statistics.pairs, "impacts": len(times)}


def line(row: Row, freezing: Row | None) -> list[str]:
    """Return the line of a plan, beside that of the same task with a clock that stops."""
    numbers = [row[name] for name in ("variables", "pairs", "iterations", "impacts")]
    ratio = f"{row['seconds'] / freezing['seconds']:.2f}" if freezing and freezing["seconds"] else "–"
    return [
        row["task"],
        row["method.contact"],
        "yes" if solved(row) else "no",
        "–" if row["cost"] is None else f"{row['cost']:.4g}",
        *("–" if number is None else str(number) for number in numbers),
        ratio,
        TABLE.program(row),
        "" if solved(row) else row["message"].split(". ")[0][:120],
    ]


def page_of(rows: list[Row]) -> str:
    """Return the page."""
    lines = []
    for own in cases_of(rows).values():
        freezing = next((row for row in own if row["method.contact"] == "freezing"), None)
        lines += [line(row, freezing) for row in own]
    return "\n".join(
        [
            "# Two transcriptions of contact",
            "",
            TABLE.made_by(rows),
            "",
            "No fallback settings, one process. Time is that of the clock, as a part of that with `freezing`; cost, "
            f"variables and iterations of a motion that is not solved are those of its last iterate. {PROGRAM_IS}",
            "",
            markdown_table(COLUMNS, lines),
        ]
    )


TABLE = Table(
    ROOT / "docs" / "results" / "transcriptions.md",
    {
        "set": {"solver.retries": 0, "solver.processes": 1},
        "vary": {"task": list(TASKS), "method.contact": ["freezing", "impulses"]},
    },
    page_of,
    partial(planned, measure=measure),
    {"variables": int, "pairs": int, "impacts": int},
)

if __name__ == "__main__":
    TABLE.main(__doc__ or "")
