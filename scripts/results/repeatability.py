"""The same task on processors whose last bits differ: which motion the default call returns on each.

    python scripts/results/repeatability.py hopper_one_jump block_push --processes 2

A processor is simulated by another linear solver, by interpreted instead of compiled functions, and by starts that are
moved by 1e-12, those of the homotopy and of every branch NLP. The table goes to docs/results/repeatability.md; rows of
tasks that are not planned stay as they are. Exit code 1 if costs of a task differ by more than two per cent although
the sequence of contacts differs, or if a task is not solved on one of them.
"""

from __future__ import annotations

import os
import sys
import time
from itertools import groupby
from unittest import mock

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from fesd_robot.contact import ContactMode
from fesd_robot.mpcc.polishing import BranchNlp
from fesd_robot.planning import chain, plan
from fesd_robot.plans import Plan
from fesd_robot.plans.tables import markdown_table
from fesd_robot.task import load_task
from scripts.results.moved_start import MOVED, moved, moved_branches
from scripts.tools.arguments import PROGRAM_IS, ROOT, Rows, made_by, planned_in_all_ways, program_of, task_parser

PAGE = ROOT / "docs" / "results" / "repeatability.md"
SPREAD = 0.02

PROCESSORS: dict[str, list[str]] = {
    "as it is": [],
    "MUMPS": ["solver.linear_solver=mumps"],
    "interpreted": ["method.compile=never"],
    "moved, 1": [],
    "moved, 2": [],
}
"""Simulated processor -> what is changed; a start is moved where the name ends with the seed of a generator."""

HEADER = ["task", *PROCESSORS, "largest difference", "same contacts", "median seconds", "program"]


def planned(name: str, processor: str) -> tuple[Plan, float]:
    """Return the plan of a task on a processor, and the seconds that it took."""
    task, begin = load_task(ROOT / "tasks" / f"{name}.yaml", PROCESSORS[processor]), time.perf_counter()
    seed = processor.rpartition(", ")[2] if processor.startswith("moved") else None
    homotopy, branches = moved(chain.solve, int(seed)) if seed else chain.solve, BranchNlp._start
    with (
        mock.patch.object(chain, "solve", homotopy),
        mock.patch.object(BranchNlp, "_start", moved_branches(int(seed)) if seed else branches),
    ):
        return plan(task), time.perf_counter() - begin


def sequence(result: Plan) -> tuple[tuple[ContactMode, ...], ...]:
    """Return what every contact does one after the other; impacts take no time and are left out."""
    return tuple(
        tuple(mode for mode, _ in groupby(mode for mode in contact.mode if mode is not ContactMode.IMPACT))
        for contact in result.contacts.values()
    )


def agrees(row: list[str]) -> bool:
    """Return whether a task is solved on every processor, with the same contacts, or costs within `SPREAD`."""
    cells = dict(zip(HEADER, row, strict=True))
    near = float(cells["largest difference"].rstrip(" %")) <= 100 * SPREAD
    return "✗" not in " ".join(row) and (near or cells["same contacts"] == "yes")


def page_of(rows: list[list[str]], processes: int) -> str:
    """Return the page with the rows of all tasks so far."""
    agreeing = sum(agrees(row) for row in rows)
    lines = [
        "# The same task on five processors",
        "",
        made_by("repeatability", processes),
        "",
        "Costs of the default call with our linear solver and with MUMPS, with compiled and with interpreted "
        f"functions, and with all starts of NLPs moved by {MOVED:g}, twice; ✗: not solved. Contacts are the same if "
        "every one of them flies, sticks and slips in the same order. " + PROGRAM_IS,
        "",
        f"**{agreeing} of {len(rows)}** tasks are solved on all of them, with the same contacts or with "
        f"costs within {100 * SPREAD:g} %.",
        "",
        markdown_table(HEADER, rows),
    ]
    return "\n".join(lines)


def main() -> int:
    """Plan every task on every processor and write the table."""
    arguments = task_parser(__doc__, PAGE).parse_args()
    rows = Rows(arguments.page, HEADER)
    for name, done in planned_in_all_ways(planned, arguments.tasks, PROCESSORS, arguments.processes):
        plans = [one for one, _ in done]
        costs = [one.statistics.objective for one in plans]
        spread = (max(costs) - min(costs)) / max(abs(min(costs)), 1e-9)
        same = len({sequence(one) for one in plans}) == 1
        cells = [f"{cost:.6g}" + ("" if one.status.solved else " ✗") for cost, one in zip(costs, plans, strict=True)]
        seconds = np.median([took for _, took in done])
        contacts = "yes" if same else "no"
        rows.put([name, *cells, f"{100 * spread:.2g} %", contacts, f"{seconds:.0f}", program_of(name)])
        print(" ".join(rows.by_name[name]), flush=True)
        arguments.page.write_text(page_of(rows.cells, arguments.processes), encoding="utf-8")
    known = rows.by_name
    return 0 if all(name in known and agrees(known[name]) for name in arguments.tasks) else 1


if __name__ == "__main__":
    sys.exit(main())
