"""Optimal control with switches: one problem on many grids, solved in several ways, and others beside their optima.

    python scripts/benchmarks/optimal_control.py               # writes docs/results/optimal_control.md; some minutes

The car of `docs/optimal-control.md` is solved on twelve control grids with two, three and four elements, with another
linear solver, and from a start that is moved by 1e-12. Beside it stands the range of what single homotopies end in.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from fesd_robot.fesd import FesdOptions, OptimalControlProblem
from fesd_robot.optimal_control import EndTime, OptimalControlSettings, OptimalControlSolution, optimize
from scripts.benchmarks.compare import cart_pole, motor, sliding_mode
from scripts.benchmarks.compare.switched import SwitchedProblem, optimal_control_problem
from tests.fesd.test_sliding_optimum import OPTIMUM
from tests.optimal_control.problems import LEAST_TIME, car

ROOT = Path(__file__).resolve().parents[2]
REPORT = ROOT / "docs" / "results" / "optimal_control.md"
GRIDS = (5, 7, 10, 12, 15, 17, 20, 23, 25, 30, 35, 40)
RACE = EndTime(shortest=1, longest=100)
WAYS: dict[str, Callable[[OptimalControlProblem], OptimalControlSolution]] = {
    "2 elements": lambda problem: optimize(problem, FesdOptions(elements=2), end_time=RACE),
    "3 elements": lambda problem: optimize(problem, end_time=RACE),
    "4 elements": lambda problem: optimize(problem, FesdOptions(elements=4), end_time=RACE),
    "MUMPS": lambda problem: optimize(problem, settings=OptimalControlSettings(linear_solver="mumps"), end_time=RACE),
    "moved": lambda problem: optimize(problem, end_time=RACE),
}


def race(intervals: int) -> str:
    """Return the row of a grid."""
    times, certified, homotopies, seconds = [], 0, [], 0.0
    for way, solved in WAYS.items():
        moved = 1e-12 if way == "moved" else 0.0
        solution = solved(car(intervals, control_guess=np.full((1, intervals), moved)))
        times.append(solution.end_time)
        certified += bool(solution.certificate and solution.certificate.b_stationary == "certified")
        homotopies += [start.cost for start in solution.starts if start.solved]
        seconds = solution.seconds if way == "3 elements" else seconds
    return (
        f"| {intervals} | {min(times):.6f} | {max(times) - min(times):.0e} | {certified} of {len(WAYS)} "
        f"| {min(homotopies):.3f} to {max(homotopies):.3f} | {seconds:.1f} |"
    )


def other(problem: SwitchedProblem, known: str) -> str:
    """Return the row of a problem that stands in the comparison with nosnoc, too."""
    solution = optimize(optimal_control_problem(problem), FesdOptions(elements=problem.elements))
    costs = [start.cost for start in solution.starts if start.solved]
    return (
        f"| {problem.name.replace('_', ' ')} | {solution.cost:.9g} | {known} | {min(costs):.6g} to {max(costs):.6g} "
        f"| {'yes' if solution.exact else 'no'} | {solution.certificate.b_stationary if solution.certificate else '-'} "
        f"| {solution.seconds:.1f} |"
    )


def main() -> None:
    """Solve and write the tables."""
    rows = []
    for intervals in GRIDS:
        rows.append(race(intervals))
        print(rows[-1], flush=True)
    others = [
        other(sliding_mode.describe(), f"{OPTIMUM:.9g}, closed form"),
        other(cart_pole.describe(), "-"),
        other(motor.describe(), "-"),
    ]
    print("\n".join(others))
    text = "\n".join(
        [
            "# Optimal control with switches",
            "",
            "Written by `scripts/benchmarks/optimal_control.py`.",
            "",
            "The car of [the page](../optimal-control.md), least time in s, on grids of several numbers of control",
            "intervals: with two, three and four elements, with MUMPS in place of the own linear solver, and from",
            f"controls moved by 1e-12. With controls that change at any time it would take {LEAST_TIME} s.",
            "",
            "| intervals | least time | apart | certified | single homotopies end at | seconds |",
            "|---|---|---|---|---|---|",
            *rows,
            "",
            "Three problems of the [comparison with nosnoc](compare_nosnoc.md) at default settings:",
            "",
            "| problem | cost | known | single homotopies | exact | B-stationary | seconds |",
            "|---|---|---|---|---|---|---|",
            *others,
            "",
            "The motor's homotopies end at 0.8397 if the two elements of an interval may be of any length: one of them",
            "then has none, and the cost gains from the errors of the other. With four elements it is 0.85535.",
            "",
        ]
    )
    REPORT.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
