"""Solve the MPCCs of NOSBENCH and MPECLib, file by file, and write a page of rows beside published ones.

    git clone https://github.com/nosnoc/nosbench FOLDER/nosbench
    git clone https://github.com/mpecssalgorithm/mpecss FOLDER/mpecss
    python scripts/benchmarks/mpcc_suites.py FOLDER

Every file is solved in a process of its own with a limit of time and of memory. Rows are kept as they come, in the
JSON file beside the page, and files that have one are left out: what was ended goes on where it was. ``--again`` solves
those without solution once more, ``--names`` those of a list, ``--page`` writes the page alone.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import re
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from fesd_robot.mpcc import Run, read_casadi_json, solve_by_attempts
from fesd_robot.running import Deadline
from scripts.benchmarks.suites.page import page
from scripts.tools.arguments import ROOT, machine

PAGE = ROOT / "docs" / "results" / "mpcc_suites.md"
FOLDERS = {"NOSBENCH": "nosbench/problems/casadi", "MPECLib": "mpecss/benchmarks/mpeclib/mpeclib-json"}
PUBLISHED = {"NOSBENCH": "nosbench_full_*.csv", "MPECLib": "mpeclib_full_*.csv"}
"""Names of the peer's tables of these suites, anywhere in its results."""

ENDED_AFTER, IMPORTING = 60.0, 10.0
"""s after the time limit, in which a process may still certify and write what it has found."""

Row = dict[str, Any]


def name_of(file: Path) -> str:
    """Return the name of the problem in a file."""
    return file.name.removesuffix(".json").removesuffix(".nl")


def family_of(name: str) -> str:
    """Return the family of a problem: what its name has before the numbers of its variants."""
    found = re.match(r"[0-9]*[A-Za-z]+[0-9]*[A-Za-z]*(?=_)|[A-Za-z]+", name)
    return found.group() if found else name


