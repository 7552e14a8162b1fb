"""Plans replanned in MuJoCo while the robot is pushed: how many runs arrive, beside the LQR, and what an update takes.

    for task in hopper_one_jump hopper_five_jumps solo12_jump solo12_jump_in_space solo12_bound biped_walk; do
        fesd-robot plan $task --set reserve.friction=0.1 --set reserve.effort=0.1 --out build/reserve/$task; done
    python scripts/results/closed_loop.py build/reserve      # writes docs/results/closed-loop.md and .json

Every argument is a folder of plans, one folder a task, or a plan's own. ``--only ROW ...`` makes these rows again and
keeps the others, ``--runs N`` makes no more than N runs of each. One process, one core: nothing else should run beside.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fesd_robot import Plan, read_plan
from fesd_robot.contact import ContactMode
from fesd_robot.in_mujoco import (
    Controller,
    Deviation,
    Disturbance,
    Push,
    mujoco_scene,
    run,
    sliding_contacts,
)
from fesd_robot.ocp import MotionProblem, formulate
from fesd_robot.plans import TrackingGains, task_of
from fesd_robot.replanning import Replanner, ReplanningController, Statistics, Update
from fesd_robot.replanning.replanner import EXACT, PERIOD
from fesd_robot.tracking import Tracker, gait_gains, tracking_gains
from scripts.results.gait_loops import STRIDES, for_strides
from scripts.tools.arguments import PROGRAM_IS, machine, program_of

PAGE = Path(__file__).resolve().parents[2] / "docs" / "results" / "closed-loop.md"

LATEST = 0.9
"""Share of the duration of a plan in which robots are pushed."""

LQR, REPLAN = "lqr", "replan"


@dataclass(frozen=True)
class Loop:
    """What runs of a plan have in common.

    Attributes:
        plan: what is followed.
        motion: its task, as MuJoCo's scenes need it.
        gains: of the LQR.
        replanner: of the plan.
    """

    plan: Plan
    motion: MotionProblem
    gains: TrackingGains
    replanner: Replanner

    @classmethod
    def of(cls, plan: Plan, period: float) -> Loop:
        """Return what runs of a plan have in common that is planned again every period, s."""
        motion, replanner = formulate(task_of(plan), driven=False), Replanner(plan, period=period)
        gait = replanner.strides
        gains = gait_gains(plan, motion, gait.image.cost) if gait else tracking_gains(plan, motion=motion)
        return cls(plan, motion, gains, replanner)

    @property
    def duration(self) -> float:
        """Of the plan, s."""
        return float(self.plan.trajectory.time[-1] - self.plan.trajectory.time[0])


When = Callable[[Loop, int, np.random.Generator], float]
"""Takes a loop, the number of a run and random numbers; returns when the robot is pushed, s."""


def any_time(loop: Loop, number: int, random: np.random.Generator) -> float:
    """Return a time within nine tenths of the plan."""
    return float(random.uniform(0.0, LATEST * loop.duration))


def around_take_off(loop: Loop, number: int, random: np.random.Generator) -> float:
    """Return a time before all contacts leave, in even runs, or while none touches, in odd ones."""
    flies = np.all([[mode is ContactMode.FLIGHT for mode in each.mode] for each in loop.plan.contacts.values()], axis=0)
    clock = loop.plan.trajectory.time - loop.plan.trajectory.time[0]
    stands = np.flatnonzero(~flies)[0]
    leaves = stands + int(np.argmax(flies[stands:]))
    lands = leaves + int(np.argmin(flies[leaves:]))
    span = (clock[stands], clock[leaves]) if number % 2 == 0 else (clock[leaves], clock[lands])
    return float(random.uniform(*span))


Drive = Callable[[Loop, "Row", Controller, Disturbance], tuple[bool, float]]
"""Drives a plan with a controller; returns whether it arrived, and the largest error of a body at the end, m."""


def to_its_goal(loop: Loop, row: Row, controller: Controller, disturbance: Disturbance) -> tuple[bool, float]:
    """Drive a plan until its end."""
    scene = mujoco_scene(loop.motion, mass=row.mass, friction=row.friction, sliding=sliding_contacts(loop.plan))
    found = Deviation(scene, loop.plan, run(scene, loop.plan, controller, disturbance=disturbance))
    return found.finished, max(each.end for each in found.bodies.values())


def stride_by_stride(loop: Loop, row: Row, controller: Controller, disturbance: Disturbance) -> tuple[bool, float]:
    """Drive a gait for twenty strides, unless the robot falls."""
    assert loop.replanner.strides is not None
    return for_strides(loop.motion, loop.plan, loop.replanner.strides, controller, disturbance)


def in_ten_strides(loop: Loop, number: int, random: np.random.Generator) -> float:
    """Return a time within the first half of the strides."""
    assert loop.replanner.strides is not None
    return float(random.uniform(0.0, STRIDES / 2 * loop.replanner.strides.duration))


@dataclass(frozen=True)
class Row:
    """Runs of a task with the same disturbances, of which each has a push of its own.

    Attributes:
        task: name of the plan.
        push: m/s; 0: none, and one run.
        count: of runs.
        mass, friction: factors of the scene.
        period: between two updates, s.
        when: the robot is pushed.
        drive: how far a run goes, and when it has arrived.
        words: more about it.
    """

    task: str
    push: float = 0.0
    count: int = 20
    mass: float = 1.0
    friction: float = 1.0
    period: float = PERIOD
    when: When = any_time
    drive: Drive = to_its_goal
    words: str = ""

    @property
    def in_words(self) -> str:
        """What is different from the plan."""
        words = [f"pushed by {self.push:g} m/s{self.words}"] if self.push else []
        words += [f"mass {100 * (self.mass - 1):+.0f} %"] if self.mass != 1 else []
        words += [f"friction {100 * (self.friction - 1):+.0f} %"] if self.friction != 1 else []
        return ", ".join(words) or "nothing"


ROWS = {
    "one-jump": Row("hopper_one_jump"),
    "five-jumps": Row("hopper_five_jumps", 0.3),
    "five-jumps-mass": Row("hopper_five_jumps", 0.3, mass=1.1),
    "five-jumps-friction": Row("hopper_five_jumps", 0.3, friction=0.8),
    "five-jumps-all": Row("hopper_five_jumps", 0.3, mass=1.1, friction=0.8),
    "solo12-plane": Row("solo12_jump", 0.2),
    "solo12-space": Row("solo12_jump_in_space", 0.2, when=around_take_off, words=" before or after take-off"),
    "bound": Row("solo12_bound", 0.2, when=in_ten_strides, drive=stride_by_stride),
    "walk": Row("biped_walk", 0.1, period=0.05, when=in_ten_strides, drive=stride_by_stride),
}
"""Name of a row -> what it is."""


def plan_of(task: str, folders: Sequence[Path]) -> Plan | None:
    """Return the plan of a task in some folders, or in those below them with its name; None if there is none."""
    for folder in (each for one in folders for each in (one, one / task)):
        if (folder / "plan.json").is_file() and (plan := read_plan(folder)).name == task:
            return plan
    return None


def push_of(row: Row, loop: Loop, number: int) -> Push | None:
    """Return the push of a run: in a random direction, with the number of the run as seed."""
    if not row.push:
        return None
    random = np.random.default_rng(number)
    direction = random.standard_normal(3)
    direction[1] *= loop.motion.in_space
    velocity = row.push * direction / np.linalg.norm(direction)
    return Push(round(row.when(loop, number, random), 3), velocity.round(6).tolist())


def measured(name: str, loop: Loop, most: int | None) -> Iterator[dict[str, Any]]:
    """Yield a row as it is kept in the file, after each of its runs."""
    row, begin = ROWS[name], time.perf_counter()
    runs: list[dict[str, Any]] = []
    updates: list[Update] = []
    for number in range(min(row.count if row.push else 1, most or row.count)):
        push = push_of(row, loop, number)
        disturbance = Disturbance(pushes=[push] if push else [])
        replanning = ReplanningController(loop.replanner)
        follows = Tracker(loop.plan, loop.gains, motion=loop.motion)
        controllers: dict[str, Controller] = {LQR: follows, REPLAN: replanning}
        found = {key: row.drive(loop, row, each, disturbance) for key, each in controllers.items()}
        updates += replanning.updates
        runs.append(
            {
                "time": push.time if push else None,
                "velocity": list(push.velocity) if push else None,
                **{key: {"arrived": arrived, "end": end} for key, (arrived, end) in found.items()},
            }
        )
        print(name, number, *(f"{key}: {'arrived' if a else 'no'}, {1e3 * e:.3g} mm" for key, (a, e) in found.items()),
              sep="  ", flush=True)  # fmt: skip
        yield _row(name, loop, runs, updates, time.perf_counter() - begin)


def _row(
    name: str, loop: Loop, runs: Sequence[dict[str, Any]], updates: list[Update], seconds: float
) -> dict[str, Any]:
    """Return a row of some runs as it is kept in the file."""
    row, statistics = ROWS[name], Statistics(updates)
    return {
        "row": name,
        "task": row.task,
        "different": row.in_words,
        "runs": list(runs),
        "period": loop.replanner.period,
        "updates": len(updates),
        "feedback_seconds": statistics.seconds(),
        "prepare_seconds": statistics.seconds("prepare_seconds"),
        "exact_at_once": sum(each.first <= EXACT for each in updates) / len(updates),
        "kept": sum(each.status == "kept" for each in updates) / len(updates),
        "machine": machine(),
        "program": program_of(row.task),
        "seconds": round(seconds, 1),
    }


def page(rows: Sequence[dict[str, Any]]) -> str:
    """Return the page of all rows."""
    machines = list(dict.fromkeys(row["machine"] for row in rows))
    lines = [
        "# Replanning in MuJoCo",
        "",
        "Written by `scripts/results/closed_loop.py`; every run is in [closed-loop.json](closed-loop.json). "
        "A plan is driven "
        "in MuJoCo by its LQR, which follows it, and by [replanning](../replanning.md), with the same push in the "
        "same run. A push changes the velocity of the robot's centre of mass by so much within 10 ms, in a direction "
        "that is drawn with the number of the run as seed, at a time drawn with it, too. Controllers know nothing of "
        "it, nor of masses and friction. Plans leave a tenth of friction and efforts unused: `reserve: {friction: 0.1, "
        "effort: 0.1}`.",
        "",
        "A run arrives if it ends with every body within 5 cm and 0.2 rad of its place in the plan; a gait if the "
        f"robot does not fall within {STRIDES} strides, its end is how far it stays behind. *End*: median of "
        "the largest error of a body at the end, and the largest of all runs. *Feedback* is from the measurement to "
        "the new policy, *prepare* all that is done before; median and 99th percentile of all updates, on one core. "
        "*Exact at once*: updates whose equations hold to 1e-6 after the first step. *Kept*: updates that became the "
        f"policy; the others left the earlier one. {PROGRAM_IS}",
        "",
        *(f"Machine {number}: {words}." for number, words in enumerate(machines, 1)),
        "",
        "| row | task | different from the plan | LQR arrives | replanning arrives | LQR's end, mm | end, mm "
        "| period, ms | feedback, ms | prepare, ms | exact at once | kept | machine | program |",
        "|---" * 14 + "|",
    ]
    for row in rows:
        runs = row["runs"]
        arrived = [f"{sum(one[key]['arrived'] for one in runs)} of {len(runs)}" for key in (LQR, REPLAN)]
        ends = [_ends([one[key]["end"] for one in runs]) for key in (LQR, REPLAN)]
        seconds = [_pair(row[key]) for key in ("feedback_seconds", "prepare_seconds")]
        shares = [f"{100 * row[key]:.1f} %" for key in ("exact_at_once", "kept")]
        cells = [
            row["row"], row["task"], row["different"], *arrived, *ends, f"{1e3 * row['period']:.3g}", *seconds,
            *shares, str(machines.index(row["machine"]) + 1), row["program"],
        ]  # fmt: skip
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _ends(errors: Sequence[float]) -> str:
    return f"{_short(1e3 * float(np.median(errors)))} / {_short(1e3 * max(errors))}"


def _short(value: float) -> str:
    return f"{value:.3g}" if value < 1e3 else f"{value:.0f}"


def _pair(seconds: Sequence[float]) -> str:
    return f"{1e3 * seconds[0]:.2f} / {1e3 * seconds[1]:.2f}"


def main() -> int:
    """Make the rows, and write the page and its numbers."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("plans", nargs="+", type=Path, help="folders of plans")
    parser.add_argument("--only", nargs="+", choices=ROWS, metavar="ROW", help="rows to make again; the others stay")
    parser.add_argument("--runs", type=int, metavar="N", help="no more runs of a row than this")
    parser.add_argument("--page", type=Path, default=PAGE)
    arguments = parser.parse_args()
    numbers = arguments.page.with_suffix(".json")
    kept = json.loads(numbers.read_text(encoding="utf-8")) if arguments.only and numbers.exists() else []
    rows = {row["row"]: row for row in kept}
    loops: dict[tuple[str, float], Loop] = {}
    for name in arguments.only or ROWS:
        task, period = ROWS[name].task, ROWS[name].period
        if (task, period) not in loops:
            plan = plan_of(task, arguments.plans)
            if plan is None:
                parser.error(f"found no plan of {task} in {', '.join(map(str, arguments.plans))}, expected one")
            loops[task, period] = Loop.of(plan, period)
        for row in measured(name, loops[task, period], arguments.runs):
            rows[name] = row
            ordered = [rows[each] for each in ROWS if each in rows]
            numbers.write_text(json.dumps(ordered, indent=1) + "\n", encoding="utf-8")
            arguments.page.write_text(page(ordered), encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
