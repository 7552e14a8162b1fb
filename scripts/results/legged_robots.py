"""Robots of example-robot-data with legs: each stands by `stand_on` and jumps 0.2 m, at default settings.

    python scripts/results/legged_robots.py                      # all
    python scripts/results/legged_robots.py go2 bolt --jobs 2    # these only

Tasks and plans go to runs/tables/. A task has some ten lines. What is locked and coupled is what `fesd-robot robots
MODEL --sagittal` proposes, the posture is that of the robot's SRDF file; a user adds the feet, how far the legs are
bent where there is no such file, and that it should be a jump. Exit code 1 if fewer than 8 of 10 are solved.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Collection, Mapping, Sequence
from functools import partial
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple

os.environ.setdefault("OMP_NUM_THREADS", "1")

from fesd_robot import load_task
from fesd_robot.ocp import formulate
from fesd_robot.plans import Plan
from fesd_robot.plans.outcome import ContactOutcome
from fesd_robot.plans.tables import markdown_table
from fesd_robot.sweeps.planned import planned
from scripts.tools.arguments import ROOT
from scripts.tools.table import PROGRAM_IS, Row, Table, solved

TASKS = ROOT / "runs" / "tables" / "tasks_of_legged_robots"
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

HEADER = ("robot", "solved", "settings tried", "flights", "longest [m]", "in the air [s]", "iterations", "seconds",
          "cost", "message", "program")  # fmt: skip


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

    TASKS.mkdir(parents=True, exist_ok=True)
    file = TASKS / f"{name}_stands.yaml"
    file.write_text(text(""), encoding="utf-8")
    height = formulate(load_task(file)).task.initial.configuration["root_z"]
    return text(f"reference: {{type: jumps, count: 1, apex: {{root_z: {height + 0.1:.2f}}}}}\n")


def written(names: Sequence[str]) -> None:
    """Write the task files of robots."""
    for name in names:
        text = task_text(name)
        (TASKS / f"{name}_jump.yaml").write_text(text, encoding="utf-8")


def measure(result: Plan) -> dict[str, float]:
    """Return the longest flight of a contact, m, and how long no contact touches, s."""
    contacts = result.outcome.contacts.values() if result.outcome else ()
    longest = max((flight.length for contact in contacts for flight in contact.flights), default=0.0)
    return {"longest": longest, "in_the_air": in_the_air(contacts)}


def in_the_air(contacts: Collection[ContactOutcome]) -> float:
    """Return how long no contact touches, s."""
    ends = sorted({at for one in contacts for flight in one.flights for at in (flight.start, flight.end)})
    return sum(
        end - start
        for start, end in pairwise(ends)
        if all(any(flight.start <= start and end <= flight.end for flight in one.flights) for one in contacts)
    )


def line(row: Row) -> list[str]:
    """Return the line of a robot."""
    last = [row["message"].partition(". ")[0], TABLE.program(row)]
    if row["cost"] is None:
        return [row["case"], "no", *[""] * 5, f"{row['seconds']:.0f}", "", *last]
    numbers = [row["attempts"], row["flights"], f"{row['longest']:.3g}", f"{row['in_the_air']:.2f}", row["iterations"]]
    costs = [f"{row['seconds']:.0f}", f"{row['cost']:.5g}"]
    return [row["case"], "yes" if solved(row) else "no", *map(str, numbers), *costs, *last]


def page_of(rows: list[Row]) -> str:
    """Return the page."""
    return "\n".join(
        [
            "# Jumps of robots with legs",
            "",
            TABLE.made_by(rows),
            "",
            "Each robot of example-robot-data stands by `stand_on`, is to be 0.2 m further on after 0.6 s, at rest in "
            "the same posture, and may not slip. Everything else is a default; what is locked and coupled is what "
            "`fesd-robot robots MODEL --sagittal` proposes. One task is",
            "",
            f"```yaml\n{task_text('go2')}```",
            "",
            f"**{sum(map(solved, rows))} of {len(rows)} solved.** {PROGRAM_IS}",
            "",
            markdown_table(HEADER, [line(row) for row in rows]),
            "",
            "*Flights* are of all contacts together, *longest* is the longest of them, *in the air* is how long "
            "nothing touches.",
        ]
    )


TABLE = Table(
    ROOT / "docs" / "results" / "legged_robots.md",
    {"cases": {name: {"task": str(TASKS / f"{name}_jump.yaml")} for name in ROBOTS}},
    page_of,
    partial(planned, measure=measure),
    {"longest": float, "in_the_air": float},
    by="case",
    written=written,
)

if __name__ == "__main__":
    done = TABLE.main(__doc__ or "", keep="all")
    sys.exit(0 if sum(map(solved, done)) >= NEEDED * len(done) else 1)
