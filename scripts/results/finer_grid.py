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
import platform
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

from fesd_robot import load_task, plan
from fesd_robot.plans import task_to_refine
from fesd_robot.plans.files import write_plan
from fesd_robot.plans.tables import markdown_table
from scripts.tools.arguments import ROOT, task_parser

PAGE = ROOT / "docs" / "results" / "finer_grid.md"
COSTLIER = 1e-4
"""Of the cost: refinement of another grid may add as much."""

MOST_TIME = 1 / 3
COLUMNS = ("task", "intervals", "cost before", "cost after", "seconds before", "seconds after", "part", "iterations",
           "as it should be")  # fmt: skip


def measured(name: str, overrides: list[str], folder: Path) -> list[str]:
    """Return the cells of one task: planned, and planned again from that on the finer grid.

    Args:
        overrides: for both.
        folder: for the plan.
    """
    task = load_task(ROOT / "tasks" / f"{name}.yaml", overrides)
    begin = time.perf_counter()
    first = plan(task)
    before = time.perf_counter() - begin
    write_plan(first, folder)
    doubled = 2 * task.horizon.intervals
    begin = time.perf_counter()
    second = plan(task_to_refine(folder, [f"horizon.intervals={doubled}"]))
    after = time.perf_counter() - begin
    costs = first.statistics.objective, second.statistics.objective
    right = second.status.solved and costs[1] <= costs[0] + COSTLIER * abs(costs[0]) and after <= MOST_TIME * before
    return [
        name,
        f"{doubled // 2} -> {doubled}",
        f"{costs[0]:.6g}" + ("" if first.status.solved else " ✗"),
        f"{costs[1]:.6g}" + ("" if second.status.solved else " ✗"),
        f"{before:.0f}",
        f"{after:.1f}",
        f"{after / before:.2f}",
        str(sum(one.iterations for one in second.statistics.attempts)),
        "yes" if right else "no",
    ]


def main() -> int:
    """Plan and refine the tasks and write the table."""
    parser = task_parser(__doc__, PAGE)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="a setting for all of them")
    arguments = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.tasks:
            rows.append(measured(name, arguments.set, Path(folder) / name))
            print(" | ".join(rows[-1]), flush=True)
    settings = f" with {', '.join(arguments.set)}" if arguments.set else ""
    lines = [
        "# Plans refined on a grid twice as fine",
        "",
        f"Made by `scripts/results/finer_grid.py`{settings}, Python {platform.python_version()}, casadi "
        f"{version('casadi')}. "
        "✗: not solved. Seconds are those of the clock, without drawing.",
        "",
        f"**{sum(row[-1] == 'yes' for row in rows)} of {len(rows)}** are solved, cost at most {COSTLIER:.2%} more than "
        "the plan they were made from, and take at most a third of its time.",
        "",
        markdown_table(COLUMNS, rows),
    ]
    arguments.page.write_text("\n".join(lines), encoding="utf-8")
    return 0 if all(row[-1] == "yes" for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
