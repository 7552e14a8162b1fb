"""Solve the same problems with fesd-robot and with nosnoc, one after the other, and compare in one table.

    python scripts/benchmarks/compare_nosnoc.py
    python scripts/benchmarks/compare_nosnoc.py --task one_jump --order nosnoc-first --repeat 3 --json comparison.json
    python scripts/benchmarks/compare_nosnoc.py --task all --page docs/results/compare_nosnoc.md

Model, bounds, costs, start, control intervals and finite elements are the same; each problem is written down once, in
`compare/`. nosnoc runs with its authors' settings for the example. Each run is a process of its own with one thread.
Wall time runs from the description of the problem to the result; starting Python and importing packages is left out.
Needs the extra `bench`.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import importlib.util
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy is imported

from scripts.benchmarks.compare.outcome import TITLES, TOOLS, Outcome, Settings
from scripts.benchmarks.compare.page import Comparison, page, table, typical
from scripts.benchmarks.compare.problems import PROBLEMS

PACKAGES = {"ours": ("fesd-robot", "casadi", "numpy", "pin"), "nosnoc": ("nosnoc", "casadi", "numpy")}


def work(arguments: argparse.Namespace) -> None:
    """Do one run in this process and leave its outcome in the file asked for."""
    settings = Settings(arguments.tolerance, arguments.multipliers, arguments.linear_solver, arguments.grid)
    outcome = PROBLEMS[arguments.task].run[arguments.worker](settings)
    arguments.json.write_text(json.dumps(asdict(outcome)), encoding="utf-8")


def run_in_child(tool: str, task: str, settings: Settings, verbose: bool) -> Outcome:
    """Run one tool in a process of its own, with one thread."""
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder) / "outcome.json"
        options = {
            "--worker": tool,
            "--task": task,
            "--multipliers": settings.multipliers,
            "--linear-solver": settings.linear_solver,
            "--grid": settings.grid,
            "--tolerance": repr(settings.tolerance),
            "--json": str(answer),
        }
        finished = subprocess.run(
            [
                *(sys.executable, str(Path(__file__).resolve())),
                *(word for pair in options.items() for word in pair),
            ],
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            stdout=sys.stderr if verbose else subprocess.DEVNULL,
            stderr=None if verbose else subprocess.PIPE,
            text=True,
            check=False,
        )
        if finished.returncode != 0:
            tail = "\n".join((finished.stderr or "").strip().splitlines()[-15:])
            raise SystemExit(f"The run of {TITLES[tool]} failed (exit status {finished.returncode}).\n{tail}")
        return Outcome(**json.loads(answer.read_text(encoding="utf-8")))


def compare(task: str, tools: Sequence[str], settings: Settings, arguments: argparse.Namespace) -> Comparison:
    """Run the tools in turns on one problem.

    Args:
        tools: in the order in which they run.
    """
    runs: dict[str, list[Outcome]] = {tool: [] for tool in TOOLS if tool in tools}
    for turn in range(1, arguments.repeat + 1):
        for tool in tools:
            what = f"{PROBLEMS[task].title}: {TITLES[tool]}, run {turn} of {arguments.repeat} ... "
            print(what, end="", file=sys.stderr, flush=True)
            runs[tool].append(run_in_child(tool, task, settings, arguments.verbose))
            print(f"{runs[tool][-1].wall_seconds:.1f} s", file=sys.stderr, flush=True)
    return Comparison(task, settings, runs)


def version(package: str) -> str:
    """Return the installed version of a package."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def parse(words: Sequence[str] | None) -> argparse.Namespace:
    """Return the command line's options."""
    parser = argparse.ArgumentParser(
        description="Solve the same problems with fesd-robot and with nosnoc, and compare.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    parser.add_argument(
        "--task",
        choices=[*PROBLEMS, "all"],
        default="five_jumps",
        help="which problem; all: every one, the hoppers also with the other multipliers in nosnoc",
    )
    parser.add_argument(
        "--tolerance", type=float, default=1e-8, help="complementarity fesd-robot is asked for; nosnoc keeps its own"
    )
    parser.add_argument(
        "--multipliers",
        choices=["published", "correct"],
        default="published",
        help="how nosnoc's hopper weights its vector fields: as in its authors' example, where the weights do not sum "
        "to 1 in contact, or so that they do",
    )
    parser.add_argument(
        "--linear-solver", choices=["auto", "mumps"], default="auto", help="of fesd-robot; nosnoc uses MUMPS"
    )
    parser.add_argument(
        "--grid",
        choices=["uniform", "phases"],
        default="uniform",
        help="of fesd-robot's hoppers: as in nosnoc, or the default of tasks, whose intervals move with the contacts",
    )
    parser.add_argument("--order", choices=["ours-first", "nosnoc-first"], default="ours-first", help="who runs first")
    parser.add_argument("--only", choices=TOOLS, help="run one tool alone")
    parser.add_argument("--repeat", type=int, default=1, help="runs of each tool, in turns; the median time is shown")
    parser.add_argument("--json", type=Path, metavar="FILE", help="save all numbers of all runs")
    parser.add_argument("--page", type=Path, metavar="FILE", help="write a page with the tables")
    parser.add_argument("--verbose", action="store_true", help="show what the tools print while they run")
    parser.add_argument("--worker", choices=TOOLS, help=argparse.SUPPRESS)
    arguments = parser.parse_args(words)
    if arguments.repeat < 1:
        parser.error(f"argument --repeat: found {arguments.repeat}, expected 1 or more")
    if not 0 < arguments.tolerance < 1:
        parser.error(f"argument --tolerance: found {arguments.tolerance:g}, expected more than 0 and less than 1")
    for option in ("json", "page"):
        file = getattr(arguments, option)
        if file and not file.parent.is_dir():
            parser.error(f"argument --{option}: there is no folder {file.parent}")
    if arguments.page and arguments.only:
        parser.error("argument --page: compares both tools, leave out --only")
    return arguments


