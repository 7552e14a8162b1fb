"""Variations of all shipped tasks: how many are solved, in which attempt, and at which cost.

    python scripts/results/robustness.py                          # all (scripts/results/variations.py): hours
    python scripts/results/robustness.py hopper_one_jump          # of these tasks only
    python scripts/results/robustness.py --time-limit 120 --set solver.effort=quick

Every variation is planned in a process of its own with default settings. The table goes to docs/results/robustness.md;
rows of tasks that are not planned stay as they are (docs/results/robustness.json). *Best known* is the lowest cost that
any run of this script has found; where a variation is the task itself from another initial guess, or with wider limits,
the lowest of all those guesses counts, too. Exit code 1 if fewer than 95 of 100 are solved at the first attempt.
"""

from __future__ import annotations

import json
import os
import platform
import sys
import time
from collections import Counter
from dataclasses import asdict, dataclass, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from fesd_robot import plan
from fesd_robot.plans.tables import markdown_table
from fesd_robot.sweeps.workers import Outcome, in_processes
from scripts.results.variations import Variation, variations
from scripts.tools.arguments import PROGRAM_IS, ROOT, program_of, task_parser

PAGE = ROOT / "docs" / "results" / "robustness.md"
NEEDED = 0.95

SUMMARY = ("task", "variations", "solved at the first attempt", "solved", "median seconds", "program")

HEADER = ("task", "seed", "variation", "solved", "attempts", "flights", "slides [m]", "iterations", "seconds", "cost",
          "above best known", "stationarity", "first attempt, if not solved")  # fmt: skip


@dataclass(frozen=True)
class Row:
    """One variation as it was planned; its cells are words."""

    task: str
    seed: int
    variation: str
    solved: bool
    attempts: int
    flights: int
    slides: float
    iterations: int
    seconds: float
    cost: float
    stationarity: str
    first_message: str
    made: str
    program: str

    @property
    def solved_at_first(self) -> bool:
        """Whether the first setting led to a motion."""
        return self.solved and self.attempts == 1

    @property
    def key(self) -> str:
        """What it is called among the best known."""
        return f"{self.task} {self.seed}: {self.variation}"

    def cells(self, best: float | None) -> list[str]:
        """Return its line of the table."""
        above = f"{self.cost / best - 1:.1%}" if self.solved and best else ""
        words = (self.attempts, self.flights, f"{self.slides:.3g}", self.iterations, f"{self.seconds:.0f}")
        numbers = [*map(str, words), f"{self.cost:.5g}" if self.solved else "", above]
        known = [self.task, str(self.seed), self.variation, "yes" if self.solved else "no"]
        return [*known, *numbers, self.stationarity, self.first_message.partition(". ")[0]]


def planned(overrides: list[str], made: str, variation: Variation) -> Row:
    """Plan one variation; `made` says how."""
    begin = time.perf_counter()
    result = plan(variation.task(*overrides))
    assert result.outcome is not None
    contacts, attempts = result.outcome.contacts.values(), result.statistics.attempts
    first = attempts[0]
    return Row(
        task=variation.name,
        seed=variation.seed,
        variation=variation.what,
        solved=result.status.solved,
        attempts=result.statistics.settings_tried,
        flights=sum(len(contact.flights) for contact in contacts),
        slides=sum(contact.slide_distance for contact in contacts),
        iterations=sum(one.iterations for one in attempts),
        seconds=time.perf_counter() - begin,
        cost=result.statistics.objective,
        stationarity=f"{result.status.stationarity}, {result.status.b_stationary}",
        first_message="" if first.solved else first.message.removeprefix("Not solved: "),
        made=made,
        program=program_of(variation.name),
    )


def lost(variation: Variation, outcome: Outcome, made: str) -> Row:
    """Return the row of a variation whose process did not return."""
    empty = Row(variation.name, variation.seed, variation.what, False, 1, 0, 0.0, 0, 0.0, 0.0, "", "", made, "")
    program = program_of(variation.name)
    return replace(empty, seconds=outcome.seconds, first_message=outcome.message, program=program)


def with_rows(file: Path, new: list[Row]) -> tuple[list[Row], dict[str, float]]:
    """Return all rows of a file in the order of the variations, new ones in their place, and the lowest costs known.

    Both are kept in the file: rows of variations that are not planned stay, those of variations that are no more go.
    """
    known = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {"rows": [], "best": {}}
    rows = {row.key: row for row in [*(Row(**one) for one in known["rows"]), *new]}
    every = {f"{one.name} {one.seed}: {one.what}": one for one in variations()}
    ordered, best = [rows[key] for key in every if key in rows], dict(known["best"])
    for row in ordered:
        if row.solved:
            best[row.key] = min(best.get(row.key, np.inf), row.cost)
    best = with_guesses(best, every)
    content = {"rows": [asdict(row) for row in ordered], "best": dict(sorted(best.items()))}
    file.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return ordered, best


