"""Plan every task in tasks/, and write a table, one picture a task and the list of tasks.

    scripts/gallery                                  # all tasks, several at a time
    scripts/gallery --jobs 1 --time-limit 300        # one at a time, at most 300 s each
    scripts/gallery hopper_one_jump block_push       # these anew; rows and pictures of others stay
    scripts/gallery --short                          # only tasks that the table does not mark as long
    scripts/gallery --redraw                         # nothing anew

Plans go to runs/TASK. The table goes to docs/results/gallery.md, its rows to gallery.json beside it, the pictures to
docs/images/gallery/: the pages as Chromium shows them. Exit code 1 if a task that was planned is not solved.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from PIL import Image

from fesd_robot.contact import ContactMode
from fesd_robot.plans import Plan, read_plan
from fesd_robot.plans.outcome import Outcome
from fesd_robot.plans.outcome_words import flight_words, miss_words
from fesd_robot.plans.plan import ContactHistory
from fesd_robot.plans.results_folder import PAGE_FILE
from fesd_robot.plans.tables import markdown_table
from fesd_robot.sweeps.planned import planned
from scripts.results.claims import CLAIMS
from scripts.tools.arguments import ROOT
from scripts.tools.table import PROGRAM_IS, Row, Table, every_task, solved
from tests.render.browser import Browser, installed

RUNS = ROOT / "runs"
PICTURES = ROOT / "docs" / "images" / "gallery"
TASK_LIST = ROOT / "docs" / "tasks.md"
MARKS = ("<!-- tasks: written by scripts/gallery -->", "<!-- end of tasks -->")

LONG_SECONDS = 30.0
"""Seconds above which a task is marked as long."""

LIMIT = 600.0
"""s for each task unless said otherwise."""

SIZE, SHOT_SCALE = (320, 200), 3

MEASURES: dict[str, type] = {
    "degrees_of_freedom": int, "contacts": int, "variables": int, "pairs": int, "position_missed_by": str,
    "velocity_missed_by": str, "flights_in_words": str, "longest_slide": str, "broken": str, "replay_differs_by": str,
    "refined_to": str, "complementarity": float, "stationarity": str,
}  # fmt: skip
COLUMNS = ("task", "purpose", "degrees of freedom", "contacts", "variables", "pairs", "iterations", "seconds",
           "position missed by", "velocity missed by", "flights", "longest slide", "does what it says",
           "replay differs by", "refined to", "cost", "complementarity", "stationarity", "program",
           "status")  # fmt: skip
WITHOUT_CAPTION = (
    "<style>aside, #time, #bar { display: none !important; } "
    "body { grid-template: 'scene' minmax(0, 1fr) / minmax(0, 1fr) !important; }</style></head>"
)


@dataclass(frozen=True)
class Entry:
    """A task of the gallery: its file, and its purpose, the second line of the file."""

    file: Path
    purpose: str

    @property
    def name(self) -> str:
        return self.file.stem


def entries() -> list[Entry]:
    """Return all tasks in tasks/ by name."""
    files = [ROOT / "tasks" / f"{name}.yaml" for name in every_task()]
    return [Entry(file, file.read_text(encoding="utf-8").splitlines()[1].removeprefix("# ")) for file in files]


def measure(plan: Plan) -> dict[str, Any]:
    """Return what the table says of a plan beside what every row of a sweep has."""
    status, effort = plan.status, plan.statistics
    kind = status.stationarity + {"certified": ", B", "refuted": ", not B"}.get(status.b_stationary, "")
    values = [
        len(plan.trajectory.velocity), len(plan.contacts), effort.variables, effort.pairs, *outcome_cells(plan.outcome),
        "; ".join(CLAIMS[plan.name].broken(plan)), replay_words(plan), refinement_words(plan), status.complementarity,
        kind,
    ]  # fmt: skip
    return dict(zip(MEASURES, values, strict=True))


def cells(row: Row, purpose: str) -> list[str]:
    """Return the cells of a row."""
    start, name = [f"[{row['task']}](../../tasks/{row['task']}.yaml)", purpose], TABLE.program(row)
    if row["cost"] is None:
        seconds = f"{row['seconds']:.1f}"
        return [*start, *[""] * 5, seconds, *[""] * 10, name, f"not solved: {row['message']}"]
    many = f" with settings {row['attempts']}" if row["attempts"] > 1 else ""
    return [
        *start,
        *(str(row[column]) for column in list(MEASURES)[:4]),
        str(row["iterations"]),
        f"{row['seconds']:.1f}" + (" long" if is_long(row) else ""),
        *(row[column] or "" for column in list(MEASURES)[4:8]),
        row["broken"] or "yes",
        row["replay_differs_by"] or "",
        row["refined_to"] or "",
        f"{row['cost']:.5g}",
        f"{row['complementarity']:.1e}",
        row["stationarity"],
        name,
        f"solved{many}" if solved(row) else f"not solved: {row['message'].split('; try')[0]}",
    ]


def is_long(row: Row) -> bool:
    """Return whether a task takes long."""
    return bool(row["seconds"] > LONG_SECONDS)


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


def page_of(rows: list[Row]) -> str:
    """Return the table as a page."""
    purposes = {entry.name: entry.purpose for entry in entries()}
    return "\n".join(
        [
            "# All tasks",
            "",
            f"{TABLE.made_by(rows)} {PROGRAM_IS}",
            "",
            f"**{sum(map(solved, rows))} of {len(rows)} solved**: complementarity within `solver.tolerance` and the "
            "physics audit passed. Variables and pairs are those of the attempt that was kept; iterations and wall "
            "seconds, building and certificate included, of all attempts of one run, some with other work beside it. "
            "The goal is missed by the largest difference of each unit; flights and the longest slide are those of all "
            "contacts. What a task says in its first line is held against its plan by `scripts/results/claims.py`. "
            f"Tasks that take more than {LONG_SECONDS:g} s are marked as long; `scripts/gallery --short` leaves them "
            "out. The replay drives every control interval again from the plan's state with an event-driven "
            "integrator; the largest difference at the end of an interval is given for each unit. Refinement ends with "
            "a largest local error; its seconds are part of the seconds.",
            "",
            markdown_table(COLUMNS, [cells(row, purposes[row["task"]]) for row in rows]),
            "",
        ]
    )


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


def draw(folder: Path) -> None:
    """Write the picture of a task from the page of its plan, if there is a browser."""
    if not installed():
        return
    plan = read_plan(folder)
    with tempfile.TemporaryDirectory() as temporary:
        bare = Path(temporary) / PAGE_FILE
        html = (folder / PAGE_FILE).read_text(encoding="utf-8")
        bare.write_text(html.replace("</head>", WITHOUT_CAPTION, 1), encoding="utf-8")
        with Browser((SHOT_SCALE * SIZE[0], SHOT_SCALE * SIZE[1])) as browser:
            browser.open(bare, f"#t={telling_time(plan):.6f}")
            small = Image.fromarray(browser.screenshot())
    small.thumbnail(SIZE, Image.Resampling.LANCZOS)
    PICTURES.mkdir(parents=True, exist_ok=True)
    small.save(PICTURES / f"{plan.name}.png", optimize=True)


TABLE = Table(
    ROOT / "docs" / "results" / "gallery.md",
    {"vary": {"task": every_task()}},
    page_of,
    partial(planned, measure=measure),
    MEASURES,
)


def main(words: Sequence[str]) -> int:
    """Plan what was asked for and write table, pictures and list."""
    own = [word for word in words if word != "--short"]
    if len(own) < len(words):
        own += [row["task"] for row in TABLE.known() if not is_long(row)]
    redraw = "--redraw" in own
    rows = TABLE.main(__doc__ or "", own, keep="all", time_limit=LIMIT)
    for row in [] if redraw else rows:
        if row["plan"]:
            shutil.rmtree(RUNS / row["task"], ignore_errors=True)
            shutil.copytree(TABLE.folder / row["plan"], RUNS / row["task"])
            draw(RUNS / row["task"])
    TASK_LIST.write_text(with_list(TASK_LIST.read_text(encoding="utf-8"), task_list(entries())), encoding="utf-8")
    return 0 if all(map(solved, rows)) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
