"""First tasks as `fesd-robot new` writes them, planned as they are.

    python scripts/results/first_tasks.py                    # the robots below
    python scripts/results/first_tasks.py solo12 FILE.urdf   # these

Writes docs/results/first_tasks.md, when all robots are planned. Robots of gymnasium are named `gymnasium:FILE`. Exit
code 1 if one is not solved.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import tempfile
import time
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")


from fesd_robot import load_task, plan
from fesd_robot.first_task import propose_first_task
from fesd_robot.plans.outcome_words import contact_words
from fesd_robot.plans.tables import markdown_table

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "results" / "first_tasks.md"

ROBOTS = (
    *(f"models/{name}/{name}.urdf" for name in ("hopper", "monoped", "block", "wheel")),
    "gymnasium:hopper.xml",
    "ur5",
    "bolt",
    "solo12",
)
_TWO_HOPS = ("reference.count=2", "horizon.intervals=30")
FURTHER = {
    "gymnasium:half_cheetah.xml": (),
    "gymnasium:hopper.xml": (*_TWO_HOPS, "horizon.duration=2"),
    "gymnasium:walker2d.xml": (*_TWO_HOPS, "horizon.duration=1.8"),
}
"""MuJoCo's robots -> what a user changes in their first tasks for 0.5 m, in two hops for robots with one leg."""

HEADER = ("robot", "task", "solved", "what its contacts do", "seconds", "message")


def planned(robot: str, changes: Sequence[str] = ()) -> list[str]:
    """Return the row of a robot.

    Args:
        changes: of the task that is written.
    """
    source = robot
    if robot.startswith("gymnasium:"):
        import gymnasium

        source = str(Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets" / robot.partition(":")[2])
    elif (ROOT / robot).is_file():
        source = str(ROOT / robot)
    with tempfile.TemporaryDirectory() as folder:
        name, text = propose_first_task(source, Path(folder))
        file = Path(folder) / "task.yaml"
        file.write_text(text, encoding="utf-8")
        task = load_task(file, changes)
        begin = time.perf_counter()
        result = plan(task)
        seconds = time.perf_counter() - begin
    assert result.outcome is not None
    contacts = "; ".join(f"{one}: {contact_words(contact)}" for one, contact in result.outcome.contacts.items())
    solved = "yes" if result.status.solved else "no"
    return [robot, name, solved, contacts, f"{seconds:.0f}", result.status.message.partition(";")[0]]


def page(rows: list[list[str]], further: list[list[str]]) -> str:
    """Return the page.

    Args:
        rows: of first tasks as they are.
        further: of those that go 0.5 m.
    """
    solved, far = (sum(row[2] == "yes" for row in own) for own in (rows, further))
    lines = [
        "# First tasks",
        "",
        f"Made by `python scripts/results/first_tasks.py`, Python {platform.python_version()}, casadi "
        f"{version('casadi')}, "
        "beside other work on two cores.",
        "",
        "Each task is what `fesd-robot new ROBOT` writes, with nothing changed. Robots are those of this "
        "repository, of gymnasium, and of example-robot-data.",
        "",
        f"**{solved} of {len(rows)} solved.**",
        "",
        markdown_table(HEADER, rows),
        "",
        "## Half a metre",
        "The same files with `goal.configuration.rootx` 0.5, and, for the robots with one leg, two hops in twice the "
        "time on 30 intervals.",
        "",
        f"**{far} of {len(further)} solved.**",
        "",
        markdown_table(HEADER, further),
    ]
    return "\n".join(lines)


def main() -> int:
    """Plan the first tasks of the command line's robots, or of all, and write the page of all."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("robots", nargs="*", help="default: those of the page")
    arguments = parser.parse_args()
    rows = []
    for robot in arguments.robots or ROBOTS:
        rows.append(planned(robot))
        print(" | ".join(rows[-1]), flush=True)
    if not arguments.robots:
        further = [planned(robot, ("goal.configuration.rootx=0.5", *changes)) for robot, changes in FURTHER.items()]
        PAGE.write_text(page(rows, further), encoding="utf-8")
        rows += further
    return 0 if all(row[2] == "yes" for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
