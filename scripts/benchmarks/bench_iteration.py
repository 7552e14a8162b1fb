"""Time of an IPOPT iteration, split into functions, factorisation, solves and all else, for several tasks.

The first NLP of a task's homotopy, stopped after some iterations, with MUMPS and with our own linear solver, functions
interpreted and compiled, all in one process and taking turns; the same functions alone, outside IPOPT; and the time of
a whole plan, interpreted and compiled. The tables go to docs/results/bench_iteration.md.
"""

from __future__ import annotations

import argparse
import os
import platform
import re
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import casadi
import numpy as np

from fesd_robot import Task, load_task
from fesd_robot.fesd import Transcription
from fesd_robot.mpcc import Mpcc, Run, solve
from fesd_robot.mpcc.assembly import RelaxedNlp, assemble
from fesd_robot.mpcc.relaxations import RELAXATIONS
from fesd_robot.ocp import formulate
from fesd_robot.ocp.solver_options import homotopy_options
from fesd_robot.planning.planner import plan

ROOT = Path(__file__).parents[2]
CASES = [
    *(("published_hopper_five_jumps", [f"horizon.intervals={count}"]) for count in (50, 100, 200, 400)),
    ("monoped_two_jumps", []),
    ("solo12_jump", []),
    ("solo12_jump_in_space", []),
]
"""Tasks and what is changed in them."""

PLANNED = "solo12_jump"
"""The task that is planned to its end."""

WAYS = {
    "mumps, interpreted": ("mumps", "never"),
    "mumps, compiled": ("mumps", "always"),
    "fesd, interpreted": ("fesd", "never"),
    "fesd, compiled": ("fesd", "always"),
}
PARTS = {
    "total": r"OverallAlgorithm\.*: +([\d.]+)",
    "functions": r"Function Evaluations\.*: +([\d.]+)",
    "linear systems": r"StdAugSystemSolverMultiSolve\.*: +([\d.]+)",
    "solves": r"LinearSystemBackSolve\.*: +([\d.]+)",
    "iterations": r"Number of Iterations\.*: +(\d+)",
}
"""CPU seconds in IPOPT's timing statistics."""

CACHE_DISTURBANCE = np.ones(3_000_000)
"""24 MB to run through between two evaluations, as much memory as a factorisation touches."""


def main() -> int:
    """Time everything and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tasks", nargs="+", default=sorted({name for name, _ in CASES}), help="of the list of tasks")
    parser.add_argument("--iterations", type=int, default=40)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument(
        "--plans", type=int, default=1, help="how often the whole plan is timed each way, 0: not at all"
    )
    parser.add_argument("--page", type=Path, default=ROOT / "docs" / "results" / "bench_iteration.md")
    arguments = parser.parse_args()
    iterations, functions = [], []
    for name, changes in CASES:
        if name not in arguments.tasks:
            continue
        task = load_task(ROOT / "tasks" / f"{name}.yaml", changes)
        motion = formulate(task)
        problem = Transcription(motion.ocp, motion.fesd).problem
        nlps = {how: assemble(problem, RELAXATIONS["scholtes"], how) for how in ("never", "always")}
        label = f"{name}, {task.horizon.intervals} intervals"
        functions += _functions(label, problem, nlps, 10 * arguments.repeat)
        iterations += _iterations(label, task, problem, nlps, arguments.iterations, arguments.repeat)
    plans = _plans(arguments.plans) if arguments.plans else []
    arguments.page.write_text(
        "\n".join(
            [
                "# Time of an iteration",
                "",
                f"Made by `python scripts/benchmarks/bench_iteration.py --tasks {' '.join(arguments.tasks)} "
                f"--iterations {arguments.iterations} --repeat "
                f"{arguments.repeat} --plans {arguments.plans}`, Python {platform.python_version()}, casadi "
                f"{version('casadi')}, one thread.",
                "",
                "CPU milliseconds per IPOPT iteration by IPOPT's own clock, first NLP of the task's homotopy; median "
                "of the repetitions, in which the settings took turns. Functions: with what IPOPT and CasADi copy and "
                "check around them. Factorisation: with ordering and scaling. Other: all else. Faster: than with the "
                "first setting.",
                "",
                "| task | variables | setting | total | functions | factorisation | solves | other | faster "
                "| iterations |",
                "| :-- | --: | :-- | --: | --: | --: | --: | --: | --: | --: |",
                *iterations,
                "",
                "## Functions alone",
                "",
                "Milliseconds of one evaluation of cost, constraints, gradient, Jacobian and Hessian, called by "
                "themselves; lower quintile of the repetitions. Cold: after 24 MB of other memory, as in a solver.",
                "",
                "| task | interpreted | compiled | faster | interpreted, cold | compiled, cold | faster |",
                "| :-- | --: | --: | --: | --: | --: | --: |",
                *functions,
                *(_plan_section(plans) if plans else []),
                "",
            ]
        )
    )
    return 0


def _iterations(
    label: str, task: Task, problem: Mpcc, nlps: dict[str, RelaxedNlp], iterations: int, repeat: int
) -> list[str]:
    """Time the first iterations with all settings; return rows of the table."""
    timings: dict[str, list[dict[str, float]]] = {name: [] for name in WAYS}
    for _ in range(repeat):
        for name, (solver, compiled) in WAYS.items():
            timings[name].append(_timed(task, problem, nlps[compiled], solver, iterations))
    rows, slowest = [], 0.0
    for name, runs in timings.items():
        median = {part: float(np.median([run[part] for run in runs])) for part in runs[0]}
        slowest = slowest or median["total"]
        rest = median["total"] - median["functions"] - median["factorisation"] - median["solves"]
        rows.append(
            f"| {label} | {problem.size} | {name} | {median['total']:.1f} | {median['functions']:.2f} | "
            f"{median['factorisation']:.1f} | {median['solves']:.1f} | {rest:.1f} | {slowest / median['total']:.2f} | "
            f"{median['iterations']:.0f} |"
        )
        print(rows[-1], flush=True)
    return rows


def _timed(task: Task, problem: Mpcc, nlp: RelaxedNlp, solver: str, iterations: int) -> dict[str, float]:
    """CPU milliseconds an iteration of each part."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "ipopt.txt"
        ipopt = {"print_timing_statistics": "yes", "output_file": str(file), "file_print_level": 3}
        options = replace(homotopy_options(task), linear_solver=solver, max_iterations=iterations, ipopt=ipopt)
        assert options.sigma_start
        options = replace(options, tolerance=options.sigma_start * 0.99, velocity_level_ratio=1.0)
        solve(problem, Run(options), nlp=nlp)
        text = file.read_text()
    values = {part: float(re.findall(pattern, text)[0]) for part, pattern in PARTS.items()}
    values["factorisation"] = values["linear systems"] - values["solves"]
    return {
        part: value if part == "iterations" else 1e3 * value / values["iterations"] for part, value in values.items()
    }