def main(words: Sequence[str] | None = None) -> None:
    """Run the comparison."""
    arguments = parse(words)
    if arguments.worker:
        work(arguments)
        return
    order = TOOLS if arguments.order == "ours-first" else TOOLS[::-1]
    tools = [tool for tool in order if arguments.only in (None, tool)]
    if "nosnoc" in tools and importlib.util.find_spec("nosnoc") is None:
        raise SystemExit(
            "nosnoc is not installed. Install it with the extra 'bench': pip install 'fesd-robot[bench]'\n"
            "Or run fesd-robot alone: --only ours"
        )
    versions = {"python": platform.python_version()} | {
        package: version(package) for tool in tools for package in PACKAGES[tool]
    }
    settings = Settings(arguments.tolerance, arguments.multipliers, arguments.linear_solver, arguments.grid)
    comparisons: list[Comparison] = []
    for task in PROBLEMS if arguments.task == "all" else [arguments.task]:
        new = [compare(task, tools, settings, arguments)]
        if arguments.task == "all" and PROBLEMS[task].weighted and "nosnoc" in tools:
            other = replace(settings, multipliers="correct" if settings.multipliers == "published" else "published")
            again = compare(task, ["nosnoc"], other, arguments)
            new.append(replace(again, runs=new[0].runs | again.runs))
        comparisons += new
        print("\n\n".join(table(one, versions) for one in new), end="\n\n", flush=True)
    if arguments.page:
        command = f"python scripts/benchmarks/compare_nosnoc.py {' '.join(words or sys.argv[1:])}"
        arguments.page.write_text(page(comparisons, versions, command), encoding="utf-8")
    if arguments.json:
        arguments.json.write_text(
            json.dumps(_record(comparisons, arguments, versions), indent=1) + "\n", encoding="utf-8"
        )


def _record(
    comparisons: Sequence[Comparison], arguments: argparse.Namespace, versions: dict[str, str]
) -> dict[str, Any]:
    return {
        "versions": versions,
        "order": arguments.order,
        "comparisons": [
            {
                "task": one.task,
                "tolerance": one.settings.tolerance,
                "multipliers": one.settings.multipliers,
                "median_wall_seconds": {
                    tool: statistics.median(run.wall_seconds for run in runs) for tool, runs in one.runs.items()
                },
                "typical": {tool: asdict(typical(runs)) for tool, runs in one.runs.items()},
                "runs": {tool: [asdict(run) for run in runs] for tool, runs in one.runs.items()},
            }
            for one in comparisons
        ],
    }


if __name__ == "__main__":
    main()
