"""How late plans end that have a time limit: random limits, with and without what earlier plans have compiled.

    python scripts/results/time_limits.py               # 30 runs of ten tasks, about six minutes
    python scripts/results/time_limits.py --runs 5 --seed 1

Every run is a process of its own, whose seconds are those from its start to its end, without page and figures. With a
cold cache everything is compiled anew, the linear solver, too; a warm one is that of the user. Rows go to
docs/results/time-limits.json, and as a table to docs/results/time-limits.md. Exit code 1 if a run is later than a tenth
of its limit or 2 s, whichever is more.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from fesd_robot.plans.tables import markdown_table
from scripts.tools.arguments import PROGRAM_IS, ROOT, planned_by_command, program_of

PAGE = ROOT / "docs" / "results" / "time-limits.md"
TASKS = (
    "hopper_one_jump",
    "hopper_wedge",
    "block_push",
    "double_pendulum_wall",
    "biped_step",
    "biped_walk",
    "solo12_jump",
    "solo12_jump_in_space",
    "go2_jump",
    "ball_bat",
)
SHORTEST, LONGEST = 1.0, 20.0
"""s, of the limits."""

SPARE_SECONDS, SPARE_SHARE = 2.0, 0.1
"""s, and part of the limit: a run may be later by the larger of both."""

ENDS = {0: "solved", 3: "not solved", 2: "refused"}
"""Exit code -> how the command ended."""

HEADER = ("task", "cache", "limit [s]", "seconds", "late [s]", "allowed [s]", "kept", "end", "program")


@dataclass(frozen=True)
class Row:
    """One run.

    Attributes:
        task, cache: its name; cold or warm.
        limit, seconds: s.
        end: how the command ended.
        program: which program it was.
    """

    task: str
    cache: str
    limit: float
    seconds: float
    end: str
    program: str

    @property
    def late(self) -> float:
        """s, negative for a run that ended before its limit."""
        return self.seconds - self.limit

    @property
    def allowed(self) -> float:
        """s."""
        return max(SPARE_SECONDS, SPARE_SHARE * self.limit)

    @property
    def kept(self) -> bool:
        """Whether it is late by no more than that."""
        return self.late <= self.allowed

    @property
    def cells(self) -> list[str]:
        """The entries of its row."""
        numbers = [f"{value:.1f}" for value in (self.limit, self.seconds, max(self.late, 0.0), self.allowed)]
        return [self.task, self.cache, *numbers, "yes" if self.kept else "no", self.end, self.program]


def timed(task: str, cache: str, limit: float) -> Row:
    """Plan a task with a limit, s, in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        own = {"FESD_ROBOT_CACHE": f"{folder}/cache"} if cache == "cold" else {}
        overrides = [f"solver.time_limit={limit}", "output.page=false", "output.figures=false"]
        seconds, done = planned_by_command(task, Path(folder) / "run", overrides, own)
    return Row(task, cache, limit, seconds, ENDS.get(done.returncode, f"exit {done.returncode}"), program_of(task))


def page(rows: list[Row], seed: int) -> str:
    """Return the page of the rows."""
    late = np.array([max(row.late, 0.0) for row in rows])
    kept = sum(row.kept for row in rows)
    return (
        "# Time limits\n\n"
        f"Made by `python scripts/results/time_limits.py --runs {len(rows)} --seed {seed}`, processes: "
        f"{os.cpu_count()}. "
        "Seconds are those of the whole command, without page and figures. With a cold cache everything is compiled "
        f"anew, the linear solver, too. {PROGRAM_IS}\n\n"
        f"**{kept} of {len(rows)} are late by at most a tenth of their limit or 2 s**; median {np.median(late):.1f} s, "
        f"most {late.max():.1f} s.\n\n" + markdown_table(HEADER, [row.cells for row in rows])
    )


def main() -> int:
    """Run, write the page, and say what it says in a line."""
    assert __doc__
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--page", type=Path, default=PAGE)
    arguments = parser.parse_args()
    random = np.random.default_rng(arguments.seed)
    rows: list[Row] = []
    for number in range(arguments.runs):
        limit = round(float(random.uniform(SHORTEST, LONGEST)), 1)
        row = timed(TASKS[number % len(TASKS)], "cold" if random.random() < 0.5 else "warm", limit)
        print(" ".join(row.cells), flush=True)
        rows.append(row)
    rows.sort(key=lambda row: (row.task, row.cache, row.limit))
    arguments.page.with_suffix(".json").write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n")
    arguments.page.write_text(page(rows, arguments.seed), encoding="utf-8")
    return int(not all(row.kept for row in rows))


if __name__ == "__main__":
    sys.exit(main())
