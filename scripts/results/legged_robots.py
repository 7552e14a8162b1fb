"""Robots of example-robot-data with legs: each stands by `stand_on` and jumps 0.2 m, at default settings.

    python scripts/results/legged_robots.py                          # all
    python scripts/results/legged_robots.py go2 bolt --keep FOLDER   # these; tasks and plans are kept

A task has some ten lines. What is locked and coupled is what `fesd-robot robots MODEL --sagittal` proposes, the posture
is that of the robot's SRDF file; a user adds the feet, how far the legs are bent where there is no such file, and that
it should be a jump. Exit code 1 if fewer than 8 of 10 are solved.
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Collection, Mapping
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

os.environ.setdefault("OMP_NUM_THREADS", "1")


from fesd_robot import load_task, plan
from fesd_robot.actions import render_plan
from fesd_robot.ocp import formulate
from fesd_robot.plans.files import write_plan
from fesd_robot.plans.outcome import ContactOutcome
from fesd_robot.plans.tables import markdown_table

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "results" / "legged_robots.md"
NEEDED = 0.8


class Legged(NamedTuple):
    """What a user knows about a robot.

    Attributes:
        feet: name of a contact -> frame.
        posture: of the model.
        bent: joint -> value, rad.
    """

    feet: dict[str, str]
    posture: str = "standing"
    bent: Mapping[str, float] = MappingProxyType({})


def _feet(front: str, hind: str) -> dict[str, str]:
    return {"front": front, "hind": hind}


_UNITREE = _feet("FL_foot", "RL_foot")
_BENT = {"FL_thigh_joint": 0.7, "FL_calf_joint": -1.4, "RL_thigh_joint": 0.7, "RL_calf_joint": -1.4}

ROBOTS = {
    "a1": Legged(_UNITREE),
    "anymal_b": Legged(_feet("LF_FOOT", "LH_FOOT")),
    "anymal_c": Legged(_feet("LF_FOOT", "LH_FOOT")),
    "b1": Legged(_UNITREE),
    "bolt": Legged({"foot": "FL_FOOT"}),
    "go1": Legged(_UNITREE),
    "go2": Legged(_UNITREE),
    "hyq": Legged(_feet("lf_foot", "lh_foot"), posture="straight_standing"),
    "laikago": Legged(_UNITREE, posture="", bent=_BENT),
    "solo": Legged(_feet("FL_FOOT", "HL_FOOT")),
    "solo12": Legged(_feet("FL_FOOT", "HL_FOOT"), posture="straight_standing"),
}
"""Name of a robot -> what a user knows about it."""

HEADER = (
    "robot",
    "solved",
    "settings tried",
    "flights",
    "longest [m]",
    "in the air [s]",
    "iterations",
    "seconds",
    "cost",
    "message",
)


def task_text(name: str) -> str:
    """Return a task file; the apex of the reference is 0.1 m above where the robot stands."""
    known, model = ROBOTS[name], f"example-robot-data:{name}"
    command = [sys.executable, "-m", "fesd_robot", "robots", model, "--sagittal"]
    robot = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    feet = ", ".join(f"{contact}: {{frame: {frame}, slipping: forbidden}}" for contact, frame in known.feet.items())
    names = ", ".join(known.feet)
    bent = ", ".join(f"{joint}: {by}" for joint, by in known.bent.items())
    posture = f"posture: {known.posture}, " if known.posture else ""
    start = f"configuration: {{{bent}}}, " if bent else ""
    forward = f"configuration: {{root_x: 0.2{', ' + bent if bent else ''}}}, "

    def text(reference: str) -> str:
        return (
            f"name: {name}_jump\n{robot}"
            f"contacts: {{{feet}}}\n"
            "horizon: {duration: 0.6, intervals: 15}\n"
            f"{reference}"
            f"initial: {{{posture}{start}stand_on: [{names}]}}\n"
            f"goal: {{{posture}{forward}stand_on: [{names}]}}\n"
        )

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "stands.yaml"
        file.write_text(text(""), encoding="utf-8")
        height = formulate(load_task(file)).task.initial.configuration["root_z"]
    return text(f"reference: {{type: jumps, count: 1, apex: {{root_z: {height + 0.1:.2f}}}}}\n")


def jumped(name: str, limit: float, overrides: list[str], keep: Path | None) -> list[str]:
    """Plan the jump of a robot; return its line of the table."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / f"{name}_jump.yaml"
        file.write_text(task_text(name), encoding="utf-8")
        task = load_task(file, [f"solver.time_limit={limit}", *overrides])
        begin = time.perf_counter()
        result = plan(task)
        seconds = time.perf_counter() - begin
        if keep:
            write_plan(result, folder / name)
            render_plan(result, folder / name, task_folder=folder)
    assert result.outcome is not None
    contacts, statistics = result.outcome.contacts.values(), result.statistics
    return [
        name,
        "yes" if result.status.solved else "no",
        str(statistics.settings_tried),
        str(sum(len(contact.flights) for contact in contacts)),
        f"{max((flight.length for contact in contacts for flight in contact.flights), default=0.0):.3g}",
        f"{in_the_air(contacts):.2f}",
        str(sum(one.iterations for one in statistics.attempts)),
        f"{seconds:.0f}",
        f"{statistics.objective:.5g}",
        result.status.message.partition(". ")[0],
    ]


def in_the_air(contacts: Collection[ContactOutcome]) -> float:
    """Return how long no contact touches, s."""
    ends = sorted({at for one in contacts for flight in one.flights for at in (flight.start, flight.end)})
    return sum(
        end - start
        for start, end in pairwise(ends)
        if all(any(flight.start <= start and end <= flight.end for flight in one.flights) for one in contacts)
    )


def main() -> int:
    """Plan the jumps of the command line's robots, or of all, and write the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("robots", nargs="*", default=list(ROBOTS), help="default: all")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--time-limit", type=float, default=600.0, help="of a plan, s")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--keep", type=Path)
    arguments = parser.parse_args()
    if unknown := sorted(set(arguments.robots) - set(ROBOTS)):
        parser.error(f"found '{unknown[0]}', expected one of {', '.join(ROBOTS)}")
    one = partial(jumped, limit=arguments.time_limit, overrides=arguments.set, keep=arguments.keep)
    rows = []
    with ProcessPoolExecutor(arguments.processes) as pool:
        for row in pool.map(one, arguments.robots):
            rows.append(row)
            print(" | ".join(row), flush=True)
    solved = [row[1] for row in rows].count("yes")
    PAGE.write_text(page(rows, solved, " ".join(sys.argv[1:])), encoding="utf-8")
    return 0 if solved >= NEEDED * len(rows) else 1


def page(rows: list[list[str]], solved: int, arguments: str) -> str:
    """Return the page.

    Args:
        rows: of the table.
        solved: how many of them are.
        arguments: of the command line.
    """
    command = f"python scripts/results/legged_robots.py {arguments}".strip()
    lines = [
        "# Jumps of robots with legs",
        "",
        f"Made by `{command}`, Python {platform.python_version()}, casadi {version('casadi')}.",
        "",
        "Each robot of example-robot-data stands by `stand_on`, is to be 0.2 m further on after 0.6 s, at rest in the "
        "same posture, and may not slip. Everything else is a default; what is locked and coupled is what `fesd-robot "
        "robots MODEL --sagittal` proposes. One task is",
        "",
        f"```yaml\n{task_text('go2')}```",
        "",
        f"**{solved} of {len(rows)} solved.**",
        "",
        markdown_table(HEADER, rows),
        "",
        "*Flights* are of all contacts together, *longest* is the longest of them, *in the air* is how long nothing "
        "touches.",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
