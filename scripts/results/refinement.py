"""Motions that begin inexact, before and after their refinement: audit, local errors and what it took.

    python scripts/results/refinement.py                     # all
    python scripts/results/refinement.py hopper_one_jump     # these only

Every task is solved twice on a uniform grid, as it is and from a start moved by 1e-12, which mostly leads to another
motion; the exact motion is audited as it was found, and after refinement. The estimate of local errors is held against
a four times finer integration of every element. The table goes to docs/results/refinement.md. Exit code 1 if an entry
of a refined motion's audit is above a tenth of its limit.
"""

from __future__ import annotations

import os
import platform
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from importlib.metadata import version
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from fesd_robot import load_task
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.fesd.refinement import local_errors
from fesd_robot.mpcc import NlpReport, Run, solve
from fesd_robot.ocp import formulate
from fesd_robot.ocp.solver_options import homotopy_options
from fesd_robot.refinement.refine import refined
from fesd_robot.refinement.repair import Repair
from fesd_robot.refinement.solved_motion import SolvedMotion
from scripts.results.moved_start import MOVED, moved

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "results" / "refinement.md"
TASKS = {
    "biped_step": [],
    "hopper_one_jump": [],
    "hopper_stairs": ["ground.smoothing=0.05"],
    "monoped_three_holes": ["solver.seed=2"],
    "monoped_two_jumps": [],
    "solo12_jump": [],
}
"""Name of a task -> overrides. All have two stages, from which three holes find no motion with the first guess."""

REFERENCE_PARTS = 4
SMALLEST = 1e-9
"""Errors below this are round-off, and no estimate is held against them."""

COLUMNS = (
    "task", "solved in", "audit before", "worst entry before", "error before", "estimate / error", "within 3",
    "refined in", "rounds, iterations", "elements", "stages", "error after", "worst entry after", "cost",
)  # fmt: skip


def measure(name: str, seed: int | None) -> list[str]:
    """Return the cells of one task.

    Args:
        name: of the task.
        seed: of what moves its start; None for the task as it is.
    """
    task = load_task(ROOT / "tasks" / f"{name}.yaml", ["method.grid=uniform", *TASKS[name]])
    motion, options = formulate(task), homotopy_options(task)
    transcription = Transcription(motion.ocp, motion.fesd)
    polisher, repair = BranchTranscription(transcription), Repair(transcription, Run(options))
    begin = time.perf_counter()
    homotopy = solve if seed is None else moved(solve, seed)
    solution = homotopy(transcription.problem, Run(options), polisher=polisher, otherwise=repair)
    polisher, solution = repair.repaired(polisher, solution)
    transcription = polisher.transcription
    seconds = time.perf_counter() - begin
    start = [" ".join([name, *TASKS[name]]) + ("" if seed is None else ", moved"), f"{seconds:.0f} s"]
    if not solution.exact:
        return [*start, "no exact motion", *[""] * (len(COLUMNS) - 3)]
    before = SolvedMotion.of(motion, polisher, solution)
    true = local_errors(before.on_branch, parts=REFERENCE_PARTS)
    looked_at = np.isfinite(true) & (true > SMALLEST)
    ratio = before.local_errors[looked_at] / true[looked_at]
    reports: list[NlpReport] = []
    assert task.method.accuracy != "none"
    begin = time.perf_counter()
    after = refined(before, task.method.accuracy, Run(options, report=reports.append))
    spent = time.perf_counter() - begin
    (most, worst), (left, last) = before.audit.worst, after.audit.worst
    return [
        *start,
        f"{len(before.audit.violations)} violated",
        f"{most:.3g} times ({worst})",
        f"{before.local_errors.max():.1e}",
        f"{ratio.min():.2f} ... {ratio.max():.2f}",
        f"{((ratio > 1 / 3) & (ratio < 3)).mean():.0%} of {ratio.size}",
        f"{spent:.1f} s",
        f"{after.rounds}, {sum(one.iterations for one in reports)}",
        f"{sum(transcription.elements)} -> {sum(after.transcription.elements)}",
        f"{before.stages} -> {after.stages}",
        f"{after.local_errors.max():.1e}",
        f"{left:.2g} times ({last})",
        f"{solution.residuals.objective:.5g} -> {after.solution.residuals.objective:.5g}",
    ]


def main() -> int:
    """Measure the tasks of the command line, or all, and write the table."""
    chosen = sys.argv[1:] or list(TASKS)
    if unknown := sorted(set(chosen) - set(TASKS)):
        sys.exit(f"found '{unknown[0]}', expected one of {', '.join(TASKS)}")
    with ProcessPoolExecutor(int(os.environ.get("JOBS", "2"))) as pool:
        jobs = [pool.submit(measure, name, seed) for name in chosen for seed in (None, 1)]
        rows = []
        for job in jobs:
            rows.append(job.result())
            print(" | ".join(rows[-1]), flush=True)
    words = (
        "Every task is solved from two stages on a uniform grid, as it is and from a start moved by "
        f"{MOVED:g}. *Before* is its exact motion as polishing left it, *after* is that motion refined to "
        "`method.accuracy` = 1e-7, on its branch, or on one near by where that has no solution. "
        "The worst entry of an audit is given in multiples of its limit; replay, limits and forces between stages are "
        "among the entries. *Estimate / error* "
        f"compares the estimated local error of every element with that of an integration in {REFERENCE_PARTS} parts "
        "with one more stage each, for the elements with errors above "
        f"{SMALLEST:g}. Iterations are IPOPT's, of all rounds."
    )
    program = "python scripts/results/refinement.py"
    made = f"Made by `{program}`, Python {platform.python_version()}, casadi {version('casadi')}."
    table = [f"| {' | '.join(COLUMNS)} |", f"|{' --- |' * len(COLUMNS)}", *(f"| {' | '.join(row)} |" for row in rows)]
    PAGE.write_text("\n".join(["# Refinement", "", made, "", words, "", *table, ""]), encoding="utf-8")
    accurate = [row[-2] != "" and float(row[-2].split(" ")[0]) <= 0.1 for row in rows]
    return 0 if all(accurate) else 1


if __name__ == "__main__":
    sys.exit(main())
