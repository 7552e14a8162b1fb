"""Plan the same jumping hopper with fesd-robot and with nosnoc, one after the other, and compare in one table.

    python scripts/compare_nosnoc.py
    python scripts/compare_nosnoc.py --task one_jump --order nosnoc-first --repeat 3 --json comparison.json

Robot, limits, costs, reference, control intervals and finite elements are the same. fesd-robot plans the shipped task
file; nosnoc solves the published step-function form with its published settings, see `nosnoc_hopper.py`. Each run is a
process of its own with one thread. Wall time runs from the description of the problem to the result; starting Python
and importing packages is left out. Needs the extra `bench`.
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
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nosnoc_hopper import Multipliers

TASKS = {
    "five_jumps": Path(__file__).resolve().parent.parent / "tasks" / "hopper_five_jumps.yaml",
    "one_jump": Path(__file__).resolve().parent.parent / "tasks" / "hopper_one_jump.yaml",
}
TOOLS = ("ours", "nosnoc")
TITLES = {"ours": "fesd-robot", "nosnoc": "nosnoc"}
PACKAGES = {"ours": ("fesd-robot", "casadi", "numpy", "pin"), "nosnoc": ("nosnoc", "casadi", "numpy")}
TOUCHING = 2e-3
"""m; a foot closer to the ground than this is on it."""
CLEARANCE = 0.1
"""m; a flight counts if the foot rises higher than this."""


@dataclass(frozen=True)
class Outcome:
    """What one run of one tool gave.

    Attributes:
        verdict: the tool's own word on its result.
        last_nlp: how its last NLP ended.
        wall_seconds, cpu_seconds: from the problem's description to the result.
        iterations: of IPOPT, over all NLPs.
        complementarity: largest product of a relaxed pair, as the tool pairs sums over stages.
        objective: of the tool's own last NLP.
        tracking_cost: costs of tracking, controls and end, integrated in physical time by the same rule for both.
        final_x: of the body, m.
        flights: with more than `CLEARANCE`.
        clock_error: largest |t - kT/N| at the ends of the control intervals, s.
        theta_error: largest |sum of the multipliers - 1| over all stages.
        min_gap: lowest point of the foot over all stages, m.
        constraint_violation: largest violation of a constraint or bound.
        homotopy: every NLP.
        details: what else the tool reports.
    """

    verdict: str
    last_nlp: str
    wall_seconds: float
    cpu_seconds: float
    iterations: int
    complementarity: float
    objective: float
    tracking_cost: float
    final_x: float
    flights: int
    clock_error: float
    theta_error: float
    min_gap: float
    constraint_violation: float
    variables: int
    constraints: int
    homotopy: list[dict[str, Any]] = field(default_factory=list)
    details: dict[str, Any] = field(default_factory=dict)


ROWS: list[tuple[str, Callable[[Outcome], str]]] = [
    ("CPU time [s]", lambda run: f"{run.cpu_seconds:.1f}"),
    ("IPOPT iterations", lambda run: f"{run.iterations}"),
    ("complementarity reached", lambda run: f"{run.complementarity:.1e}"),
    ("largest constraint violation", lambda run: f"{run.constraint_violation:.1e}"),
    ("objective, each tool's own", lambda run: f"{run.objective:.3f}"),
    ("tracking cost in physical time", lambda run: f"{run.tracking_cost:.3f}"),
    ("final x [m]", lambda run: f"{run.final_x:.4f}"),
    (f"flights with more than {CLEARANCE:g} m clearance", lambda run: f"{run.flights}"),
    ("clock error [s]", lambda run: f"{run.clock_error:.1e}"),
    ("max |sum theta - 1|", lambda run: f"{run.theta_error:.1e}"),
    ("min gap [m]", lambda run: f"{run.min_gap:.1e}"),
    ("NLP variables", lambda run: f"{run.variables}"),
    ("NLP constraints", lambda run: f"{run.constraints}"),
    ("the tool's own verdict", lambda run: run.verdict),
    ("last NLP", lambda run: run.last_nlp),
]


def count_flights(gap: Sequence[float]) -> int:
    """Return how many maximal runs of samples off the ground rise above `CLEARANCE`."""
    flights, highest = 0, 0.0
    for value in [*gap, 0.0]:
        if value > TOUCHING:
            highest = max(highest, value)
        else:
            flights += highest > CLEARANCE
            highest = 0.0
    return flights


def run_ours(task: str, tolerance: float) -> Outcome:
    """Plan the task file with fesd-robot."""
    import numpy as np
    from nosnoc_hopper import COURSES, tracking_cost

    from fesd_robot import load_task, plan

    begin, cpu = time.perf_counter(), time.process_time()
    made = plan(load_task(TASKS[task], [f"solver.tolerance={tolerance!r}"]), progress=_show)
    wall, cpu = time.perf_counter() - begin, time.process_time() - cpu
    trajectory, statistic, foot = made.trajectory, made.statistics, made.contacts["foot"]
    states = np.column_stack([*trajectory.configuration.values(), *trajectory.velocity.values()])
    middle = 0.5 * (trajectory.time[:-1] + trajectory.time[1:])
    interval = np.clip(np.searchsorted(made.controls["time"], middle) - 1, 0, None)
    controls = np.column_stack([made.controls["reaction_torque"], made.controls["leg_force"]])
    return Outcome(
        verdict="solved" if made.status.solved else "not solved",
        last_nlp=made.status.nlp,
        wall_seconds=wall,
        cpu_seconds=cpu,
        iterations=statistic.iterations,
        complementarity=made.status.complementarity,
        objective=statistic.objective,
        tracking_cost=tracking_cost(COURSES[task], trajectory.time, states, controls, interval),
        final_x=float(trajectory.configuration["root_x"][-1]),
        flights=count_flights(foot.gap.tolist()),
        clock_error=made.audit.max_clock_error,
        theta_error=made.audit.max_theta_sum_error,
        min_gap=made.audit.min_gap,
        constraint_violation=made.status.constraint_violation,
        variables=statistic.variables,
        constraints=statistic.constraints,
        homotopy=[step.model_dump() for step in statistic.homotopy],
        details={
            "status": made.status.model_dump(),
            "audit": made.audit.model_dump(),
            "cost_terms": statistic.cost_terms,
            "build_seconds": statistic.build_seconds,
            "solve_seconds": statistic.solve_seconds,
        },
    )


def _show(step: Any) -> None:
    print(f"sigma {step.sigma:.1e}: {step.iterations} iterations, {step.seconds:.1f} s, {step.status}", flush=True)


def run_nosnoc(task: str, multipliers: Multipliers) -> Outcome:
    """Solve the published step-function form of the same hopper with nosnoc."""
    import nosnoc_hopper
    import numpy as np

    course = nosnoc_hopper.COURSES[task]
    begin, cpu = time.perf_counter(), time.process_time()
    solver = nosnoc_hopper.prepare(course, multipliers)
    built = time.perf_counter()
    found = nosnoc_hopper.solve(solver)
    end, cpu = time.perf_counter(), time.process_time() - cpu
    states, clock, gap = found.states[:, :8], found.states[:, 8], nosnoc_hopper.gap(found.states)
    ends = course.duration * np.arange(1, course.intervals + 1) / course.intervals
    return Outcome(
        verdict="solved" if found.success else "not solved",
        last_nlp=found.status.replace("_", " ").lower(),
        wall_seconds=end - begin,
        cpu_seconds=cpu,
        iterations=sum(step["iterations"] for step in found.homotopy),
        complementarity=found.complementarity,
        objective=found.objective,
        tracking_cost=nosnoc_hopper.tracking_cost(course, clock, states, found.controls[:, :2], found.interval),
        final_x=float(found.states[-1, 0]),
        flights=count_flights(gap.tolist()),
        clock_error=float(np.abs(found.interval_ends - ends).max()),
        theta_error=float(np.abs(found.weights.sum(axis=1) - 1).max()),
        min_gap=float(gap.min()),
        constraint_violation=found.constraint_violation,
        variables=len(solver.problem.lbw),
        constraints=len(solver.problem.lbg),
        homotopy=found.homotopy,
        details={
            "multipliers": multipliers,
            "stage_complementarity": found.stage_complementarity,
            "final_state": found.states[-1].tolist(),
            "build_seconds": built - begin,
            "solve_seconds": end - built,
        },
    )


def work(arguments: argparse.Namespace) -> None:
    """Do one run in this process and leave its outcome in the file asked for."""
    if arguments.worker == "ours":
        outcome = run_ours(arguments.task, arguments.tolerance)
    else:
        outcome = run_nosnoc(arguments.task, arguments.multipliers)
    arguments.json.write_text(json.dumps(asdict(outcome)), encoding="utf-8")


def run_in_child(tool: str, arguments: argparse.Namespace) -> Outcome:
    """Run one tool in a process of its own, with one thread."""
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder) / "outcome.json"
        options = {
            "--worker": tool,
            "--task": arguments.task,
            "--multipliers": arguments.multipliers,
            "--tolerance": repr(arguments.tolerance),
            "--json": str(answer),
        }
        finished = subprocess.run(
            [sys.executable, str(Path(__file__).resolve()), *(word for pair in options.items() for word in pair)],
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            stdout=sys.stderr if arguments.verbose else subprocess.DEVNULL,
            stderr=None if arguments.verbose else subprocess.PIPE,
            text=True,
            check=False,
        )
        if finished.returncode != 0:
            tail = "\n".join((finished.stderr or "").strip().splitlines()[-15:])
            raise SystemExit(f"The run of {TITLES[tool]} failed (exit status {finished.returncode}).\n{tail}")
        return Outcome(**json.loads(answer.read_text(encoding="utf-8")))


def typical(runs: Sequence[Outcome]) -> Outcome:
    """Return the run with the median wall time, the faster of the middle two."""
    return sorted(runs, key=lambda run: run.wall_seconds)[(len(runs) - 1) // 2]


def table(runs: dict[str, list[Outcome]], arguments: argparse.Namespace) -> str:
    """Return the comparison, one column per tool."""
    medians = {tool: statistics.median(run.wall_seconds for run in found) for tool, found in runs.items()}
    shown = {tool: typical(found) for tool, found in runs.items()}
    fastest = min(medians.values())
    wall = "wall time [s]" if arguments.repeat == 1 else f"wall time [s], median of {arguments.repeat}"
    lines = [
        ["", *(f"{TITLES[tool]} {version(PACKAGES[tool][0])}" for tool in runs)],
        [wall, *(f"{medians[tool]:.1f}" for tool in runs)],
    ]
    if len(runs) > 1:
        lines.append(["time ratio", *(f"{medians[tool] / fastest:.2f}" for tool in runs)])
    lines += [[label, *(show(shown[tool]) for tool in runs)] for label, show in ROWS]
    widths = [max(len(line[column]) for line in lines) for column in range(len(lines[0]))]
    rule = "  ".join("-" * width for width in widths)
    texts = [
        "  ".join([line[0].ljust(widths[0]), *(cell.rjust(w) for cell, w in zip(line[1:], widths[1:], strict=True))])
        for line in lines
    ]
    return "\n".join([texts[0], rule, *texts[1:]])


def version(package: str) -> str:
    """Return the installed version of a package."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def parse(words: Sequence[str] | None) -> argparse.Namespace:
    """Return the command line's options."""
    parser = argparse.ArgumentParser(
        description="Plan the same jumping hopper with fesd-robot and with nosnoc, and compare.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    parser.add_argument("--task", choices=list(TASKS), default="five_jumps", help="which hopper")
    parser.add_argument(
        "--tolerance", type=float, default=1e-8, help="complementarity fesd-robot is asked for; nosnoc keeps its own"
    )
    parser.add_argument(
        "--multipliers",
        choices=["published", "correct"],
        default="published",
        help="how nosnoc's problem weighs its vector fields: as in its authors' example, where the weights do not sum "
        "to 1 in contact, or so that they do",
    )
    parser.add_argument("--order", choices=["ours-first", "nosnoc-first"], default="ours-first", help="who runs first")
    parser.add_argument("--only", choices=TOOLS, help="run one tool alone")
    parser.add_argument("--repeat", type=int, default=1, help="runs of each tool, in turns; the median time is shown")
    parser.add_argument("--json", type=Path, metavar="FILE", help="save all numbers of all runs")
    parser.add_argument("--verbose", action="store_true", help="show what the tools print while they run")
    parser.add_argument("--worker", choices=TOOLS, help=argparse.SUPPRESS)
    arguments = parser.parse_args(words)
    if arguments.repeat < 1:
        parser.error(f"argument --repeat: found {arguments.repeat}, expected 1 or more")
    if not 0 < arguments.tolerance < 1:
        parser.error(f"argument --tolerance: found {arguments.tolerance:g}, expected more than 0 and less than 1")
    if arguments.json and not arguments.json.parent.is_dir():
        parser.error(f"argument --json: there is no folder {arguments.json.parent}")
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
    runs: dict[str, list[Outcome]] = {tool: [] for tool in TOOLS if tool in tools}
    for turn in range(1, arguments.repeat + 1):
        for tool in tools:
            print(f"{TITLES[tool]}, run {turn} of {arguments.repeat} ... ", end="", file=sys.stderr, flush=True)
            runs[tool].append(run_in_child(tool, arguments))
            print(f"{runs[tool][-1].wall_seconds:.1f} s", file=sys.stderr, flush=True)
    notes = {
        "ours": f"fesd-robot to complementarity {arguments.tolerance:g}",
        "nosnoc": f"nosnoc with {arguments.multipliers} multipliers",
    }
    print(f"Hopper, {arguments.task.replace('_', ' ')}: {', '.join(notes[tool] for tool in runs)}\n")
    print(table(runs, arguments))
    if arguments.json:
        record = {
            "task": arguments.task,
            "tolerance": arguments.tolerance,
            "multipliers": arguments.multipliers,
            "order": tools,
            "versions": {"python": platform.python_version()}
            | {package: version(package) for tool in tools for package in PACKAGES[tool]},
            "median_wall_seconds": {
                tool: statistics.median(run.wall_seconds for run in found) for tool, found in runs.items()
            },
            "runs": {tool: [asdict(run) for run in found] for tool, found in runs.items()},
        }
        arguments.json.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
