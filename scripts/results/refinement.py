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
import sys
import time
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
from fesd_robot.plans.tables import markdown_table
from fesd_robot.refinement.refine import refined
from fesd_robot.refinement.repair import Repair
from fesd_robot.refinement.solved_motion import SolvedMotion
from fesd_robot.sweeps import Answer, Order, Verdict
from scripts.results.moved_start import MOVED, moved
from scripts.tools.arguments import ROOT
from scripts.tools.table import PROGRAM_IS, Row, Table, settings_of

TASKS: dict[str, list[str]] = {
    "biped_step": [],
    "hopper_one_jump": [],
    "hopper_stairs": ["ground.smoothing=0.05"],
    "monoped_three_holes": ["solver.seed=2"],
    "monoped_two_jumps": [],
    "solo12_jump": [],
}
"""Name of a task -> overrides. All have two stages, from which three holes find no motion with the first guess."""

SEED = 1
"""Of what moves a start."""

REFERENCE_PARTS = 4
SMALLEST = 1e-9
"""Errors below this are round-off, and no estimate is held against them."""

COLUMNS = (
    "solved in", "audit before", "worst entry before", "error before", "estimate / error", "within 3", "refined in",
    "rounds, iterations", "elements", "stages", "error after", "worst entry after", "costs",
)  # fmt: skip
WORST = "worst after"
"""Largest entry of the audit of the refined motion, in multiples of its limit."""


def case(name: str, is_moved: bool) -> str:
    """Return what a row is called."""
    return " ".join([name, *TASKS[name]]) + (", moved" if is_moved else "")


def measured(order: Order, file: Path) -> Answer:
    """Solve a task, from a moved start where its case says so, and refine its motion."""
    task = load_task(file, order.overrides)
    motion, options = formulate(task), homotopy_options(task)
    transcription = Transcription(motion.ocp, motion.fesd)
    polisher, repair = BranchTranscription(transcription), Repair(transcription, Run(options))
    begin = time.perf_counter()
    homotopy = moved(solve, SEED) if order.case.endswith(", moved") else solve
    solution = homotopy(transcription.problem, Run(options), polisher=polisher, otherwise=repair)
    polisher, solution = repair.repaired(polisher, solution)
    transcription = polisher.transcription
    seconds = f"{time.perf_counter() - begin:.0f} s"
    if not solution.exact:
        return Answer(order.number, Verdict.NOT_SOLVED, {COLUMNS[0]: seconds}, "no exact motion")
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
    words = (
        seconds,
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
    )
    values = {"cost": float(after.solution.residuals.objective), WORST: float(left)}
    return Answer(order.number, Verdict.SOLVED, {**values, **dict(zip(COLUMNS, words, strict=True))}, "refined")


def accurate(row: Row) -> bool:
    """Return whether no entry of a refined motion's audit is above a tenth of its limit."""
    return row[WORST] is not None and row[WORST] <= 0.1


def page_of(rows: list[Row]) -> str:
    """Return the page."""
    cells = [[row["case"], *(row[name] or "" for name in COLUMNS), row["message"], TABLE.program(row)] for row in rows]
    return "\n".join(
        [
            "# Refinement",
            "",
            TABLE.made_by(rows),
            "",
            "Every task is solved from two stages on a uniform grid, as it is and from a start moved by "
            f"{MOVED:g}. *Before* is its exact motion as polishing left it, *after* is that motion refined to "
            "`method.accuracy` = 1e-7, on its branch, or on one near by where that has no solution. "
            "The worst entry of an audit is given in multiples of its limit; replay, limits and forces between stages "
            f"are among the entries; {sum(map(accurate, rows))} of {len(rows)} refined motions are within a tenth of "
            "all limits. *Estimate / error* "
            f"compares the estimated local error of every element with that of an integration in {REFERENCE_PARTS} "
            f"parts with one more stage each, for the elements with errors above {SMALLEST:g}. Iterations are IPOPT's, "
            f"of all rounds. {PROGRAM_IS}",
            "",
            markdown_table(["task", *COLUMNS, "end", "program"], cells),
        ]
    )


TABLE = Table(
    ROOT / "docs" / "results" / "refinement.md",
    {
        "set": {"method.grid": "uniform"},
        "cases": {
            case(name, is_moved): {"task": name, **settings_of(changes)}
            for name, changes in TASKS.items()
            for is_moved in (False, True)
        },
    },
    page_of,
    measured,
    {**dict.fromkeys(COLUMNS, str), WORST: float},
)

if __name__ == "__main__":
    sys.exit(0 if all(map(accurate, TABLE.main(__doc__ or ""))) else 1)
