"""Both transcriptions of contact on the same tasks: with a clock that stops in impacts, and with impulses.

    python scripts/benchmarks/transcriptions.py
    python scripts/benchmarks/transcriptions.py hopper_one_jump --set solver.time_limit=150

Every task is planned twice, without fallback settings. The table goes to docs/results/transcriptions.md.
"""

from __future__ import annotations

import os
import platform
import time
from importlib.metadata import version

os.environ.setdefault("OMP_NUM_THREADS", "1")

from fesd_robot import load_task, plan
from fesd_robot.plans import Plan
from fesd_robot.plans.tables import markdown_table
from scripts.tools.arguments import ROOT, task_parser

PAGE = ROOT / "docs" / "results" / "transcriptions.md"
TASKS = ("hopper_one_jump", "block_push", "biped_step", "solo12_jump")
FIRST = ("solver.retries=0", "solver.processes=1")
COLUMNS = ("task", "contact", "solved", "cost", "variables", "pairs", "iterations", "impacts", "time / freezing",
           "if not solved")  # fmt: skip


def planned(name: str, contact: str, overrides: list[str]) -> tuple[Plan, float]:
    """Return the plan of a task and the seconds of processor time that it took."""
    task = load_task(ROOT / "tasks" / f"{name}.yaml", [*FIRST, *overrides, f"method.contact={contact}"])
    begin = time.process_time()
    result = plan(task)
    return result, time.process_time() - begin


def row(name: str, contact: str, result: Plan, seconds: float, first: float) -> list[str]:
    """Return the cells of one plan."""
    statistics = result.statistics
    return [
        name,
        contact,
        "yes" if result.status.solved else "no",
        f"{statistics.objective:.4g}",
        str(statistics.variables),
        str(statistics.pairs),
        str(sum(one.iterations for one in statistics.attempts) or statistics.iterations),
        str(len({impulse.time for impulse in result.impulses})),
        f"{seconds / first:.2f}",
        "" if result.status.solved else result.status.message.split(". ")[0][:120],
    ]


def main() -> None:
    """Plan the tasks and write the table."""
    parser = task_parser(__doc__, PAGE)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="a setting for all of them")
    arguments = parser.parse_args()
    tasks = [name for name in arguments.tasks if name in TASKS] or list(TASKS)
    rows = []
    for name in tasks:
        first = 0.0
        for contact in ("freezing", "impulses"):
            result, seconds = planned(name, contact, arguments.set)
            first = first or seconds
            rows.append(row(name, contact, result, seconds, first))
            print(" | ".join(rows[-1]), flush=True)
    settings = f" with {', '.join(arguments.set)}" if arguments.set else ""
    lines = [
        "# Two transcriptions of contact",
        "",
        f"Made by `scripts/benchmarks/transcriptions.py`{settings}, Python {platform.python_version()}, casadi "
        f"{version('casadi')}. No fallback settings, one process. Time is that of the processor, "
        "as a part of that with `freezing`; cost, variables and iterations of a motion that is not solved are those of "
        "its last iterate.",
        "",
        markdown_table(COLUMNS, rows),
    ]
    arguments.page.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
