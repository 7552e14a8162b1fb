"""What more and less effort than that of the default call costs and gains.

    python scripts/results/effort.py hopper_one_jump block_push --processes 2

Every task is planned with every `solver.effort`, with refinement and certificate, on one core each. The table goes to
docs/results/effort.md; rows of tasks that are not planned stay as they are.
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from fesd_robot import load_task, plan
from fesd_robot.plans import Plan
from fesd_robot.plans.tables import markdown_table
from scripts.results.claims import CLAIMS
from scripts.tools.arguments import PROGRAM_IS, ROOT, Rows, made_by, planned_in_all_ways, program_of, task_parser

PAGE = ROOT / "docs" / "results" / "effort.md"

EFFORTS: dict[str, tuple[str, ...]] = {
    "balanced": (),
    "quick": ("solver.effort=quick",),
    "best": ("solver.effort=best",),
}
"""Effort -> settings, that of the default call first."""

HEADER = [
    "task",
    *[f"{what}, {effort}" for effort in EFFORTS for what in ("cost", "iterations", "seconds")],
    "program",
]


@dataclass(frozen=True)
class Spent:
    """What an effort led to: cost, iterations of IPOPT in all attempts, seconds, and what is wrong with the motion."""

    cost: float
    iterations: int
    seconds: float
    wrong: str = ""

    @classmethod
    def of(cls, result: Plan, seconds: float) -> Spent:
        """Return what a plan took, and whether its motion is the one that the task's first line describes."""
        wrong = "; ".join(CLAIMS[result.name].broken(result)) if result.status.solved else "not solved"
        iterations = sum(each.iterations for each in result.statistics.attempts)
        return cls(result.statistics.objective, iterations, seconds, wrong)

    def cells(self) -> list[str]:
        """Return the three cells; ✗ is a motion that is not solved or is not what its task says."""
        return [f"{self.cost:.5g}" + (" ✗" if self.wrong else ""), str(self.iterations), f"{self.seconds:.0f}"]


def spent(name: str, effort: str) -> Spent:
    """Plan a task with an effort."""
    begin = time.perf_counter()
    result = plan(load_task(ROOT / "tasks" / f"{name}.yaml", [*EFFORTS[effort], "solver.processes=1"]))
    return Spent.of(result, time.perf_counter() - begin)


def summary(rows: list[list[str]]) -> str:
    """Return a table of what each effort costs and takes beside that of the default call, over all tasks."""
    first, lines = 1, []
    for column, (effort, changes) in zip(range(first, len(HEADER), 3), EFFORTS.items(), strict=False):
        done = [row for row in rows if "✗" not in row[column] + row[first]]
        above = [float(row[column]) / float(row[first]) - 1 for row in done]
        fewer = [float(row[first + 1]) / float(row[column + 1]) for row in done]
        faster = [float(row[first + 2]) / max(float(row[column + 2]), 1.0) for row in done]
        ratios = [f"{np.median(each):.3g}" for each in (fewer, faster)]
        costs = [f"{100 * np.median(above):.3g} %", f"{100 * max(above):.3g} %"]
        settings = " ".join(f"--set {one}" for one in changes)
        lines.append([effort, f"`{settings}`" if settings else "", f"{len(done)} of {len(rows)}", *costs, *ratios])
    header = ["effort", "settings", "does what its task says", "median cost above the default", "largest",
              "times fewer iterations", "times faster"]  # fmt: skip
    return markdown_table(header, lines)


def page_of(rows: list[list[str]], processes: int) -> str:
    """Return the page with the rows of all tasks so far."""
    return "\n".join(
        [
            "# More and less effort than the default call",
            "",
            made_by("effort", processes),
            "",
            "Every effort ends with refinement, audit and certificate, and has the fallback settings of a task that is "
            "not solved. Iterations are those of IPOPT in all attempts; seconds are those of one core, compiled "
            "functions from the cache. ✗: not solved, or not the motion that the first line of the task describes.",
            "",
            summary(rows),
            PROGRAM_IS,
            "",
            markdown_table(HEADER, rows),
        ]
    )


def main() -> int:
    """Plan every task with every effort and write the table."""
    arguments = task_parser(__doc__, PAGE).parse_args()
    rows = Rows(arguments.page, HEADER)
    for name, done in planned_in_all_ways(spent, arguments.tasks, EFFORTS, arguments.processes):
        rows.put([name, *[cell for one in done for cell in one.cells()], program_of(name)])
        wrong = [f"{effort}: {one.wrong}" for effort, one in zip(EFFORTS, done, strict=True) if one.wrong]
        print(" ".join([*rows.by_name[name], *wrong]), flush=True)
        arguments.page.write_text(page_of(rows.cells, arguments.processes), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
