"""How far the default call is from the best motion that ten times the effort finds.

    python scripts/best_known.py hopper_one_jump hopper_wedge --processes 2

Every task is planned by the default call and then from ten other starts: other initial guesses, discretisations and
schedules of sigma, each with its own search, refinement and audit. Their motions are held against the task as it is:
the same grid of controls, limits, goal and costs. The table goes to docs/results/best_known.md. Rows of tasks that are
not planned stay as they are. Exit code 1 if a default costs more than a twentieth above the best.
"""

from __future__ import annotations

import os
import platform
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import casadi
from arguments import ROOT, task_parser

from fesd_robot import load_task, plan
from fesd_robot.planner import attempt
from fesd_robot.plans import Plan
from fesd_robot.plans.tables import markdown_table

PAGE = ROOT / "docs" / "results" / "best_known.md"
ALLOWED = 0.05

STARTS: tuple[tuple[str, ...], ...] = (
    ("solver.seed=1",),
    ("solver.seed=2",),
    ("solver.seed=3",),
    ("method.stages=3",),
    ("method.elements=4",),
    ("method.step_freedom=2",),
    ("solver.loose_iterations=60",),
    ("solver.sigma_factor=0.6",),
    ("solver.sigma_start=1",),
    ("solver.velocity_level_ratio=100",),
)
"""What differs from the task in each of the other starts."""

HEADER = [
    "task",
    "default",
    "best",
    "above the best",
    "from",
    "solved",
    "median of the others",
    "seconds",
    "all seconds",
]


def planned(name: str, overrides: tuple[str, ...] | None) -> tuple[Plan, float]:
    """Return the plan of a task from one start, by the default call for None, and the seconds that it took."""
    begin = time.perf_counter()
    task = load_task(ROOT / "tasks" / f"{name}.yaml", list(overrides or ()))
    return plan(task) if overrides is None else attempt(task), time.perf_counter() - begin


def row(name: str, default: tuple[Plan, float], others: list[tuple[Plan, float]]) -> tuple[list[str], float]:
    """Return the cells of a task, and how far its default is above the best."""
    costs = {
        " ".join(start): one.statistics.objective
        for start, (one, _) in zip(STARTS, others, strict=True)
        if one.status.solved
    }
    own = default[0].statistics.objective if default[0].status.solved else float("inf")
    start, best = min([("the default", own), *costs.items()], key=lambda item: item[1])
    above = (own - best) / max(abs(best), 1e-9)
    ordered = sorted(costs.values())
    median = f"{ordered[len(ordered) // 2]:.5g}" if ordered else ""
    seconds = default[1] + sum(one[1] for one in others)
    numbers = [f"{own:.5g}", f"{best:.5g}", f"{above:.1%}", start, f"{len(costs)} of {len(others)}", median]
    return [name, *numbers, f"{default[1]:.0f}", f"{seconds:.0f}"], above


def earlier_rows(page: Path) -> dict[str, list[str]]:
    """Return the rows of a page that was written before, by task."""
    if not page.exists():
        return {}
    lines = [line.strip("| \n").split(" | ") for line in page.read_text(encoding="utf-8").splitlines()]
    return {cells[0]: cells for cells in lines if len(cells) == len(HEADER) and cells[0] not in ("task", "---")}


def main() -> int:
    """Plan every task from every start and write the table."""
    arguments = task_parser(__doc__, PAGE).parse_args()
    rows, far = earlier_rows(arguments.page), []
    with ProcessPoolExecutor(arguments.processes) as pool:
        jobs = {name: [pool.submit(planned, name, one) for one in (None, *STARTS)] for name in arguments.tasks}
        for name, (default, *others) in jobs.items():
            rows[name], above = row(name, default.result(), [job.result() for job in others])
            far += [name] if above > ALLOWED else []
            print(" ".join(rows[name]), flush=True)
    starts = ", ".join("`" + " ".join(start) + "`" for start in STARTS)
    lines = [
        "# How far the default is from the best motion known",
        "",
        f"Made by `python scripts/best_known.py`, {arguments.processes} processes, Python {platform.python_version()}, "
        f"casadi {casadi.__version__}.",
        "",
        "Every task is planned by the default call and from ten other starts, each with its own search, refinement and "
        f"audit: {starts}. Costs are of solved motions only.",
        "",
        markdown_table(HEADER, [rows[name] for name in sorted(rows)]),
    ]
    arguments.page.write_text("\n".join(lines), encoding="utf-8")
    return 1 if far else 0


if __name__ == "__main__":
    sys.exit(main())
