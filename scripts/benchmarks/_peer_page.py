"""The rows of runs of peers, and their tables on the page of public tasks."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fesd_robot.plans.tables import markdown_table
from scripts.tools.arguments import ROOT
from scripts.tools.table import Row, solved

HEADER = (
    "case",
    "{peer}'s objective",
    "violation",
    "solve, s",
    "whole, s",
    "iterations",
    "MPCC solver's objective",
    "solve, s",
    "whole, s",
    "from {peer}'s end",
    "from the plan",
    "plan, s",
)

SAME = 1e-4
"""Of the larger of two objectives; they are equal within that."""

Runs = dict[str, Any]
"""Of a case: tool -> its numbers, the commit of the peer, the machine and its load."""

BOTH = """Problems are posed here anew, in the peer's steps, with all of its pairs, its weights and its first guess.
*Objective* and *violation* (of start, dynamics, rows, signs and products) are recomputed for all alike, and the
objective that the peer prints agrees with them in its digits. The peer's *solve* is the time that it prints, without
making the functions of the problem, *whole* that of its command; medians of three. *MPCC solver* is
`solve_by_attempts(problem, further=4)` of `fesd_robot.mpcc` on the same problem from the same guess, to products of
zero; its *solve* is that call, with derivatives and certificate, *whole* a process that imports the program, too;
once. Its further homotopies are limited by the time of the first, so that another machine may find other solutions.
*From the peer's end* is the same from the peer's solution. *From the plan* is the objective of the table above, and
*plan* the seconds of the plan there, with search and audit. *(no)* stands where a tool does not call it solved."""

TEXTS = {
    "impact": (
        "IMPACT",
        "[IMPACT](https://github.com/JonasPflaume/IMPACT) at {commit} ran here at the settings of its own programs, "
        "with its release flags, CasADi 3.7 and OpenBLAS, by `python scripts/benchmarks/compare_peers.py impact "
        "IMPACT/build/experiments`, whose first lines say how it is built, on {machine}, with other work (load "
        "{load}). It stops at 1e-5. Of `impact_disk` the MPCC solver alone returns a disk that stays where it is: "
        "as long as the point does not touch it no direction descends, and that is what its certificate says.",
    ),
    "crisp": (
        "CRISP",
        "[CRISP](https://github.com/ComputationalRobotics/CRISP) at {commit} ran here from zero at the settings of "
        "its example files, compiled with -O3, PIQP 0.5.0, by `python scripts/benchmarks/compare_peers.py crisp "
        "CRISP/run`, on {machine}, with other work (load {load}). It stops at 1e-6, of the T at 1e-3; "
        "functions that it has compiled before are not in its times. Its files solve one instance each, of the others "
        "`0.5 to -0.5 m, -4 to -2 m/s` and `240 degrees`; the rest has their settings here, and its authors may know "
        "better ones. Where its objective of the transport is far above the others it misses the goal. Of boxes from "
        "220 degrees on the MPCC solver alone finds solutions that cost up to three times as much as CRISP's; plans do "
        "not.",
    ),
}
"""Peer -> its name, and what is said of its runs."""


def file_of(peer: str) -> Path:
    """Return the data file of a peer's runs."""
    return ROOT / "docs" / "results" / f"public_tasks_{peer}.json"


def known(peer: str) -> dict[str, Runs]:
    """Return case -> its runs."""
    file = file_of(peer)
    found: dict[str, Runs] = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
    return found


def put(peer: str, case: str, runs: Runs) -> None:
    """Put the runs of a case in the place of those of the data file."""
    lines = [f"{json.dumps(name)}: {json.dumps(each)}" for name, each in {**known(peer), case: runs}.items()]
    file_of(peer).write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


def beside_peers(rows: list[Row]) -> str:
    """Return the parts of the page that have runs of peers, beside the plans of the same cases.

    Args:
        rows: of the plans.
    """
    plans = {row["case"]: row for row in rows if solved(row)}
    parts = ["## Peers that ran here", textwrap.fill(BOTH, 120, break_long_words=False, break_on_hyphens=False)]
    return "\n\n".join([*parts, *(_part(peer, plans) for peer in TEXTS if known(peer))])


def _part(peer: str, plans: Mapping[str, Row]) -> str:
    name, text = TEXTS[peer]
    runs = known(peer)
    commits, machines = ({each[key] for each in runs.values()} for key in ("commit", "machine"))
    loads = [each["load"] for each in runs.values()]
    said = text.format(
        commit=" and ".join(sorted(commit[:8] for commit in commits)),
        machine=" and ".join(sorted(machines)),
        load=f"{min(loads):.1f} to {max(loads):.1f}",
    )
    header = [title.format(peer=name) for title in HEADER]
    lines = [_line(case, each, plans.get(case)) for case, each in runs.items()]
    counted = f"{said} {_counted(name, runs, plans)}"
    filled = textwrap.fill(counted, 120, break_long_words=False, break_on_hyphens=False)
    return f"### {name}\n{filled}\n\n{markdown_table(header, lines)}"


def _counted(name: str, runs: Mapping[str, Runs], plans: Mapping[str, Row]) -> str:
    """Return how many objectives are lower than the peer's, equal or higher."""
    ours = {
        "the MPCC solver's": [(each["mpcc"]["objective"], each["peer"]["objective"]) for each in runs.values()],
        "that from the plan": [
            (plans[case]["peer"], each["peer"]["objective"]) for case, each in runs.items() if case in plans
        ],
    }
    words = []
    for of, pairs in ours.items():
        equal = sum(abs(own - peers) <= SAME * max(own, peers) for own, peers in pairs)
        lower = sum(own < peers * (1 - SAME) for own, peers in pairs)
        words.append(
            f"{of} is lower in {lower} of {len(pairs)}, equal in {equal}, higher in {len(pairs) - lower - equal}"
        )
    done = sum(each["peer"]["solved"] for each in runs.values())
    return f"{name} calls {done} of {len(runs)} solved. Beside its objective, {words[0]}; {words[1]}."


def _line(case: str, runs: Runs, plan: Row | None) -> list[str]:
    peer, mpcc, again = runs["peer"], runs["mpcc"], runs["mpcc_from_peer"]
    return [
        case,
        _objective(peer),
        f"{max(peer['violation'], peer['product']):.0e}",
        f"{peer['solve_seconds']:.2f}",
        f"{peer['seconds']:.2f}",
        str(peer["iterations"]),
        _objective(mpcc),
        f"{mpcc['solve_seconds']:.1f}",
        f"{mpcc['seconds']:.1f}",
        _objective(again),
        f"{plan['peer']:.5g}" if plan else "–",
        f"{plan['seconds']:.1f}" if plan else "–",
    ]


def _objective(numbers: Mapping[str, Any]) -> str:
    return f"{numbers['objective']:.5g}" + ("" if numbers["solved"] else " (no)")
