"""The rows of IMPACT's runs, and their table on the page of public tasks."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from fesd_robot.plans.tables import markdown_table
from scripts.tools.arguments import ROOT
from scripts.tools.table import Row, solved

FILE = ROOT / "docs" / "results" / "public_tasks_impact.json"

HEADER = (
    "case",
    "by",
    "solved",
    "goal missed by",
    "objective",
    "violation",
    "product",
    "solve, s",
    "whole, s",
    "iterations",
)

TOOLS = {
    "impact": "IMPACT",
    "mpcc": "MPCC solver",
    "mpcc_from_impact": "MPCC solver, from IMPACT's end",
}

TEXT = """## Beside IMPACT

[IMPACT](https://github.com/JonasPflaume/IMPACT) at {commit} ran here at the settings of its own programs and with its
release flags, CasADi 3.7 and OpenBLAS, by `python scripts/benchmarks/compare_impact.py IMPACT/build/experiments`,
whose first lines say how it is built; {machine}, with other work (load {load}). Its problems are posed here anew,
with its steps of explicit Euler, all of its pairs, its weights and its first guess. *Objective*, *violation* (of
start, dynamics, rows and signs), *product* and *goal missed by* (norm, in m, m/s and rad) are recomputed for all
alike; the objective that IMPACT prints agrees in its four digits. All numbers are in
[public_tasks_impact.json](public_tasks_impact.json).

- **IMPACT**: solved by its own word, to 1e-5, and within 0.01 of the goal, which is its test of the cart. *Solve* is
  the time that it prints, without making the functions of the problem, *whole* that of its command; medians of three.
- **MPCC solver**: `solve_by_attempts(problem, further=4)` of `fesd_robot.mpcc` on the same problem from the same
  guess; solved exactly, and as near to the goal. *Solve* is that call, with derivatives and certificate, *whole* a
  process that imports the program, too; medians of three.
- **MPCC solver, from IMPACT's end**: the same from IMPACT's solution, once.
- **plan, then MPCC solver**: the same from the plan of the table above, which is of a task with its own cost and of
  bodies with mass. *Whole* and *iterations* are those of the plan, with search and audit, without the solver's; its
  violation includes products.

IMPACT is the fastest by far. Of `impact_disk` the MPCC solver alone returns a disk that stays where it is: as long as
the point does not touch it no direction descends, and that is what its certificate says. It goes round from a plan.

"""

ARRIVED = 0.01
"""Norm of the last state's distance from the goal, m, m/s and rad; IMPACT tests its cart by it."""

Runs = dict[str, Any]
"""Of a case: tool -> its numbers, and the machine."""


def known() -> dict[str, Runs]:
    """Return case -> its runs."""
    found: dict[str, Runs] = json.loads(FILE.read_text(encoding="utf-8")) if FILE.is_file() else {}
    return found


def put(case: str, runs: Runs) -> None:
    """Put the runs of a case in the place of those of the data file."""
    lines = [f"{json.dumps(name)}: {json.dumps(each)}" for name, each in sorted({**known(), case: runs}.items())]
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


def beside_impact(rows: list[Row]) -> str:
    """Return the part of the page that has IMPACT's runs, beside the plans of the same cases; empty without runs.

    Args:
        rows: of the plans.
    """
    runs = known().values()
    if not runs:
        return ""
    commits, machines = ({each[key] for each in runs} for key in ("commit", "machine"))
    loads = [each["load"] for each in runs]
    return TEXT.format(
        commit=" and ".join(sorted(commit[:8] for commit in commits)),
        machine=" and ".join(sorted(machines)),
        load=f"{min(loads):.1f} to {max(loads):.1f}",
    ) + _table(rows)


def arrived(numbers: Mapping[str, Any]) -> bool:
    """Return whether a problem is solved, and its goal reached."""
    return bool(numbers["solved"] and numbers["missed"] < ARRIVED)


def _table(rows: list[Row]) -> str:
    """Return the table of all runs."""
    plans = {row["case"]: row for row in rows if solved(row)}
    lines = []
    for case, runs in known().items():
        lines += [_line(case, of, runs[tool]) for tool, of in TOOLS.items()]
        if plan := plans.get(case):
            own = [f"{plan['peer']:.5g}", f"{plan['violation']:.0e}", "–", "–", f"{plan['seconds']:.1f}"]
            lines.append([case, "plan, then MPCC solver", "yes", "–", *own, str(plan["iterations"])])
    return markdown_table(HEADER, lines)


def _line(case: str, of: str, numbers: Mapping[str, Any]) -> list[str]:
    own = [f"{numbers['objective']:.5g}", f"{numbers['violation']:.0e}", f"{numbers['product']:.0e}"]
    times = [f"{numbers['solve_seconds']:.2f}", f"{numbers['seconds']:.2f}" if "seconds" in numbers else "–"]
    missed = f"{numbers['missed']:.1e}"
    return [case, of, "yes" if arrived(numbers) else "no", missed, *own, *times, str(numbers["iterations"])]