def _functions(label: str, problem: Mpcc, nlps: dict[str, RelaxedNlp], repeat: int) -> list[str]:
    """Time the functions alone; return a row of the table."""
    generator = np.random.default_rng(0)
    x = problem.start + 0.01 * generator.normal(size=problem.size)
    multipliers = generator.normal(size=len(nlps["never"].lower))
    times: dict[tuple[str, bool], list[float]] = {}
    for how, nlp in nlps.items():
        program, p = nlp.program, nlp.parameters([1.0, 1.0])
        calls = [
            _Call(program.nlp, (x, p), [0, 1]),
            _Call(program.gradient, (x, p), [1]),
            _Call(program.jacobian, (x, p), [1]),
            _Call(program.hessian, (x, p, [1.0], multipliers), [0]),
        ]
        for cold in (False, True):
            times[how, cold] = [sum(_seconds(call, cold) for call in calls) for _ in range(repeat)]
    low = {key: 1e3 * float(np.percentile(values, 20)) for key, values in times.items()}
    row = f"| {label} |" + "".join(
        f" {low['never', cold]:.2f} | {low['always', cold]:.3f} | {low['never', cold] / low['always', cold]:.1f} |"
        for cold in (False, True)
    )
    print(row, flush=True)
    return [row]


class _Call:
    """A function with fixed inputs and with memory for some of its outputs."""

    def __init__(self, function: casadi.Function, inputs: Sequence[object], outputs: list[int]) -> None:
        self._buffer: Any  # casadi's annotations want the size of a memory that knows it
        self._buffer, self.evaluate = function.buffer()
        self._arrays = [np.array(value, dtype=float) for value in inputs]
        for number, array in enumerate(self._arrays):
            self._buffer.set_arg(number, array.data)
        for number in outputs:
            self._arrays.append(np.zeros(function.nnz_out(number)))
            self._buffer.set_res(number, self._arrays[-1].data)


def _seconds(call: _Call, cold: bool) -> float:
    if cold:
        np.multiply(CACHE_DISTURBANCE, 1.0, out=CACHE_DISTURBANCE)
    else:
        call.evaluate()
    begin = time.perf_counter()
    call.evaluate()
    return time.perf_counter() - begin


def _plans(repeat: int) -> list[tuple[str, float, float, float]]:
    """Plan a task in turns; return for each way its seconds, those in IPOPT, and its iterations."""
    timings: dict[str, list[tuple[float, float, int]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        kept = os.environ.get("FESD_ROBOT_CACHE")
        for number in range(repeat):
            for way, how in (("interpreted", "never"), ("compiled, first time", "always"), ("compiled", "always")):
                if how == "always":
                    os.environ["FESD_ROBOT_CACHE"] = str(Path(folder) / str(number))
                begin = time.perf_counter()
                result = plan(load_task(ROOT / "tasks" / f"{PLANNED}.yaml", [f"method.compile={how}"]))
                seconds, statistics = time.perf_counter() - begin, result.statistics
                timings.setdefault(way, []).append((seconds, statistics.solve_seconds, statistics.iterations))
                print(way, timings[way][-1], flush=True)
                os.environ.pop("FESD_ROBOT_CACHE", None)
                if kept is not None:
                    os.environ["FESD_ROBOT_CACHE"] = kept
    return [(way, *np.median(np.array(runs), axis=0).tolist()) for way, runs in timings.items()]


def _plan_section(plans: list[tuple[str, float, float, float]]) -> list[str]:
    first = plans[0][1]
    return [
        "",
        f"## The whole plan of {PLANNED}",
        "",
        "Seconds from the task file to the audited plan, with our own linear solver. The first time the functions have "
        "to be compiled; later they are reused, the large ones also for another horizon or other goals.",
        "",
        "| functions | total | IPOPT | iterations | faster |",
        "| :-- | --: | --: | --: | --: |",
        *(
            f"| {way} | {total:.1f} | {solve_seconds:.1f} | {count:.0f} | {first / total:.2f} |"
            for way, total, solve_seconds, count in plans
        ),
    ]


if __name__ == "__main__":
    sys.exit(main())