def checked(file: Path, w: np.ndarray) -> dict[str, float]:
    """Return objective, violation and product at a point, from the file's own functions and bounds alone.

    Of a pair with bounds on H, as in mixed complementarity, the products are those of max(G, 0) with the distance from
    the lower bound and of max(-G, 0) with that from the upper one; with G >= 0 the first alone.
    """
    data = json.loads(file.read_text(encoding="utf-8"))
    w = w[: len(data["w0"])]

    def value(key: str) -> np.ndarray:
        function = ca.Function.deserialize(data[key])
        return np.asarray(function(*(w, data.get("p0", []))[: function.n_in()])).ravel()

    def bounds(low: str, high: str, size: int, default: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
        lower, upper = (
            np.full(size, 1.0) * np.array(default[i] if data.get(key) is None else data[key], float).ravel()
            for i, key in enumerate((low, high))
        )
        return np.where(lower <= -1e19, -np.inf, lower), np.where(upper >= 1e19, np.inf, upper)

    def outside(values: np.ndarray, limits: tuple[np.ndarray, np.ndarray]) -> float:
        return float(np.maximum(limits[0] - values, values - limits[1]).max(initial=0.0))

    G, H = value("G_fun"), value("H_fun")
    g = value("g_fun") if data.get("g_fun") else np.zeros(0)
    on_H, on_G = bounds("lbH", "ubH", len(H), (0, np.inf)), bounds("lbG", "ubG", len(G), (0, np.inf))
    signed, one_sided = np.isfinite(on_G[0]), ~np.isfinite(on_H[0]) & np.isfinite(on_H[1])
    towards = np.where(one_sided & signed, -G, G)
    free = ~np.isfinite(on_H[0]) & ~np.isfinite(on_H[1])
    parts = [
        np.where(free, np.abs(G), 0.0),
        np.where(np.isfinite(on_H[0]), np.maximum(towards, 0) * (H - np.where(np.isfinite(on_H[0]), on_H[0], H)), 0.0),
        np.where(np.isfinite(on_H[1]), np.maximum(-towards, 0) * (np.where(np.isfinite(on_H[1]), on_H[1], H) - H), 0.0),
    ]
    violation = max(
        outside(w, bounds("lbw", "ubw", len(w), (-np.inf, np.inf))),
        outside(g, bounds("lbg", "ubg", len(g), (-np.inf, np.inf))),
        outside(H, on_H),
        outside(G, on_G),
    )
    return {
        "objective": float(value("augmented_objective_fun" if "augmented_objective_fun" in data else "f_fun")[0]),
        "violation": violation,
        "product": float(np.max(parts, initial=0.0)),
    }


def solved_row(file: Path, given: argparse.Namespace) -> Row:
    """Return the row of one file, solved in this process."""
    begin, cpu = time.perf_counter(), time.process_time()
    problem = read_casadi_json(file)
    found = solve_by_attempts(problem, Run(deadline=Deadline(given.seconds)), further=given.further)
    took, cpu_took = time.perf_counter() - begin, time.process_time() - cpu
    solution, certificate = found.solution, found.certificate
    if given.points:
        given.points.mkdir(parents=True, exist_ok=True)
        np.save(given.points / f"{name_of(file)}.npy", solution.w)
    return {
        "variables": problem.size,
        "constraints": problem.constraints,
        "pairs": problem.pairs,
        "solved": solution.solved,
        "exact": solution.exact,
        **checked(file, solution.w),
        "smaller_side": solution.residuals.natural_residual,
        "status": solution.status.value,
        "b_stationary": certificate.b_stationary if certificate else "",
        "kind": certificate.kind if certificate else "",
        "iterations": solution.iterations,
        "seconds": round(took, 3),
        "cpu_seconds": round(cpu_took, 3),
        "attempt": found.attempt,
        "descents": found.descents,
        "conflict": str(found.conflict) if found.conflict else "",
    }


def row_of(file: Path, given: argparse.Namespace) -> Row:
    """Return the row of one file, solved in a process of its own that is ended where it takes too long."""
    words = [sys.executable, "-m", "scripts.benchmarks.mpcc_suites", str(file), "--one"]
    words += ["--seconds", str(given.seconds), "--further", str(given.further)]
    words += ["--points", str(given.points)] if given.points else []
    limit, begin = int(given.memory * 2**30), time.perf_counter()
    try:
        done = subprocess.run(
            words,
            cwd=ROOT,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            capture_output=True,
            text=True,
            check=False,
            preexec_fn=partial(resource.setrlimit, resource.RLIMIT_AS, (limit, limit)),
            timeout=given.seconds + ENDED_AFTER + IMPORTING,
        )
        lines = done.stdout.strip().splitlines()
        if done.returncode == 0 and lines:
            return dict(json.loads(lines[-1]))
        said = (done.stderr.strip().splitlines() or [f"ended with {done.returncode}"])[-1]
    except subprocess.TimeoutExpired:
        said = "ended after the time limit"
    return {"solved": False, "status": said[:200], "seconds": round(time.perf_counter() - begin, 3)}


def published(folder: Path) -> dict[str, Row]:
    """Return what the peer has published of every problem, by its name."""
    found: dict[str, Row] = {}
    for table in (file for pattern in PUBLISHED.values() for file in (folder / "mpecss" / "results").rglob(pattern)):
        with table.open(encoding="utf-8", newline="") as lines:
            for line in csv.DictReader(lines):
                found[line["problem_name"]] = {
                    "status": line["status"],
                    "kind": line["stationarity"],
                    "objective": float(line["f_final"]) if line["f_final"] else None,
                    "product": float(line["comp_res"]) if line["comp_res"] else None,
                    "seconds": round(float(line["cpu_time_total"]), 3) if line["cpu_time_total"] else None,
                }
    return found


def levels(folder: Path) -> dict[str, int]:
    """Return the level of every problem of NOSBENCH."""
    listed = folder / "nosbench" / "problems" / "unlifted_problems"
    words = listed.read_text(encoding="utf-8").split() if listed.exists() else []
    return {name.removesuffix(".mat"): int(level[-1]) for level, name in (word.split("/") for word in words)}


def commit() -> str:
    """Return the last commit that changed the package, with + where the checkout differs from it."""

    def git(*words: str) -> str:
        command = ["git", "-C", str(ROOT), *words, "--", "fesd_robot"]
        return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()

    return git("log", "-1", "--format=%h") + ("+" if git("status", "--porcelain") else "")


def files_of(given: argparse.Namespace, rows: dict[str, Row]) -> Iterator[tuple[str, Path]]:
    """Yield suite and file of every problem that is to be solved, small files first."""
    wanted = set(given.names.read_text(encoding="utf-8").split()) if given.names else None
    for suite in given.suites:
        files = sorted((given.folder / FOLDERS[suite]).glob("*.json"), key=lambda file: file.stat().st_size)
        for file in files:
            name = name_of(file)
            known = rows.get(name)
            if known is not None and (known["solved"] or not given.again):
                continue
            if (wanted is None or name in wanted) and re.search(given.only, name):
                yield suite, file


def write(rows: dict[str, Row], file: Path) -> None:
    """Write the rows, one a line, by suite and name."""
    ordered = sorted(rows.values(), key=lambda row: (row["suite"], row.get("level", 0), row["name"]))
    text = "[\n" + ",\n".join(json.dumps(row, ensure_ascii=False) for row in ordered) + "\n]\n"
    beside = file.with_suffix(".part")
    beside.write_text(text, encoding="utf-8")
    beside.replace(file)


def parsed() -> argparse.Namespace:
    """Return what was asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, help="with the clones nosbench and mpecss")
    parser.add_argument("--suites", nargs="+", choices=sorted(FOLDERS), default=["MPECLib", "NOSBENCH"])
    parser.add_argument("--names", type=Path, help="file with the names of those that are solved, one a line")
    parser.add_argument("--only", default="", help="regular expression that names have to match")
    parser.add_argument("--again", action="store_true", help="solve those without solution once more")
    parser.add_argument("--seconds", type=float, default=600.0, help="time limit of a file")
    parser.add_argument("--memory", type=float, default=6.0, help="GB of address space of a process")
    parser.add_argument("--further", type=int, default=0, help="homotopies after a solution, for a cheaper one")
    parser.add_argument("--points", type=Path, help="folder for the points that were found")
    parser.add_argument("--page", action="store_true", help="write the page alone")
    parser.add_argument("--out", type=Path, default=PAGE)
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    return parser.parse_args()


def main() -> None:
    """Solve what has no row yet, and write rows and page."""
    given = parsed()
    if given.one:
        print(json.dumps(solved_row(given.folder, given)))
        return
    data = given.out.with_suffix(".json")
    known = json.loads(data.read_text(encoding="utf-8")) if data.exists() else []
    rows: dict[str, Row] = {row["name"]: row for row in known}
    level, peer = levels(given.folder), published(given.folder)
    made = {"limit": given.seconds, "further": given.further, "machine": machine(), "program": commit()}
    for suite, file in [] if given.page else list(files_of(given, rows)):
        name = name_of(file)
        where = {"suite": suite, "level": level.get(name, 0), "family": family_of(name), "name": name}
        rows[name] = {**where, **row_of(file, given), **made, "published": peer.get(name)}
        write(rows, data)
        print(*(rows[name].get(key, "") for key in ("name", "solved", "objective", "status", "seconds")), flush=True)
    given.out.write_text(page(list(rows.values())), encoding="utf-8")


if __name__ == "__main__":
    main()
