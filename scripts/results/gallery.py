"""Plan every task in tasks/, and write a table, one picture a task and the list of tasks.

    scripts/gallery                                  # all tasks, one after the other
    scripts/gallery --jobs 2 --time-limit 300        # two at a time, at most 300 s each
    scripts/gallery hopper_one_jump block_push       # these anew, the others from their last plans in runs/
    scripts/gallery --short                          # only tasks that the table does not mark as long
    scripts/gallery --redraw                         # nothing anew

Each task is planned by `fesd-robot plan` in a process of its own, into runs/. The table goes to
docs/results/gallery.md, the pictures to docs/images/gallery/: the pages as Chromium shows them, or figures where there
is no Chromium. Exit code 1 if a task that was planned is not solved.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from PIL import Image

from fesd_robot.contact import ContactMode
from fesd_robot.errors import FesdRobotError
from fesd_robot.ocp import formulate
from fesd_robot.planning.fallbacks import with_overrides
from fesd_robot.plans import Plan, read_plan
from fesd_robot.plans.outcome import Outcome
from fesd_robot.plans.outcome_words import flight_words, miss_words
from fesd_robot.plans.plan import ContactHistory
from fesd_robot.task import Task, load_task
from scripts.results.claims import CLAIMS
from scripts.tools.arguments import PROGRAM_IS, ROOT, Rows, planned_by_command, program_of
from tests.render.browser import Browser, installed

PAGE = ROOT / "docs" / "results" / "gallery.md"
PICTURES = ROOT / "docs" / "images" / "gallery"
TASK_LIST = ROOT / "docs" / "tasks.md"
MARKS = ("<!-- tasks: written by scripts/gallery -->", "<!-- end of tasks -->")

LONG_SECONDS = 30.0
"""Seconds above which a task is marked as long."""

SIZE, SHOT_SCALE = (320, 200), 3

COLUMNS = ("task", "purpose", "degrees of freedom", "contacts", "variables", "pairs", "iterations", "seconds",
           "position missed by", "velocity missed by", "flights", "longest slide", "does what it says",
           "replay differs by", "refined to", "cost", "complementarity", "stationarity", "program",
           "status")  # fmt: skip
NOT_PLANNED = "not planned"
WITHOUT_CAPTION = (
    "<style>aside, #time, #bar { display: none !important; } "
    "body { grid-template: 'scene' minmax(0, 1fr) / minmax(0, 1fr) !important; }</style></head>"
)


@dataclass(frozen=True)
class Entry:
    """A task of the gallery: its file, its purpose (the second line of the file), where its plan is."""

    file: Path
    purpose: str
    folder: Path

    @property
    def name(self) -> str:
        return self.file.stem

    def plan(self) -> Plan | None:
        """Return the last plan of the task as it is now; None if there is none."""
        try:
            last = read_plan(self.folder)
        except FesdRobotError:
            return None
        kept = last.statistics.kept_attempt
        task = load_task(self.file)
        if kept:
            task = with_overrides(
                task, {key: value for key, value in kept.changes.items() if key != "solver.time_limit"}
            )
        now = formulate(task).task.model_dump(mode="json")
        then = Task.model_validate(last.task).model_dump(mode="json")  # with keys that are newer than the plan
        for key in ("time_limit", "processes"):  # what the gallery itself sets, and what changes no plan
            then["solver"][key] = now["solver"][key]
        return last if now == then else None


def entries(runs: Path) -> list[Entry]:
    """Return all tasks in tasks/ by name."""
    return [
        Entry(file, file.read_text(encoding="utf-8").splitlines()[1].removeprefix("# "), runs / file.stem)
        for file in sorted((ROOT / "tasks").glob("*.yaml"))
    ]


def plan_anew(entry: Entry, seconds: float, jobs: int) -> int:
    """Plan a task in a process of its own, say how it went, and return the exit code of `fesd-robot plan`.

    Args:
        entry: the task.
        seconds: time limit.
        jobs: how many tasks are planned at a time; they share the cores.
    """
    processes = max(1, (os.cpu_count() or 1) // jobs)
    limits = [f"solver.time_limit={seconds:g}", f"solver.processes={processes}"]
    _, done = planned_by_command(entry.file, entry.folder, limits)
    print(f"{entry.name}: {'solved' if done.returncode == 0 else done.stderr.strip()}", flush=True)
    return done.returncode


def seconds_of(plan: Plan) -> float:
    """Return how long all attempts took together, building included."""
    return sum(one.seconds for one in plan.statistics.attempts)


def row(entry: Entry) -> list[str]:
    """Return the cells of one task."""
    start, plan = [entry.name, entry.purpose], entry.plan()
    if plan is None:
        return [*start, *[""] * (len(COLUMNS) - 3), NOT_PLANNED]
    status, effort, attempts = plan.status, plan.statistics, plan.statistics.attempts
    seconds = seconds_of(plan)
    many = f" with settings {effort.settings_tried}" if effort.settings_tried > 1 else ""
    kind = status.stationarity + {"certified": ", B", "refuted": ", not B"}.get(status.b_stationary, "")
    numbers = [len(plan.trajectory.velocity), len(plan.contacts), effort.variables, effort.pairs]
    return [
        *start,
        *map(str, [*numbers, sum(one.iterations for one in attempts)]),
        f"{seconds:.1f}" + (" long" if seconds > LONG_SECONDS else ""),
        *outcome_cells(plan.outcome),
        "; ".join(CLAIMS[entry.name].broken(plan)) or "yes",
        replay_words(plan),
        refinement_words(plan),
        f"{effort.objective:.5g}",
        f"{status.complementarity:.1e}",
        kind,
        program_of(entry.name, plan.provenance.git),
        f"solved{many}" if status.solved else f"not solved: {status.message.split('; try')[0]}",
    ]


def keep(entry: Entry, rows: Rows) -> None:
    """Put the row of a task among those of all; one that has no plan keeps the row that it had."""
    cells = row(entry)
    if cells[-1] != NOT_PLANNED or entry.name not in rows.by_name:
        rows.put(cells)


def replay_words(plan: Plan) -> str:
    """Return the largest error of the replay in each unit."""
    if plan.replay is None:
        return ""
    largest: dict[str, float] = {}
    for errors, per_second in ((plan.replay.position, False), (plan.replay.velocity, True)):
        for name, error in errors.items():
            unit = plan.units.velocity[name]
            unit = unit if per_second else unit.removesuffix("/s")
            largest[unit] = max(largest.get(unit, 0.0), error.largest)
    return ", ".join(f"{value:.0e} {unit}" for unit, value in largest.items())


def refinement_words(plan: Plan) -> str:
    """Return stages, elements, largest local error and time of the refinement."""
    refinement = plan.statistics.refinement
    if refinement is None:
        return ""
    return (
        f"{plan.statistics.stages} stages, {refinement.elements} elements, {refinement.largest_local_error:.0e}, "
        f"{refinement.seconds:.1f} s"
    )


def outcome_cells(outcome: Outcome | None) -> list[str]:
    """Return by how much position and velocity miss the goal, the flights, and the longest slide of all contacts."""
    if outcome is None:
        return [""] * 4
    contacts = list(outcome.contacts.values())
    slides = [slide.distance for contact in contacts for slide in contact.slides]
    misses = [miss_words(outcome, "position"), miss_words(outcome, "velocity")]
    return [*misses, flight_words(contacts), f"{max(slides):.3g} m" if slides else "none"]


def page(rows: Rows, command: str) -> str:
    """Return the table as a page.

    Args:
        rows: of all tasks, by their names.
        command: with which it is made.
    """
    lines = [[f"[{cells[0]}](../../tasks/{cells[0]}.yaml)", *cells[1:]] for cells in rows.cells]
    solved = sum(cells[-1].startswith("solved") for cells in lines)
    return "\n".join(
        [
            "# All tasks",
            "",
            f"Made by `{command}`, Python {platform.python_version()}, casadi {version('casadi')}. {PROGRAM_IS}",
            "",
            f"**{solved} of {len(lines)} solved**: complementarity within `solver.tolerance` and the physics audit "
            "passed. Variables and pairs are those of the attempt that was kept; iterations and wall seconds, "
            "building and certificate included, of all attempts of one run, some with other work beside it. The goal "
            "is missed by the largest difference of each unit; flights and the longest slide are those of all "
            "contacts. What a task says in its first line is held against its plan by "
            "`scripts/results/claims.py`. Tasks that "
            f"take more than {LONG_SECONDS:g} s are marked as long; `scripts/gallery --short` leaves them out. The "
            "replay drives every control interval again from the plan's state with an event-driven integrator; the "
            "largest difference at the end of an interval is given for each unit. Refinement ends with a largest local "
            "error; its seconds are part of the seconds.",
            "",
            f"| {' | '.join(COLUMNS)} |",
            f"| --- | --- |{' --: |' * (len(COLUMNS) - 5)} --- | --- | --- |",
            *(f"| {' | '.join(cells)} |" for cells in lines),
            "",
        ]
    )


def marked_long(rows: Rows) -> set[str]:
    """Return the names of the tasks that take long."""
    at = COLUMNS.index("seconds")
    return {name for name, cells in rows.by_name.items() if cells[at].endswith(" long")}


def task_list(all_entries: Sequence[Entry], columns: int = 3) -> str:
    """Return the tasks as a table of cells: picture, name, purpose."""
    cells = []
    for entry in all_entries:
        picture = PICTURES / f"{entry.name}.png"
        shown = f"![{entry.name}]({picture.relative_to(TASK_LIST.parent).as_posix()})<br>" if picture.is_file() else ""
        cells.append(f"{shown}[`{entry.name}`](../tasks/{entry.file.name}): {entry.purpose}")
    cells += [""] * (-len(cells) % columns)
    rows = [cells[first : first + columns] for first in range(0, len(cells), columns)]
    return "\n".join([f"|{' |' * columns}", f"|{' --- |' * columns}", *(f"| {' | '.join(cells)} |" for cells in rows)])


def with_list(text: str, table: str) -> str:
    """Return the page of tasks with the table between its marks."""
    before, after = text.split(MARKS[0])
    return f"{before}{MARKS[0]}\n{table}\n{MARKS[1]}{after.split(MARKS[1])[1]}"


def telling_time(plan: Plan) -> float:
    """Return when to take the picture: high in a jump, where nothing touches, else at a first touch, else half way."""
    time = plan.trajectory.time
    flying = np.all(
        [[mode is ContactMode.FLIGHT for mode in contact.mode] for contact in plan.contacts.values()], axis=0
    )
    jumps = [high for contact in plan.contacts.values() for high in apexes(contact) if flying[high[1]]]
    if jumps:
        return float(time[max(jumps)[1]])
    touches = [switch.time for switch in plan.switches if switch.kind == "touchdown"]
    return min(touches) if touches else float(time[-1]) / 2


def apexes(contact: ContactHistory) -> list[tuple[float, int]]:
    """Return largest gap, m, and its sample for every flight that begins and ends with a touch and is a jump."""
    flying = np.array([mode is ContactMode.FLIGHT for mode in contact.mode]).astype(int)
    first, end = np.flatnonzero(np.diff(flying) == 1) + 1, np.flatnonzero(np.diff(flying) == -1) + 1
    flights = [(a, int(b)) for a in first.tolist() for b in end[end > a][:1]]
    highest = [(float(np.max(contact.gap[a:b])), a + int(np.argmax(contact.gap[a:b]))) for a, b in flights]
    return [one for one in highest if one[0] > 0.05]


def draw(entry: Entry) -> None:
    """Write the picture of a task from its plan, if there is one."""
    plan = entry.plan()
    if plan is None:
        return
    with tempfile.TemporaryDirectory() as folder:
        if installed():
            bare = Path(folder) / "plan.html"
            html = (entry.folder / "plan.html").read_text(encoding="utf-8")
            bare.write_text(html.replace("</head>", WITHOUT_CAPTION, 1), encoding="utf-8")
            with Browser((SHOT_SCALE * SIZE[0], SHOT_SCALE * SIZE[1])) as browser:
                browser.open(bare, f"#t={telling_time(plan):.6f}")
                small = Image.fromarray(browser.screenshot())
        else:
            small = Image.open(entry.folder / "figures" / "snapshots.png").convert("RGB")
        small.thumbnail(SIZE, Image.Resampling.LANCZOS)
        PICTURES.mkdir(parents=True, exist_ok=True)
        small.save(PICTURES / f"{entry.name}.png", optimize=True)


def parse(names: Sequence[str], words: Sequence[str] | None = None) -> argparse.Namespace:
    """Return the command line's options."""
    parser = argparse.ArgumentParser(prog="scripts/gallery", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("tasks", nargs="*", metavar="TASK", help="tasks to plan anew; default: all")
    parser.add_argument("--jobs", type=int, default=1, help="how many tasks are planned at a time; default: 1")
    parser.add_argument("--time-limit", type=float, default=600.0, metavar="S", help="s for each task; default: 600")
    parser.add_argument("--runs", type=Path, default=ROOT / "runs", metavar="DIR", help="where plans go; default: runs")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--short", action="store_true", help="leave out tasks that the table marks as long")
    which.add_argument("--redraw", action="store_true", help="plan nothing, write everything from the last plans")
    arguments = parser.parse_args(words)
    unknown = sorted(set(arguments.tasks) - set(names))
    if unknown:
        parser.error(f"found '{unknown[0]}', expected one of {', '.join(names)}")
    if arguments.jobs < 1 or not arguments.time_limit > 0:
        parser.error("--jobs and --time-limit must be positive")
    return arguments


def told(words: Sequence[str]) -> str:
    """Return the command as the page tells it, without the folder of this machine that plans go to."""
    kept = [word for before, word in pairwise(["", *words]) if "--runs" not in (before, word.partition("=")[0])]
    return " ".join(["scripts/gallery", *kept])


def main(words: Sequence[str] | None = None) -> int:
    """Plan what was asked for and write table, pictures and list."""
    arguments = parse([entry.name for entry in entries(ROOT / "runs")], words)
    every = entries(arguments.runs.resolve())
    rows = Rows(PAGE, COLUMNS)
    rows.only(entry.name for entry in every)
    left_out = marked_long(rows) if arguments.short else set()
    wanted = set(arguments.tasks or [entry.name for entry in every]) - left_out
    chosen = [entry for entry in every if entry.name in wanted]
    codes = []
    if not arguments.redraw:
        with ThreadPoolExecutor(arguments.jobs) as pool:
            codes = list(pool.map(lambda entry: plan_anew(entry, arguments.time_limit, arguments.jobs), chosen))
    for entry in every:
        draw(entry)
        keep(entry, rows)
    command = told(sys.argv[1:] if words is None else words)
    PAGE.write_text(page(rows, command), encoding="utf-8")
    TASK_LIST.write_text(with_list(TASK_LIST.read_text(encoding="utf-8"), task_list(every)), encoding="utf-8")
    return 1 if any(codes) else 0


if __name__ == "__main__":
    sys.exit(main())
