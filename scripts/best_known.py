"""How far the default call is from the best motion that ten times the effort finds.

    python scripts/best_known.py hopper_one_jump hopper_wedge --processes 2

Every task is planned by the default call and then from ten other starts: other initial guesses, discretisations and
schedules of sigma, each with its own search, refinement and audit. Beside them an annealed walk starts from the default
plan, which knows no derivatives: a neighbour is drawn, and what is dearer is accepted, too, with a probability that
falls with the loss and with time; from its cheapest motion the task is planned again, as a warm start. All motions are
held against the task as it is: the same grid of controls, limits, goal and costs. The table goes to
docs/results/best_known.md. Rows of tasks that are not planned stay as they are. Exit code 1 if a default costs more
than a twentieth above the best.
"""

from __future__ import annotations

import math
import os
import platform
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import casadi
import numpy as np
from arguments import PROGRAM_IS, ROOT, earlier_rows, program_of, task_parser

from fesd_robot import load_task, plan, read_plan, write_plan
from fesd_robot.adapters import homotopy_options
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.neighbours import moves
from fesd_robot.known_sequence import finite_elements_of, known_start
from fesd_robot.mpcc import TRIALS, BranchPoint, PolishingReport
from fesd_robot.neighbourhood import Neighbourhood
from fesd_robot.ocp import formulate
from fesd_robot.planner import attempt
from fesd_robot.plans import Plan
from fesd_robot.plans.tables import markdown_table
from fesd_robot.strategies.deadline import Deadline

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

STEPS = 300
"""Of the annealed walk."""

WARMEST = 0.05
"""Of the cost: a loss that is accepted with a probability of 1/e at the beginning; it falls to zero in a line."""

HEADER = [
    "task",
    "default",
    "best",
    "above the best",
    "from",
    "solved",
    "median of the others",
    "annealed walk",
    "seconds",
    "all seconds",
    "program",
]


def planned(name: str, overrides: tuple[str, ...] | None) -> tuple[Plan, float]:
    """Return the plan of a task from one start, by the default call for None, and the seconds that it took."""
    begin = time.perf_counter()
    task = load_task(ROOT / "tasks" / f"{name}.yaml", list(overrides or ()))
    return plan(task) if overrides is None else attempt(task), time.perf_counter() - begin


def annealed(name: str, start: Plan) -> tuple[Plan, float]:
    """Return the plan that a walk through the neighbours of a plan leads to, and the seconds that it took."""
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        file = write_plan(start, Path(folder) / "start")
        task = load_task(ROOT / "tasks" / f"{name}.yaml", [f"solver.warm_start={file}"])
        motion, options = formulate(task), homotopy_options(task)
        known = known_start(motion, Transcription(motion.ocp, motion.fesd), options, Deadline(), None, None)
        if known is None or known[1].branch is None:
            return start, time.perf_counter() - begin
        polisher, solution = known
        around = Neighbourhood.of(polisher.transcription, solution.w, known[1].branch, options, Deadline(), None)
        lowest = walked(around, np.random.default_rng(0))
        if lowest is not None:
            elements = finite_elements_of(around.transcription, lowest.w, lowest.branch)
            write_plan(read_plan(file).model_copy(update={"finite_elements": elements}), file)
        return attempt(task), time.perf_counter() - begin


def walked(around: Neighbourhood, draw: np.random.Generator) -> PolishingReport | None:
    """Return the cheapest motion of an annealed walk, None if not even the first is found again."""
    now = lowest = around.solver.exact(around.start)
    for step in range(STEPS):
        if now is None or lowest is None:
            return None
        warmth = WARMEST * abs(lowest.residuals.objective) * (1 - step / STEPS)
        found = list(moves(around.transcription, around.polisher.conditions, now.w, now.branch))
        move = found[draw.integers(len(found))]
        trial = around.solver.tried(BranchPoint(move.w, move.branch), TRIALS[0])
        if trial is None or not trial.residuals.constraint_violation <= TRIALS[0].violation:
            continue
        loss = trial.residuals.objective - now.residuals.objective
        if loss > 0 and draw.random() >= math.exp(-loss / warmth):
            continue
        if end := around.filled(around.solver.exact_after(trial)):
            now, lowest = end, min(lowest, end, key=lambda one: one.residuals.objective)
    return lowest


def row(
    name: str, default: tuple[Plan, float], others: list[tuple[Plan, float]], walk: tuple[Plan, float]
) -> tuple[list[str], float]:
    """Return the cells of a task, and how far its default is above the best."""
    costs = {
        " ".join(start): one.statistics.objective
        for start, (one, _) in zip(STARTS, others, strict=True)
        if one.status.solved
    }
    own = default[0].statistics.objective if default[0].status.solved else float("inf")
    annealing = walk[0].statistics.objective if walk[0].status.solved else float("inf")
    start, best = min([("the default", own), *costs.items(), ("the walk", annealing)], key=lambda item: item[1])
    above = (own - best) / max(abs(best), 1e-9)
    ordered = sorted(costs.values())
    median = f"{ordered[len(ordered) // 2]:.5g}" if ordered else ""
    seconds = default[1] + sum(one[1] for one in others) + walk[1]
    numbers = [
        f"{own:.5g}",
        f"{best:.5g}",
        f"{above:.1%}",
        start,
        f"{len(costs)} of {len(others)}",
        median,
        f"{annealing:.5g}",
    ]
    return [name, *numbers, f"{default[1]:.0f}", f"{seconds:.0f}", program_of(name)], above


def main() -> int:
    """Plan every task from every start and write the table."""
    arguments = task_parser(__doc__, PAGE).parse_args()
    rows, far = earlier_rows(arguments.page, HEADER), []
    with ProcessPoolExecutor(arguments.processes) as pool:
        jobs = {name: [pool.submit(planned, name, one) for one in (None, *STARTS)] for name in arguments.tasks}
        walks = {name: pool.submit(annealed, name, own[0].result()[0]) for name, own in jobs.items()}
        for name, (default, *others) in jobs.items():
            rows[name], above = row(name, default.result(), [job.result() for job in others], walks[name].result())
            far += [name] if above > ALLOWED else []
            print(" ".join(rows[name]), flush=True)
    starts = ", ".join("`" + " ".join(start) + "`" for start in STARTS)
    lines = [
        "# How far the default is from the best motion known",
        "",
        f"Made by `python scripts/best_known.py TASK ...`, processes: {arguments.processes}, "
        f"Python {platform.python_version()}, casadi {casadi.__version__}.",
        "",
        "Every task is planned by the default call and from ten other starts, each with its own search, refinement and "
        f"audit: {starts}; and from an annealed walk of {STEPS} steps through the neighbours of the default. Costs are "
        "of solved motions only. " + PROGRAM_IS,
        "",
        markdown_table(HEADER, [rows[name] for name in sorted(rows)]),
    ]
    arguments.page.write_text("\n".join(lines), encoding="utf-8")
    return 1 if far else 0


if __name__ == "__main__":
    sys.exit(main())
