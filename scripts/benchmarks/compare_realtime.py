"""Replan one task from measured states with fesd-robot, IMPACT and nosnoc, and compare what that takes.

    python scripts/benchmarks/compare_realtime.py --plans runs/cart_transport
    python scripts/benchmarks/compare_realtime.py --plans FOLDER --impact BUILD/cart_transporter_impact_multiple
    python scripts/benchmarks/compare_realtime.py --plans FOLDER --page docs/results/compare_realtime.md

The task is cart transport of IMPACT's benchmark, in `compare/cart_transport/`. All tools get the same disturbed starts,
and one law in closed form judges the controls that they answer with. One process, one thread; run it on a core of its
own (`taskset -c 1`). nosnoc takes part if it is installed (extra `bench`), IMPACT if its program for this task is
given, which its README says how to build (https://github.com/JonasPflaume/IMPACT).
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy is imported

import argparse
import importlib.util
import json
import platform
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from fesd_robot import load_task, plan, read_plan, write_plan
from fesd_robot.plans import Plan
from scripts.benchmarks.bench_step_nosnoc import machine
from scripts.benchmarks.compare.cart_transport.answers import WARM, Answer, AnswerTo, Impact, Nosnoc, Ours
from scripts.benchmarks.compare.cart_transport.law import starts
from scripts.benchmarks.compare.cart_transport.loop import EVERY, PERIOD, Run, run
from scripts.benchmarks.compare.cart_transport.page import loop_table, page, start_table, way_text
from scripts.benchmarks.compare_nosnoc import version
from scripts.tools.arguments import check_counts

TASK = Path(__file__).parent / "compare" / "cart_transport" / "cart_transport.yaml"
GRIDS = {30: "balanced", 300: "quick"}
"""Control intervals -> effort of the search for the first plan."""

REPEATS = 3
"""Of everything that is timed; the shortest time counts, for other processes may take the core in between."""

ROUNDED = 1e-9
"""By more, repeats of one run may not differ: m, m/s, or as a part of the cost."""

FEWER = 10
"""By this factor, rides with the finer grid."""


def planned(folder: Path, intervals: int) -> Plan:
    """Return the undisturbed plan, planned if the folder has none."""
    place = folder / f"intervals_{intervals}"
    if not place.exists():
        print(f"planning {place} ...", file=sys.stderr, flush=True)
        task = load_task(TASK, [f"horizon.intervals={intervals}", f"solver.effort={GRIDS[intervals]}"])
        write_plan(plan(task), place)
    found = read_plan(place)
    count = len(found.controls["time"])
    if count != intervals or not found.status.solved:
        raise SystemExit(f"{place}: found a plan of {count} control intervals, expected a solved one of {intervals}")
    return found


def asked(title: str, answer: AnswerTo, states: Sequence[np.ndarray]) -> dict[str, Any]:
    """Return what a tool answered to all states, with the shortest times of some repeats."""
    print(f"{title}: {len(states)} states ...", file=sys.stderr, flush=True)
    answers = [_shortest([answer(state) for _ in range(REPEATS)]) for state in states]
    return {"tool": title, "answers": [asdict(one) for one in answers]}


def _shortest(answers: Sequence[Answer]) -> Answer:
    costs = [one.cost for one in answers]
    if len({one.solved for one in answers}) > 1 or max(costs) - min(costs) > ROUNDED * max(costs):
        raise SystemExit("A tool answers one state in two ways, so its shortest time says nothing.")
    return replace(answers[0], seconds=min(one.seconds for one in answers), before=min(one.before for one in answers))


def driven(title: str, ours: Ours, count: int, impact: Impact | None) -> dict[str, Any]:
    """Return what rides in closed loop took, each update at its shortest if they repeat, and IMPACT's answers."""
    print(f"{title}: {count} rides ...", file=sys.stderr, flush=True)
    run(ours.replanner, count)  # warm
    wall, cpu = time.perf_counter(), time.process_time()
    repeats: list[list[Run]] = [[run(ours.replanner, seed) for seed in range(count)] for _ in range(REPEATS)]
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    rides = repeats[0]
    pairs = [pair for other in repeats[1:] for pair in zip(rides, other, strict=True)]
    repeatable = all(_same(one, again) for one, again in pairs)
    if not repeatable:  # then every ride counts for itself
        rides = [ride for one in repeats for ride in one]
    updates = [update for ride in rides for update in ride.updates]
    again = [[update for ride in one for update in ride.updates] for one in repeats] if repeatable else [updates]
    on_the_way: dict[str, Any] = {"answers": []}
    if impact:
        states = [state for ride in rides for state in ride.states[::EVERY] if impact.can_begin_in(state)]
        on_the_way = asked("IMPACT on the way", impact, states)
    return {
        "tool": title,
        "core_share": cpu / wall,
        "repeatable": repeatable,
        "farthest": [float(ride.ride.farthest) for ride in rides],
        "errors": [ride.ride.errors for ride in rides],
        "costs": [float(ride.ride.cost) for ride in rides],
        "arrived": sum(ride.ride.arrived for ride in rides),
        "feedback": [min(one.feedback_seconds for one in same) for same in zip(*again, strict=True)],
        "prepare": [min(one.prepare_seconds for one in same) for same in zip(*again, strict=True)],
        "iterations": [update.iterations for update in updates],
        "kept": sum(update.status == "kept" for update in updates),
        "violation": [update.violation for update in updates],
        "impact": on_the_way["answers"],
    }


