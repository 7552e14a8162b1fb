"""How the time of a plan grows with its length: one, two, five, ten and twenty jumps of the hopper.

    python scripts/benchmarks/growth.py                  # three times each, a quarter of an hour
    python scripts/benchmarks/growth.py --repeat 1

The task is hopper_five_jumps with another number of jumps: a metre, a second and twenty control intervals each. Every
plan is made by the whole call of the command line, page and figures included, in a process of its own; times are
medians. The table goes to docs/results/growth.md, the figure to docs/images/growth.svg. Exit code 1 if a jump of twenty
takes more than 1.5 times as long as one of two, or a plan is not solved.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
from pathlib import Path
from statistics import median
from typing import Any

import matplotlib as mpl

mpl.use("svg")
import matplotlib.pyplot as plt

from fesd_robot.plans.tables import markdown_table
from scripts.tools.arguments import ROOT, Rows, planned_by_command, program_of

PAGE, FIGURE = ROOT / "docs" / "results" / "growth.md", ROOT / "docs" / "images" / "growth.svg"
JUMPS = (1, 2, 5, 10, 20)
INTERVALS = 20
MOST = 1.5
HEADER = (
    "jumps", "seconds", "seconds a jump", "iterations", "variables", "cost a jump", "sequences tried", "solved"
)  # fmt: skip


def planned(jumps: int, folder: Path) -> tuple[float, dict[str, Any]]:
    """Plan some jumps; return the seconds of the whole call and the plan.

    Args:
        jumps: how many.
        folder: for the results.
    """
    changes = [
        f"reference.count={jumps}",
        f"horizon.duration={jumps}",
        f"horizon.intervals={INTERVALS * jumps}",
        f"goal.configuration.root_x={jumps}",
    ]
    seconds, _ = planned_by_command(ROOT / "tasks" / "hopper_five_jumps.yaml", folder, changes)
    return seconds, json.loads((folder / "plan.json").read_text())


def main() -> int:
    """Plan all, write table and figure."""
    import argparse

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=3, help="plans of each")
    repeat = parser.parse_args().repeat
    rows, a_jump, solved = Rows(PAGE, HEADER), dict[int, float](), True
    with tempfile.TemporaryDirectory() as folder:
        for jumps in JUMPS:
            runs = [planned(jumps, Path(folder) / f"{jumps}-{number}") for number in range(repeat)]
            seconds, plan = median(run[0] for run in runs), runs[-1][1]
            statistics, status = plan["statistics"], plan["status"]
            a_jump[jumps] = seconds / jumps
            solved = solved and status["solved"]
            cost = f"{statistics['objective'] / jumps:.4g}"
            sizes = [statistics["iterations"], statistics["variables"]]
            tried = len(statistics["search"]["sequences"] or [])
            cells = [jumps, f"{seconds:.1f}", f"{a_jump[jumps]:.2f}", *sizes, cost, tried]
            rows.put([*map(str, cells), "yes" if status["solved"] else "no"])
            print(" | ".join(rows.by_name[str(jumps)]), flush=True)
    in_order = sorted(rows.cells, key=lambda cells: int(cells[0]))
    PAGE.write_text(
        "# Growth with the horizon\n\nWritten by `scripts/benchmarks/growth.py`: the hopper of "
        "hopper_five_jumps with one to "
        f"twenty jumps, {INTERVALS} control intervals each; whole calls on {os.cpu_count()} cores, functions compiled "
        f"before, medians of {repeat}. A jump of twenty takes {a_jump[20] / a_jump[2]:.2f} times as long as one of "
        f"two. Program: {program_of('hopper_five_jumps')}.\n\n{markdown_table(HEADER, in_order)}\n\n"
        "![Seconds of a plan over the number of its jumps](../images/growth.svg)\n",
        encoding="utf-8",
    )
    figure, axes = plt.subplots(figsize=(5.0, 3.2), layout="constrained")
    axes.loglog(JUMPS, [a_jump[jumps] * jumps for jumps in JUMPS], "o-")
    axes.set_xlabel("jumps")
    axes.set_ylabel("seconds of the whole call")
    axes.set_xticks(JUMPS, [str(jumps) for jumps in JUMPS])
    axes.grid(True, which="both", alpha=0.3)
    figure.savefig(FIGURE, metadata={"Date": None})
    return 0 if solved and a_jump[20] <= MOST * a_jump[2] else 1


if __name__ == "__main__":
    sys.exit(main())
