"""Where impacts, touchdowns and take-offs of plans lie: inside control intervals, or where a control changes.

    python scripts/results/switch_times.py                      # plans in runs/
    python scripts/results/switch_times.py --runs OTHER_FOLDER

The table goes to docs/results/switch_times.md; rows of tasks without a plan there stay as they are.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from fesd_robot.plans import Plan, read_plan
from fesd_robot.plans.tables import markdown_table
from scripts.tools.arguments import PROGRAM_IS, ROOT, Rows, program_of

PAGE = ROOT / "docs" / "results" / "switch_times.md"
HARD = 0.01
"""m/s; a contact that touches down slower comes down softly."""

SAME = 1e-6
"""Times that differ by less than this part of a control interval are one."""

HEADER = ["task", "intervals", "impacts", "on the grid", "touchdowns and take-offs", "on the grid too", "program"]


def on_grid(times: list[float], grid: np.ndarray) -> int:
    """Return how many of some times are ends of control intervals.

    Args:
        times: s.
        grid: (N + 1,) ends of the control intervals, s.
    """
    return sum(bool(np.min(np.abs(grid - time)) < SAME * np.min(np.diff(grid))) for time in times)


def row_of(result: Plan) -> list[str]:
    """Return the row of a plan."""
    assert result.outcome
    grid = np.array([*result.controls["time"], result.trajectory.time[-1]])
    switches = [switch.time for switch in result.switches if switch.kind in ("touchdown", "takeoff")]
    hard = [
        impact.time
        for contact in result.outcome.contacts.values()
        for impact in contact.impacts
        if impact.approach_velocity > HARD
    ]
    counts = [len(hard), on_grid(hard, grid), len(switches), on_grid(switches, grid)]
    return [
        result.name,
        str(len(grid) - 1),
        *[str(count) for count in counts],
        program_of(result.name, result.provenance.git),
    ]


def page_of(rows: list[list[str]]) -> str:
    """Return the page with the rows of all tasks so far."""
    hard, hard_on, switches, switches_on = (sum(int(row[column]) for row in rows) for column in range(2, 6))
    return "\n".join(
        [
            "# Switches and the control grid",
            "",
            f"Made by `python scripts/results/switch_times.py` from the plans of {len(rows)} tasks in the gallery.",
            "",
            f"**{hard_on} of {hard}** impacts faster than {HARD:g} m/s and **{switches_on} of {switches}** touchdowns "
            "and take-offs are where a control interval ends. By chance none would be, for their times are free. They "
            "are there where that is cheapest, because the controls change there and nowhere else. On a grid that "
            "moves every one of them is there. Contacts that switch together count one by one. " + PROGRAM_IS,
            "",
            markdown_table(HEADER, rows),
        ]
    )


def main() -> int:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=Path, default=ROOT / "runs", help="folder of plans, one a task")
    parser.add_argument("--page", type=Path, default=PAGE)
    arguments = parser.parse_args()
    rows = Rows(arguments.page, HEADER)
    for file in sorted(arguments.runs.glob("*/plan.json")):
        result = read_plan(file)
        if result.status.solved:
            rows.put(row_of(result))
    arguments.page.write_text(page_of(rows.cells), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
