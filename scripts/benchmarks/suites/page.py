"""The page of the suites: tables by level and family, what is not solved, and what the rules are."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from statistics import median
from typing import Any

from fesd_robot.plans.tables import markdown_table

Row = dict[str, Any]

VIOLATION, PRODUCT = 1e-6, 1e-7
"""Largest violation of a row or bound, and largest product, of a point that counts as solved."""

TIMES_BEST, NEGLIGIBLE = 2.0, 1e-6
"""An objective counts as failure that is above so many times the best known, and by more than this."""

SAME = 1e-3
"""Of the larger of two objectives; they are equal within that and `NEGLIGIBLE`."""

SUITES = {"NOSBENCH": 603, "MPECLib": 92}
"""Files of the whole suites."""

HEADER = (
    "",
    "files",
    "variables",
    "pairs",
    "solved",
    "and at most twice the best",
    "certified",
    "MPECSS converged",
    "of them B",
    "objective lower, equal, higher",
    "median CPU s",
    "MPECSS, median s",
)


def solved(row: Row) -> bool:
    """Whether the solver claims a solution, and the file's own functions agree."""
    return bool(row["solved"] and row["violation"] <= VIOLATION and row["product"] <= PRODUCT)


def certified(row: Row) -> bool:
    """Whether no branch descends from its solution."""
    return solved(row) and row["b_stationary"] == "certified"


def converged(row: Row) -> bool:
    """Whether MPECSS has published a solution."""
    return bool(row["published"] and row["published"]["status"] == "converged")


def far(row: Row) -> bool:
    """Whether a solution costs more than twice the best known, which is the lower of both."""
    if not (solved(row) and converged(row)):
        return False
    best = min(row["objective"], row["published"]["objective"])
    return bool(row["objective"] > best + max((TIMES_BEST - 1) * abs(best), NEGLIGIBLE))


def compared(rows: Iterable[Row]) -> tuple[int, int, int]:
    """Return of how many the objective is lower, equal and higher than MPECSS's, where both have one."""
    counts = [0, 0, 0]
    for row in rows:
        if solved(row) and converged(row):
            own, other = row["objective"], row["published"]["objective"]
            same = NEGLIGIBLE + SAME * max(abs(own), abs(other))
            counts[1 if abs(own - other) <= same else 0 if own < other else 2] += 1
    return counts[0], counts[1], counts[2]


def line(title: str, rows: Sequence[Row]) -> list[str]:
    """Return the line of some rows."""

    def count(holds: Callable[[Row], bool]) -> str:
        return str(sum(map(holds, rows)))

    def sizes(key: str) -> str:
        values = [row[key] for row in rows if key in row]
        return f"{median(values):.0f}, {max(values)}" if values else "-"

    def seconds(values: Iterable[float | None]) -> str:
        known = [value for value in values if value is not None]
        return f"{median(known):.3g}" if known else "-"

    return [
        title,
        str(len(rows)),
        sizes("variables"),
        sizes("pairs"),
        count(solved),
        count(lambda row: solved(row) and not far(row)),
        count(certified),
        count(converged),
        count(lambda row: converged(row) and row["published"]["kind"] == "B"),
        ", ".join(map(str, compared(rows))),
        seconds(row.get("cpu_seconds") for row in rows),
        seconds(row["published"]["seconds"] for row in rows if row["published"]),
    ]


def table(rows: Sequence[Row], key: str) -> str:
    """Return a line for each value of a key, and one for all."""
    values = sorted({row[key] for row in rows}, key=str)
    lines = [line(str(value), [row for row in rows if row[key] == value]) for value in values]
    return markdown_table(HEADER, [*lines, line("all", rows)])