def with_guesses(best: dict[str, float], every: dict[str, Variation]) -> dict[str, float]:
    """Return the lowest costs known, where a variation allows the motions of its task not above those of any guess."""
    lowest: dict[str, float] = {}
    for key, cost in best.items():
        if key in every and every[key].other_guess:
            lowest[every[key].name] = min(cost, lowest.get(every[key].name, np.inf))
    allowed = {key: one.name for key, one in every.items() if one.other_guess or one.wider}
    return {key: min(cost, lowest.get(allowed.get(key, ""), np.inf)) for key, cost in best.items()}


def page(rows: list[Row], best: dict[str, float]) -> str:
    """Return the page."""
    count, every = len(rows), variations()
    with_row = Counter(row.task for row in rows)
    left = Counter(one.name for one in every) - with_row
    without = [f"{number} of {name}" if with_row[name] else name for name, number in left.items()]
    solved = [row for row in rows if row.solved]
    first = [row for row in rows if row.solved_at_first]
    above = [row.cost / best[row.key] - 1 for row in solved]
    seconds = [row.seconds for row in rows]
    made = "; ".join(dict.fromkeys(row.made for row in rows))
    return "\n".join(
        [
            "# Variations of the shipped tasks",
            "",
            f"Made by {made}; Python {platform.python_version()}, casadi {version('casadi')}. {count} of "
            f"{len(every)} variations." + (f" No rows yet: {', '.join(without)}." if without else ""),
            "",
            "Robot, ground, goal, weights (times 0.1 to 10), limits, grid and initial guess are varied one at a time, "
            "with committed seeds (`scripts/results/variations.py`). No setting was made for any of them. "
            "*Best known* is the "
            "lowest cost of any run of the script so far; of all initial guesses where only that or a wider limit is "
            "varied. An attempt is one setting. " + PROGRAM_IS,
            "",
            f"**{len(first)} of {count} solved at the first attempt ({len(first) / count:.0%}), {len(solved)} by the "
            f"call ({len(solved) / count:.0%})**; median {np.median(seconds):.0f} s, 9 of 10 within "
            f"{np.quantile(seconds, 0.9):.0f} s. Costs above the best known: median {np.median(above):.1%}, "
            f"{sum(one > 0.02 for one in above)} of {len(above)} by more than 2 %.",
            "",
            markdown_table(SUMMARY, [of_task(name, rows) for name in dict.fromkeys(row.task for row in rows)]),
            "",
            markdown_table(HEADER, [row.cells(best.get(row.key)) for row in rows]),
        ]
    )


def of_task(name: str, rows: list[Row]) -> list[str]:
    """Return the line of a task."""
    own = [row for row in rows if row.task == name]
    first, solved = sum(row.solved_at_first for row in own), sum(row.solved for row in own)
    seconds = f"{np.median([row.seconds for row in own]):.0f}"
    return [name, str(len(own)), str(first), str(solved), seconds, ", ".join(dict.fromkeys(row.program for row in own))]


def main() -> int:
    """Plan the variations and write the page."""
    parser = task_parser(__doc__, PAGE)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="a setting for all of them")
    parser.add_argument("--time-limit", type=float, help="seconds for each")
    arguments = parser.parse_args()
    overrides = [*arguments.set, *([f"solver.time_limit={arguments.time_limit}"] if arguments.time_limit else [])]
    every = variations()
    if unknown := sorted(set(arguments.tasks) - {variation.name for variation in every}):
        sys.exit(f"found '{unknown[0]}', expected one of {', '.join(sorted({one.name for one in every}))}")
    chosen = [variation for variation in every if variation.name in arguments.tasks]
    command = " ".join(["python scripts/results/robustness.py TASK ...", *(f"--set {one}" for one in overrides)])
    made = f"`{command}`, processes: {arguments.processes}"
    file, rows = arguments.page.with_suffix(".json"), list[Row]()
    for variation, outcome in in_processes(partial(planned, overrides, made), chosen, arguments.processes):
        row: Row = outcome.value if outcome.verdict is None else lost(variation, outcome, made)
        rows.append(row)
        print(" ".join(row.cells(None)), flush=True)
        arguments.page.write_text(page(*with_rows(file, rows)), encoding="utf-8")  # the script may be ended
    first = sum(row.solved_at_first for row in rows)
    print(f"{first} of {len(rows)} at the first attempt, {sum(row.solved for row in rows)} by the call")
    return 0 if first >= NEEDED * len(rows) else 1


if __name__ == "__main__":
    sys.exit(main())
