"""Time from a task to the functions of its NLP, over the number of intervals.

The five-jump hopper with more and more intervals of the same duration together, and other tasks. The table goes to
docs/results/bench_build.md. Exit code 1 if the transcription of the hopper as shipped takes more than a second or if
anything grows faster than the number of intervals.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path
from typing import TypeVar

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from fesd_robot import load_task
from fesd_robot.fesd import Transcription
from fesd_robot.mpcc.assembly import assemble
from fesd_robot.mpcc.relaxations import RELAXATIONS
from fesd_robot.ocp import formulate

ROOT = Path(__file__).parents[2]
HOPPER = "published_hopper_five_jumps"
LIMIT = 1.0
"""Seconds for the transcription of the hopper as shipped."""
EXCESS = 1.3
"""Allowed growth, beside that of the number of intervals."""

Result = TypeVar("Result")


def main() -> int:
    """Time everything and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--intervals", type=int, nargs="+", default=[50, 100, 200, 400])
    tasks = ["monoped_two_jumps", "solo12_jump", "solo12_jump_in_space"]
    parser.add_argument("--tasks", nargs="*", default=tasks, help="beside the hopper")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--page", type=Path, default=ROOT / "docs" / "results" / "bench_build.md")
    arguments = parser.parse_args()
    rows, hopper = [], {}
    cases = [(HOPPER, count) for count in arguments.intervals] + [(name, None) for name in arguments.tasks]
    for name, count in cases:
        with tempfile.TemporaryDirectory() as folder:
            runs = [_measured(name, count, Path(folder) / str(number)) for number in range(arguments.repeat)]
        intervals, variables = runs[0][0]
        seconds = np.median([times for _, times in runs], axis=0)
        if name == HOPPER:
            hopper[intervals] = seconds
        rows.append(f"| {name} | {intervals} | {variables} | {' | '.join(f'{value:.2f}' for value in seconds)} |")
        print(rows[-1], flush=True)
    arguments.page.write_text(
        "\n".join(
            [
                "# Time to build a problem",
                "",
                f"Made by `python scripts/benchmarks/bench_build.py --repeat {arguments.repeat}`, Python "
                f"{platform.python_version()}, casadi {version('casadi')}, {os.cpu_count()} processors.",
                "",
                "Seconds, median of the repetitions. Formulation: from the task file to the optimal control problem. "
                "Transcription: to the problem with complementarity. Interpreted: derivatives, and the NLP's functions "
                "as CasADi graphs. Compiled first: with an empty cache; again: from the cache; other goal: the "
                "terminal cost differs from what is in the cache.",
                "",
                "| task | intervals | variables | formulation | transcription | interpreted | compiled first | again "
                "| other goal |",
                "| :-- | --: | --: | --: | --: | --: | --: | --: | --: |",
                *rows,
                "",
            ]
        )
    )
    return int(_fails(hopper))


def _fails(hopper: dict[int, np.ndarray]) -> bool:
    """Say what is too slow."""
    counts, failed = sorted(hopper), False
    if counts and hopper[counts[0]][:2].sum() > LIMIT:
        print(f"the transcription takes more than {LIMIT} s")
        failed = True
    for few, many in pairwise(counts):
        grown = hopper[many] / hopper[few]
        if grown.max() > EXCESS * many / few:
            print(f"{few} to {many} intervals: the time grows {np.round(grown, 1)} times")
            failed = True
    return failed


def _measured(name: str, count: int | None, cache: Path) -> tuple[tuple[int, int], list[float]]:
    """Return intervals and variables, and the seconds of every step."""
    changes = [] if count is None else [f"horizon.intervals={count}"]
    file = ROOT / "tasks" / f"{name}.yaml"
    motion, formulation = _timed(lambda: formulate(load_task(file, changes)))
    problem, transcription = _timed(lambda: Transcription(motion.ocp, motion.fesd).problem)
    _, interpreted = _timed(lambda: assemble(problem, RELAXATIONS["scholtes"], "never"))
    shifted = formulate(load_task(file, [*changes, f"costs.terminal_velocity.{motion.robot.velocity_names[0]}=7"]))
    other = Transcription(shifted.ocp, shifted.fesd).problem
    kept = os.environ.get("FESD_ROBOT_CACHE")
    os.environ["FESD_ROBOT_CACHE"] = str(cache)
    try:
        _, first = _timed(lambda: assemble(problem, RELAXATIONS["scholtes"], "always"))
        _, again = _timed(lambda: assemble(problem, RELAXATIONS["scholtes"], "always"))
        _, changed = _timed(lambda: assemble(other, RELAXATIONS["scholtes"], "always"))
    finally:
        os.environ.pop("FESD_ROBOT_CACHE")
        if kept is not None:
            os.environ["FESD_ROBOT_CACHE"] = kept
    times = [formulation, transcription, interpreted, first, again, changed]
    return (motion.task.horizon.intervals, problem.size), times


def _timed(run: Callable[[], Result]) -> tuple[Result, float]:
    begin = time.perf_counter()
    result = run()
    return result, time.perf_counter() - begin


if __name__ == "__main__":
    sys.exit(main())
