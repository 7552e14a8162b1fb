"""Variations of all shipped tasks: how many are solved, in which attempt, and at which cost.

    python scripts/results/robustness.py                          # all (variations.py): hours
    python scripts/results/robustness.py hopper_one_jump          # of these tasks only
    python scripts/results/robustness.py --time-limit 120 --set solver.effort=quick

Every variation is planned in a process of its own with default settings. The table goes to docs/results/robustness.md;
rows of tasks that are not planned stay as they are. *Best known* is the lowest cost that any run of this script has
found; where a variation is the task itself from another initial guess, or with wider limits, the lowest of all those
guesses counts, too. Exit code 1 if fewer than 95 of 100 are solved at the first attempt.
"""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from fesd_robot.plans import Plan
from fesd_robot.plans.tables import markdown_table
from fesd_robot.sweeps.planned import planned
from scripts.results.variations import Variation, variations
from scripts.tools.arguments import ROOT
from scripts.tools.table import PROGRAM_IS, Row, Table, cases_of, settings_of, solved

NEEDED = 0.95
EVERY = {f"{one.name} {one.seed}: {one.what}": one for one in variations()}
"""Name of a case -> variation."""

SUMMARY = ("task", "variations", "solved at the first attempt", "solved", "median seconds", "program")
HEADER = ("variation", "solved", "attempts", "flights", "slides [m]", "iterations", "seconds", "cost",
          "above best known", "stationarity", "first attempt, if not solved")  # fmt: skip


def measure(result: Plan) -> dict[str, Any]:
    """Return how stationary a motion is, and what came of the first attempt where it was not solved."""
    first = result.statistics.attempts[0]
    return {
        "stationarity": f"{result.status.stationarity}, {result.status.b_stationary}",
        "first_message": "" if first.solved else first.message.removeprefix("Not solved: "),
    }


def at_first(row: Row) -> bool:
    """Return whether the first setting led to a motion."""
    return solved(row) and row["attempts"] == 1


@dataclass(frozen=True)
class BestTable(Table):
    """A table whose rows keep the lowest cost that is known for them."""

    def put(self, rows: Sequence[Row]) -> None:
        """Put rows in the place of those of the data file; the lower of both costs stays known."""
        best = {row["case"]: row["best"] for row in self.known() if row["best"] is not None}
        for row in (row for row in rows if solved(row)):
            best[row["case"]] = min(best.get(row["case"], np.inf), row["cost"])
        super().put([{**row, "best": best.get(row["case"])} for row in rows])


def lowest(rows: list[Row]) -> dict[str, float]:
    """Return the lowest costs known, where a variation allows the motions of its task not above those of any guess."""
    best = {row["case"]: row["best"] for row in rows if row["best"] is not None}
    guesses: dict[str, float] = {}
    for case, cost in best.items():
        if EVERY[case].other_guess:
            guesses[EVERY[case].name] = min(cost, guesses.get(EVERY[case].name, np.inf))

    def allowed(one: Variation) -> float:
        return guesses.get(one.name, np.inf) if one.other_guess or one.wider else np.inf

    return {case: min(cost, allowed(EVERY[case])) for case, cost in best.items()}


def line(row: Row, best: float | None) -> list[str]:
    """Return the line of a variation."""
    first = (row["first_message"] or ("" if solved(row) else row["message"])).partition(". ")[0]
    if row["cost"] is None:
        return [row["case"], "no", "", "", "", "", f"{row['seconds']:.0f}", "", "", "", first]
    numbers = (row["attempts"], row["flights"], f"{row['slides']:.3g}", row["iterations"], f"{row['seconds']:.0f}")
    cost = [f"{row['cost']:.5g}", f"{row['cost'] / best - 1:.1%}" if best else ""] if solved(row) else ["", ""]
    return [row["case"], "yes" if solved(row) else "no", *map(str, numbers), *cost, row["stationarity"], first]


def of_task(name: str, own: list[Row]) -> list[str]:
    """Return the line of a task."""
    seconds = f"{np.median([row['seconds'] for row in own]):.0f}"
    counts = map(str, (len(own), sum(map(at_first, own)), sum(map(solved, own))))
    return [name, *counts, seconds, ", ".join(dict.fromkeys(map(TABLE.program, own)))]


def page_of(rows: list[Row]) -> str:
    """Return the page."""
    count, best, tasks = len(rows), lowest(rows), cases_of(rows)
    left = Counter(one.name for one in EVERY.values()) - Counter(row["task"] for row in rows)
    without = ", ".join(f"{number} of {name}" if name in tasks else name for name, number in left.items())
    first, by_call = sum(map(at_first, rows)), sum(map(solved, rows))
    above = [row["cost"] / best[row["case"]] - 1 for row in rows if solved(row)]
    seconds = [row["seconds"] for row in rows]
    return "\n".join(
        [
            "# Variations of the shipped tasks",
            "",
            f"{TABLE.made_by(rows)} {count} of {len(EVERY)} variations." + (f" No rows yet: {without}." * bool(left)),
            "",
            "Robot, ground, goal, weights (times 0.1 to 10), limits, grid and initial guess are varied one at a time, "
            "with committed seeds (`scripts/results/variations.py`). No setting was made for any of them. *Best known* "
            "is the lowest cost of any run of the script so far; of all initial guesses where only that or a wider "
            "limit is varied. An attempt is one setting. " + PROGRAM_IS,
            "",
            f"**{first} of {count} solved at the first attempt ({first / count:.0%}), {by_call} by the call "
            f"({by_call / count:.0%})**; median {np.median(seconds):.0f} s, 9 of 10 within "
            f"{np.quantile(seconds, 0.9):.0f} s. Costs above the best known: median {np.median(above):.1%}, "
            f"{sum(one > 0.02 for one in above)} of {len(above)} by more than 2 %.",
            "",
            markdown_table(SUMMARY, [of_task(name, own) for name, own in tasks.items()]),
            "",
            markdown_table(HEADER, [line(row, best.get(row["case"])) for row in rows]),
        ]
    )


TABLE = BestTable(
    ROOT / "docs" / "results" / "robustness.md",
    {"cases": {name: {"task": one.name, **settings_of(one.overrides)} for name, one in EVERY.items()}},
    page_of,
    partial(planned, measure=measure),
    {"stationarity": str, "first_message": str, "best": float},
)

if __name__ == "__main__":
    done = TABLE.main(__doc__ or "")
    print(f"{sum(map(at_first, done))} of {len(done)} at the first attempt, {sum(map(solved, done))} by the call")
    sys.exit(0 if sum(map(at_first, done)) >= NEEDED * len(done) else 1)