def unsolved(rows: Sequence[Row]) -> str:
    """Return how each ended that is not solved, and what MPECSS has of it."""
    lines = []
    for row in rows:
        if solved(row):
            continue
        words = row.get("conflict") or row["status"]
        peer = row["published"]["status"].replace("_", " ") if row["published"] else "-"
        lines.append([row["name"], words, peer, f"{row['seconds']:.3g}"])
    return markdown_table(("file", "how it ended", "MPECSS", "seconds"), lines) if lines else "None."


def far_off(rows: Sequence[Row]) -> str:
    """Return those whose objective is far off the best known."""
    lines = [
        [row["name"], f"{row['objective']:.6g}", f"{row['published']['objective']:.6g}"] for row in rows if far(row)
    ]
    return markdown_table(("file", "objective", "MPECSS"), lines) if lines else "None."


def page(rows: Sequence[Row]) -> str:
    """Return the page of all rows."""
    parts = [
        "# Suites of MPCCs",
        "Written by `scripts/benchmarks/mpcc_suites.py`, which says where the files come from; rows are in"
        " `mpcc_suites.json`. `solve_by_attempts` of [fesd_robot.mpcc](../mpcc.md) with default settings, one process"
        " and one core a file.",
        f"**Solved**: rows and bounds hold to {VIOLATION:g} and products to {PRODUCT:g}, recomputed from the file's own"
        " functions. **At most twice the best**: the objective is not above twice the best known, the lower of this"
        f" and MPECSS's, by more than {NEGLIGIBLE:g}; an objective far off counts as a failure with the authors of"
        " NOSBENCH, too. **Certified**: B-stationary, no branch descends to first order. Objectives are equal within"
        f" {SAME:g} of the larger. CPU seconds are those of one core of {' and '.join(machines(rows))};"
        " all limits were"
        f" wall-clock times of {' or '.join(f'{limit:g}' for limit in sorted({row['limit'] for row in rows}))} s a file"
        " on a machine whose two cores were shared with other work.",
        "**MPECSS** 1.0.3 (272fabc, 2026-05-01): its published rows, converged at its own test of 1e-6, up to 3,600 s a"
        " file on a shared notebook machine. Times of different machines say little more than orders of magnitude.",
    ]
    for suite, whole in SUITES.items():
        own = [row for row in rows if row["suite"] == suite]
        if not own:
            continue
        parts += [
            f"## {suite}",
            f"{len(own)} of its {whole} files.{SAMPLES[suite]}{looked_further(own)}{first_alone(own)}",
        ]
        if suite == "NOSBENCH":
            parts += [table(own, "level"), "By family:"]
        parts += [table(own, "family"), "Not solved:", unsolved(own), "Objective far off:", far_off(own)]
    return "\n\n".join(parts) + "\n"


def looked_further(rows: Sequence[Row]) -> str:
    """Return of how many files further homotopies have looked for a cheaper solution."""
    count = sum(row["further"] > 0 for row in rows)
    return f" For {count} of them two further homotopies looked for a cheaper solution (`further=2`)." if count else ""


def first_alone(rows: Sequence[Row]) -> str:
    """Return of how many files only the first attempt was made."""
    count = sum(not row["attempt"] for row in rows if row["solved"])
    return f" {count} were solved by the first homotopy before there were others, by `solve`." if count else ""


def machines(rows: Iterable[Row]) -> list[str]:
    """Return the machines of the rows."""
    return sorted({row["machine"] for row in rows})


SAMPLES = {
    "NOSBENCH": (
        " Files above 4 MB were not at hand; of the others levels 1 and 2 are complete, and of levels 3 and 4, with 39"
        " and 51, those were run that the table counts. Its authors (arXiv 2312.11022, 1 h a file on another machine)"
        " solve 73.8 % of all 603 with an objective at most twice the best, by IPOPT and the l-infinity relaxation."
        " Levels are those of its list `unlifted_problems`."
    ),
    "MPECLib": (
        " The six `tinque` files, above 4 MB, were not at hand. A pair with bounds on H is one of mixed"
        " complementarity, as in GAMS."
    ),
}
"""What is to be said of the files."""