def _same(one: Run, other: Run) -> bool:
    """Return whether two rides are one but for rounding."""
    iterations = [[update.iterations for update in each.updates] for each in (one, other)]
    return iterations[0] == iterations[1] and bool(np.abs(one.states - other.states).max() <= ROUNDED)


def measure(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return all numbers."""
    plans = {intervals: planned(arguments.plans, intervals) for intervals in GRIDS}
    states = starts(arguments.starts)
    impact = Impact(arguments.impact) if arguments.impact else None
    found: dict[str, Any] = {"starts": [], "loops": [], "plans": {}}
    for intervals, undisturbed in plans.items():
        title = f"fesd-robot, {intervals} intervals"
        ours = Ours(undisturbed, PERIOD)
        statistics = undisturbed.statistics
        found["plans"][intervals] = {
            "variables": statistics.variables,
            "seconds": statistics.solve_seconds,
            "replanner": ours.made,
        }
        found["starts"].append(asked(title, ours, states))
        coarse = intervals == min(GRIDS)
        rides = arguments.rides if coarse else max(1, arguments.rides // FEWER)
        found["loops"].append(driven(title, ours, rides, impact if coarse else None))
    if impact:
        found["starts"].append(asked("IMPACT, anew", impact, states))
    if importlib.util.find_spec("nosnoc"):
        found["starts"].append(asked("nosnoc, anew", Nosnoc(), states))
        found["starts"].append(asked("nosnoc, from its solution", Nosnoc(WARM), states))
    return found


def _short(value: Any) -> Any:
    """Return nested values with five digits of every number."""
    if isinstance(value, dict):
        return {str(key): _short(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_short(each) for each in value]
    return float(f"{value:.5g}") if isinstance(value, float) else value


def parse(words: Sequence[str] | None) -> argparse.Namespace:
    """Return the command line's options."""
    parser = argparse.ArgumentParser(
        description="Replan one task from measured states with fesd-robot, IMPACT and nosnoc, and compare.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    parser.add_argument("--plans", type=Path, required=True, metavar="FOLDER", help="of plans, made where missing")
    parser.add_argument("--impact", type=Path, metavar="PROGRAM", help="IMPACT's cart_transporter_impact_multiple")
    parser.add_argument("--starts", type=int, default=50, help="disturbed starts")
    parser.add_argument("--rides", type=int, default=20, help="in closed loop")
    parser.add_argument("--page", type=Path, metavar="FILE", help="write a page, and all numbers beside it")
    arguments = parser.parse_args(words)
    check_counts(parser, arguments, "starts", "rides")
    if arguments.impact and not arguments.impact.is_file():
        parser.error(f"argument --impact: there is no program {arguments.impact}")
    if arguments.page and not arguments.page.parent.is_dir():
        parser.error(f"argument --page: there is no folder {arguments.page.parent}")
    return arguments


def main(words: Sequence[str] | None = None) -> None:
    """Run the comparison."""
    arguments = parse(words)
    begin, before = time.perf_counter(), os.getloadavg()[0]
    found = measure(arguments)
    record: dict[str, Any] = {
        "machine": machine(),
        "versions": {"Python": platform.python_version()}
        | {name: version(name) for name in ("fesd-robot", "casadi", "numpy", "pin", "nosnoc")},
        "load": [before, os.getloadavg()[0]],
        "repeats": REPEATS,
        "found": found,
    }
    print(start_table(record["found"]), loop_table(record["found"]), way_text(record["found"]), sep="\n\n")
    print(f"{time.perf_counter() - begin:.0f} s", file=sys.stderr)
    if arguments.page:
        file = arguments.page.with_suffix(".json")
        file.write_text(json.dumps(_short(record), separators=(",", ":")) + "\n", encoding="utf-8")
        command = (
            f"python scripts/benchmarks/compare_realtime.py --plans FOLDER --impact PROGRAM --page {arguments.page}"
        )
        arguments.page.write_text(page(record, command), encoding="utf-8")


if __name__ == "__main__":
    main()
