"""A sweep whose rows begin from their neighbours beside the same one whose rows begin from the task alone.

    fesd-robot sweep jump_over_friction --out runs/cold
    fesd-robot sweep jump_over_friction_warm --out runs/warm
    python scripts/results/continuation.py runs/cold runs/warm
    python scripts/results/continuation.py                      # draws the page from its data file

Rows that both folders have go to docs/results/continuation.json, and from there to continuation.md.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fesd_robot.plans.tables import markdown_table
from fesd_robot.sweeps import load_sweep, read_sweep
from fesd_robot.sweeps.comparison import comparison
from fesd_robot.sweeps.rows import Rows
from scripts.tools.arguments import PROGRAM_IS, ROOT, program_of

PAGE = ROOT / "docs" / "results" / "continuation.md"
SWEEP, TASK = "jump_over_friction", "hopper_one_jump"
KEPT = ("verdict", "cost", "iterations", "seconds", "start", "abandoned", "abandoned_iterations")
WAYS = ("from neighbours", "from the task")

Pair = dict[str, Any]
"""Values of a row, and what came of it in both ways."""


def pairs_of(cold: Path, warm: Path, keys: Sequence[str]) -> list[Pair]:
    """Return the rows that two folders have in common."""
    both = comparison(read_sweep(warm).rows(), read_sweep(cold).rows(), keys).pairs
    return [
        {key: own[key] for key in keys}
        | {way: {name: row[name] for name in KEPT} for way, row in zip(WAYS, (own, other), strict=True)}
        for own, other in sorted(both, key=lambda pair: pair[0]["number"])
    ]


def summary(pairs: list[Pair]) -> str:
    """Return the table of both ways; medians are of rows that are solved in both."""
    both = [pair for pair in pairs if all(pair[way]["verdict"] == "solved" for way in WAYS)]
    begun = [pair for pair in both if pair[WAYS[0]]["start"] is not None]
    vain = [pair for pair in pairs if pair[WAYS[0]]["abandoned"] is not None]
    lines = [
        ["solved", *(_share([pair[way] for pair in pairs]) for way in WAYS)],
        ["begun from a neighbour's plan and kept", str(len(begun)), "–"],
        ["begun from one in vain, then from the task", str(len(vain)), "–"],
        *(
            [f"{what} {name} of {whose}", *(f"{function([pair[way][name] for pair in some]):.4g}" for way in WAYS)]
            for whose, some in (("rows that are kept", begun), ("all rows", both))
            for what, function in (("median", np.median), ("total", np.sum))
            for name in ("iterations", "seconds")
            if some
        ),
        ["cheaper by more than 1 %", *(str(sum(_change(pair, side) < -0.01 for pair in both)) for side in (0, 1))],
    ]
    return markdown_table(["", *WAYS], lines)


def _share(rows: list[dict[str, Any]]) -> str:
    count = sum(row["verdict"] == "solved" for row in rows)
    return f"{count} of {len(rows)}"


def _change(pair: Pair, side: int) -> float:
    """Return by which part a cost is above that of the other way."""
    own, other = (pair[way]["cost"] for way in (WAYS[side], WAYS[1 - side]))
    return float(own / other - 1)


def grid(pairs: list[Pair], rows: Rows, cell: Callable[[Pair], str]) -> str:
    """Return a table over both keys."""
    across, down = rows.keys
    known = {(pair[across], pair[down]): cell(pair) for pair in pairs}
    lines = [
        [f"**{friction:g}**", *(known.get((distance, friction), "") for distance in rows.values(across))]
        for friction in rows.values(down)
    ]
    return markdown_table(["friction \\ root_x [m]", *(f"{distance:g}" for distance in rows.values(across))], lines)


def cost_cell(pair: Pair) -> str:
    """Return by how much the continued plan costs more, in per cent."""
    warm, cold = (pair[way]["verdict"] == "solved" for way in WAYS)
    if not warm or not cold:
        return {(True, False): "only continued", (False, True): "only alone"}.get((warm, cold), "neither")
    mark = "" if pair[WAYS[0]]["start"] is not None else " *"
    return f"{100 * _change(pair, 0):+.2g} %{mark}"


def iterations_cell(pair: Pair) -> str:
    """Return the iterations of both."""
    words = ("–" if pair[way]["iterations"] is None else str(pair[way]["iterations"]) for way in WAYS)
    return " / ".join(words)


def page(told: dict[str, Any]) -> str:
    """Return the page."""
    rows, pairs = Rows(load_sweep(SWEEP)), told["rows"]
    older = "" if told["program"] == program_of(TASK) else ", older than what it measures"
    return "\n".join(
        [
            "# Plans from their neighbours",
            "",
            f"Made by `python scripts/results/continuation.py COLD WARM`, drawn from [its rows](continuation.json): "
            f"{len(pairs)} of the {len(rows)} rows of `{SWEEP}`, by one process beside other work, so that seconds are "
            f"those of a busy machine. Program: {told['program']}{older}. {PROGRAM_IS}",
            "",
            summary(pairs),
            "",
            "## Cost from neighbours above that from the task",
            "With * the row does not begin from another one's plan.",
            "",
            grid(pairs, rows, cost_cell),
            "",
            "## Iterations from neighbours / from the task",
            "",
            grid(pairs, rows, iterations_cell),
        ]
    )


def main() -> None:
    """Take rows from two folders, and draw the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folders", nargs="*", type=Path, metavar="COLD WARM", help="of both sweeps")
    parser.add_argument("--page", type=Path, default=PAGE)
    arguments = parser.parse_args()
    if len(arguments.folders) not in (0, 2):
        parser.error(f"found {len(arguments.folders)} folders, expected two, or none to draw the page again")
    file = arguments.page.with_suffix(".json")
    if arguments.folders:
        cold, warm = arguments.folders
        pairs = pairs_of(cold, warm, list(Rows(load_sweep(SWEEP)).keys))
        lines = ",\n".join(json.dumps(pair) for pair in pairs)
        file.write_text(f'{{"program": "{program_of(TASK)}", "rows": [\n{lines}\n]}}\n', encoding="utf-8")
    arguments.page.write_text(page(json.loads(file.read_text(encoding="utf-8"))), encoding="utf-8")


if __name__ == "__main__":
    main()
