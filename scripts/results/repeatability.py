"""The same task on processors whose last bits differ: which motion the default call returns on each.

    python scripts/results/repeatability.py hopper_one_jump block_push --jobs 2

A processor is simulated by another linear solver, by interpreted instead of compiled functions, and by starts that are
moved by 1e-12, those of the homotopy and of every branch NLP. The table goes to docs/results/repeatability.md; rows of
tasks that are not planned stay as they are. Exit code 1 if costs of a task differ by more than two per cent although
the sequence of contacts differs, or if a task is not solved on one of them.
"""

from __future__ import annotations

import os
import sys
from itertools import groupby
from pathlib import Path
from unittest import mock

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from fesd_robot.contact import ContactMode
from fesd_robot.mpcc.polishing import BranchNlp
from fesd_robot.planning import chain
from fesd_robot.plans import Plan
from fesd_robot.plans.tables import markdown_table
from fesd_robot.sweeps import Answer, Order
from fesd_robot.sweeps.planned import planned
from scripts.results.moved_start import MOVED, moved, moved_branches
from scripts.tools.arguments import ROOT
from scripts.tools.table import PROGRAM_IS, Row, Table, cases_of, every_task, solved

SPREAD = 0.02

PROCESSORS: dict[str, dict[str, str]] = {
    "as it is": {},
    "MUMPS": {"solver.linear_solver": "mumps"},
    "interpreted": {"method.compile": "never"},
    "moved, 1": {},
    "moved, 2": {},
}
"""Simulated processor -> what is changed; a start is moved where the name ends with the seed of a generator."""

HEADER = ["task", *PROCESSORS, "largest difference", "same contacts", "median seconds", "program"]


def planned_on(order: Order, task: Path) -> Answer:
    """Plan a task on the processor that is the order's case."""
    seed = order.case.rpartition(", ")[2] if order.case.startswith("moved") else None
    homotopy, branches = moved(chain.solve, int(seed)) if seed else chain.solve, BranchNlp._start
    with (
        mock.patch.object(chain, "solve", homotopy),
        mock.patch.object(BranchNlp, "_start", moved_branches(int(seed)) if seed else branches),
    ):
        return planned(order, task, measure)


def measure(result: Plan) -> dict[str, str]:
    """Return what every contact does one after the other; impacts take no time and are left out."""
    modes = {
        name: [mode for mode, _ in groupby(each.mode) if mode is not ContactMode.IMPACT]
        for name, each in result.contacts.items()
    }
    words = {name: " ".join(mode.value for mode, _ in groupby(each)) for name, each in modes.items()}
    return {"contacts": "; ".join(f"{name}: {each}" for name, each in words.items())}


def spread(rows: list[Row]) -> float:
    """Return by which part of the lowest cost the highest is above it."""
    costs = [row["cost"] for row in rows if row["cost"] is not None]
    return (max(costs) - min(costs)) / max(abs(min(costs)), 1e-9) if costs else 0.0


def agree(rows: list[Row]) -> bool:
    """Return whether a task is solved on every processor, with the same contacts, or costs within `SPREAD`."""
    same = len({row["contacts"] for row in rows}) == 1
    return len(rows) == len(PROCESSORS) and all(map(solved, rows)) and (same or spread(rows) <= SPREAD)


def line(task: str, rows: list[Row]) -> list[str]:
    """Return the line of a task."""
    by_case = {row["case"]: row for row in rows}
    costs = []
    for name in PROCESSORS:
        row = by_case.get(name)
        words = "" if row is None else "–" if row["cost"] is None else f"{row['cost']:.6g}"
        costs.append(words + ("" if row is None or solved(row) else " ✗"))
    same = "yes" if len({row["contacts"] for row in rows}) == 1 else "no"
    seconds = f"{np.median([row['seconds'] for row in rows]):.0f}"
    programs = ", ".join(dict.fromkeys(TABLE.program(row) for row in rows))
    return [task, *costs, f"{100 * spread(rows):.2g} %", same, seconds, programs]


def page_of(rows: list[Row]) -> str:
    """Return the page."""
    tasks = cases_of(rows)
    return "\n".join(
        [
            "# The same task on five processors",
            "",
            TABLE.made_by(rows),
            "",
            "Costs of the default call with our linear solver and with MUMPS, with compiled and with interpreted "
            f"functions, and with all starts of NLPs moved by {MOVED:g}, twice; ✗: not solved. Contacts are the same "
            "if every one of them flies, sticks and slips in the same order. " + PROGRAM_IS,
            "",
            f"**{sum(map(agree, tasks.values()))} of {len(tasks)}** tasks are solved on all of them, with the same "
            f"contacts or with costs within {100 * SPREAD:g} %.",
            "",
            markdown_table(HEADER, [line(task, own) for task, own in tasks.items()]),
        ]
    )


TABLE = Table(
    ROOT / "docs" / "results" / "repeatability.md",
    {"vary": {"task": every_task()}, "cases": PROCESSORS},
    page_of,
    planned_on,
    {"contacts": str},
)

if __name__ == "__main__":
    sys.exit(0 if all(map(agree, cases_of(TABLE.main(__doc__ or "")).values())) else 1)
