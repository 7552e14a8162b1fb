"""Time of an IPOPT iteration, split into functions, linear solver and the rest, over the number of intervals.

The first NLP of the five-jump hopper's homotopy, stopped after some iterations, with MUMPS and with our own linear
solver, functions interpreted and compiled, all in one process and in turns. The table goes to
docs/results/bench_iteration.md.
"""

from __future__ import annotations

import argparse
import os
import platform
import re
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import casadi
import numpy as np

from fesd_robot import load_task
from fesd_robot.fesd import Transcription
from fesd_robot.mpcc import solve
from fesd_robot.mpcc.assembly import assemble
from fesd_robot.mpcc.relaxations import RELAXATIONS
from fesd_robot.ocp import formulate
from fesd_robot.planner import homotopy_options

ROOT = Path(__file__).parent.parent
WAYS = {
    "mumps, interpreted": ("mumps", "never"),
    "mumps, compiled": ("mumps", "always"),
    "fesd, interpreted": ("fesd", "never"),
    "fesd, compiled": ("fesd", "always"),
}
PARTS = {
    "total": r"OverallAlgorithm\.*: +([\d.]+)",
    "linear solver": r"PDSystemSolverTotal\.*: +([\d.]+)",
    "functions": r"Function Evaluations\.*: +([\d.]+)",
    "iterations": r"Number of Iterations\.*: +(\d+)",
}
"""CPU seconds in IPOPT's timing statistics."""


def main() -> int:
    """Time everything and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--intervals", type=int, nargs="+", default=[50, 100, 200, 400])
    parser.add_argument("--iterations", type=int, default=40)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--page", type=Path, default=ROOT / "docs" / "results" / "bench_iteration.md")
    arguments = parser.parse_args()
    rows, slowest = [], {}
    for count in arguments.intervals:
        task = load_task(ROOT / "tasks" / "hopper_five_jumps.yaml", [f"horizon.intervals={count}"])
        motion = formulate(task)
        problem = Transcription(motion.ocp, motion.fesd).problem
        nlps = {how: assemble(problem, RELAXATIONS["scholtes"], how) for how in ("never", "always")}
        found: dict[str, list[dict[str, float]]] = {name: [] for name in WAYS}
        for _ in range(arguments.repeat):
            for name, (solver, compiled) in WAYS.items():
                found[name].append(_timed(task, problem, nlps[compiled], solver, arguments.iterations))
        for name, runs in found.items():
            median = {part: float(np.median([run[part] for run in runs])) for part in PARTS}
            reference = slowest.setdefault(count, median["total"])
            rest = median["total"] - median["linear solver"] - median["functions"]
            rows.append(
                f"| {count} | {problem.size} | {name} | {median['total']:.1f} | {median['linear solver']:.1f} | "
                f"{median['functions']:.2f} | {rest:.1f} | {reference / median['total']:.2f} | "
                f"{median['iterations']:.0f} |"
            )
            print(rows[-1], flush=True)
    arguments.page.write_text(
        "\n".join(
            [
                "# Time of an iteration",
                "",
                f"Made by `python scripts/bench_iteration.py --iterations {arguments.iterations} --repeat "
                f"{arguments.repeat}`, Python {platform.python_version()}, casadi {casadi.__version__}, one thread. "
                "CPU milliseconds an IPOPT iteration, first NLP of the five-jump hopper with more and more intervals; "
                "median of the repetitions, in which the ways took turns. Faster: than the first way.",
                "",
                "| intervals | variables | way | total | linear solver | functions | rest | faster | iterations |",
                "| --: | --: | :-- | --: | --: | --: | --: | --: | --: |",
                *rows,
                "",
            ]
        )
    )
    return 0


def _timed(task, problem, nlp, solver: str, iterations: int) -> dict[str, float]:  # type: ignore[no-untyped-def]
    """CPU milliseconds an iteration of each part."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "ipopt.txt"
        ipopt = {"print_timing_statistics": "yes", "output_file": str(file), "file_print_level": 3}
        options = replace(homotopy_options(task), linear_solver=solver, max_iterations=iterations, ipopt=ipopt)
        options = replace(options, tolerance=options.sigma_start * 0.99, rank_ratio=1.0)
        solve(problem, options, nlp=nlp)
        text = file.read_text()
    values = {part: float(re.findall(pattern, text)[0]) for part, pattern in PARTS.items()}
    return {
        part: value if part == "iterations" else 1e3 * value / values["iterations"] for part, value in values.items()
    }


if __name__ == "__main__":
    sys.exit(main())
