"""First tasks as `fesd-robot new` writes them, planned as they are.

    python scripts/results/first_tasks.py                    # all
    python scripts/results/first_tasks.py solo12 ur5         # these, as they are and as they go further

Writes docs/results/first_tasks.md. Robots of gymnasium are named `gymnasium:FILE`. Exit code 1 if one is not solved.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

from fesd_robot.first_task import propose_first_task
from fesd_robot.plans import Plan
from fesd_robot.plans.outcome_words import contact_words
from fesd_robot.plans.tables import markdown_table
from fesd_robot.sweeps.planned import planned
from scripts.tools.arguments import ROOT
from scripts.tools.table import PROGRAM_IS, Row, Table, settings_of, solved

TASKS = ROOT / "runs" / "tables" / "tasks_of_first_tasks"

ROBOTS = (
    *(f"models/{name}/{name}.urdf" for name in ("hopper", "monoped", "block", "wheel")),
    "gymnasium:hopper.xml",
    "ur5",
    "bolt",
    "solo12",
)
FAR = ", 0.5 m"
_TWO_HOPS = ("reference.count=2", "horizon.intervals=30")
FURTHER = {
    f"gymnasium:half_cheetah.xml{FAR}": (),
    f"gymnasium:hopper.xml{FAR}": (*_TWO_HOPS, "horizon.duration=2"),
    f"gymnasium:walker2d.xml{FAR}": (*_TWO_HOPS, "horizon.duration=1.8"),
}
"""MuJoCo's robots -> what a user changes in their first tasks for 0.5 m, in two hops for robots with one leg."""

HEADER = ("robot", "task", "solved", "what its contacts do", "seconds", "message", "program")


def file_of(case: str) -> Path:
    """Return where the first task of a robot is written."""
    return TASKS / (case.removesuffix(FAR).replace("/", "-").replace(":", "-") + ".yaml")


def written(cases: Sequence[str]) -> None:
    """Write first tasks."""
    TASKS.mkdir(parents=True, exist_ok=True)
    for case in cases:
        robot = source = case.removesuffix(FAR)
        if robot.startswith("gymnasium:"):
            import gymnasium

            source = str(Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets" / robot.partition(":")[2])
        elif (ROOT / robot).is_file():
            source = str(ROOT / robot)
        file_of(case).write_text(propose_first_task(source, TASKS)[1], encoding="utf-8")


def measure(result: Plan) -> dict[str, str]:
    """Return the name of the task, and what its contacts do."""
    contacts = result.outcome.contacts.items() if result.outcome else ()
    return {"name": result.name, "contacts": "; ".join(f"{one}: {contact_words(each)}" for one, each in contacts)}


def line(row: Row) -> list[str]:
    """Return the line of a robot."""
    words = [row["name"] or "", "yes" if solved(row) else "no", row["contacts"] or ""]
    return [row["case"], *words, f"{row['seconds']:.0f}", row["message"].partition(";")[0], TABLE.program(row)]


def page_of(rows: list[Row]) -> str:
    """Return the page."""
    near, far = [row for row in rows if row["case"] in ROBOTS], [row for row in rows if row["case"] in FURTHER]
    return "\n".join(
        [
            "# First tasks",
            "",
            TABLE.made_by(rows),
            "",
            "Each task is what `fesd-robot new ROBOT` writes, with nothing changed. Robots are those of this "
            f"repository, of gymnasium, and of example-robot-data. {PROGRAM_IS}",
            "",
            f"**{sum(map(solved, near))} of {len(near)} solved.**",
            "",
            markdown_table(HEADER, [line(row) for row in near]),
            "",
            "## Half a metre",
            "The same files with `goal.configuration.rootx` 0.5, and, for the robots with one leg, two hops in twice "
            "the time on 30 intervals.",
            "",
            f"**{sum(map(solved, far))} of {len(far)} solved.**",
            "",
            markdown_table(HEADER, [line(row) for row in far]),
        ]
    )


def cases() -> dict[str, dict[str, object]]:
    """Return name of a case -> its task, and what is changed in it."""
    found: dict[str, dict[str, object]] = {robot: {"task": str(file_of(robot))} for robot in ROBOTS}
    for case, changes in FURTHER.items():
        found[case] = {"task": str(file_of(case)), **settings_of(("goal.configuration.rootx=0.5", *changes))}
    return found


TABLE = Table(
    ROOT / "docs" / "results" / "first_tasks.md",
    {"cases": cases()},
    page_of,
    partial(planned, measure=measure),
    {"name": str, "contacts": str},
    by="case",
    written=written,
)

if __name__ == "__main__":
    sys.exit(0 if all(map(solved, TABLE.main(__doc__ or ""))) else 1)
