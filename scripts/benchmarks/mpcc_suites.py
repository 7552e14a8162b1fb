"""Solve every MPCC of a suite, file by file, and write a row for each: `mpcc_suites.py FOLDER --suite NOSBENCH`."""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
KILLED_AFTER = 30.0
"""s after the time limit, in which a process may still write what it has found."""


def name_of(file: Path) -> str:
    """Return the name of the problem in a file."""
    return file.name.removesuffix(".json").removesuffix(".nl")


def family_of(name: str) -> str:
    """Return the family of a problem: its name up to a mark or number, and for findNNN its letter."""
    family = re.match(r"[0-9]*[A-Za-z]+[0-9]*[A-Za-z]*(?=_)|[A-Za-z_]+", name)
    return re.sub(r"_$", "", family.group()) if family else name


def solved_row(file: Path, seconds: float, points: Path | None) -> dict[str, Any]:
    """Return the row of one file, solved in this process."""
    from fesd_robot.mpcc import Run
    from fesd_robot.mpcc.attempts import solve_by_attempts
    from fesd_robot.mpcc.sources import read_casadi_json
    from fesd_robot.running import Deadline

    begin, cpu = time.perf_counter(), time.process_time()
    problem = read_casadi_json(file)
    found = solve_by_attempts(problem, Run(deadline=Deadline(seconds)))
    took, cpu_took = time.perf_counter() - begin, time.process_time() - cpu
    solution, certificate, conflict = found.solution, found.certificate, found.conflict
    residuals = problem.residuals(solution.w)
    if points:
        points.mkdir(parents=True, exist_ok=True)
        np.save(points / f"{name_of(file)}.npy", solution.w)
    return {
        "variables": problem.size,
        "constraints": problem.constraints,
        "pairs": problem.pairs,
        "solved": solution.solved,
        "exact": solution.exact,
        "objective": residuals.objective,
        "violation": residuals.constraint_violation,
        "product": residuals.complementarity,
        "smaller_side": residuals.natural_residual,
        "status": solution.status.value,
        "b_stationary": certificate.b_stationary if certificate else "",
        "kind": certificate.kind if certificate else "",
        "iterations": solution.iterations,
        "seconds": round(took, 3),
        "cpu_seconds": round(cpu_took, 3),
        "attempt": found.attempt,
        "descents": found.descents,
        "conflict": str(conflict) if conflict else "",
    }


def row_of(file: Path, given: argparse.Namespace) -> dict[str, Any]:
    """Return the row of one file, solved in a process of its own that is ended where it takes too long."""
    words = [str(file), "--one", "--seconds", str(given.seconds), "--suite", given.suite]
    words += ["--points", str(given.points)] if given.points else []
    bytes_allowed = int(given.memory * 2**30)

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (bytes_allowed, bytes_allowed))

    begin = time.perf_counter()
    try:
        done = subprocess.run(
            [sys.executable, __file__, *words],
            capture_output=True, text=True, check=False, preexec_fn=limited,
            timeout=given.seconds + 60.0 + KILLED_AFTER,
        )  # fmt: skip
        lines = done.stdout.strip().splitlines()
        if done.returncode == 0 and lines:
            return json.loads(lines[-1])
        said = (done.stderr.strip().splitlines() or [f"ended with {done.returncode}"])[-1]
    except subprocess.TimeoutExpired:
        said = "killed after the time limit"
    return {"solved": False, "status": said[:200], "seconds": round(time.perf_counter() - begin, 3)}


def main() -> None:
    """Run the suite."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--suite", required=True)
    parser.add_argument("--names", type=Path, help="file with names of problems, one a line; default: all")
    parser.add_argument("--only", default="", help="regular expression that names must match")
    parser.add_argument("--again", action="store_true", help="those without solution once more")
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--memory", type=float, default=6.0, help="GB of address space of a process")
    parser.add_argument("--rows", type=Path, default=ROOT / "docs/results/mpcc_suites.jsonl")
    parser.add_argument("--points", type=Path)
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        print(json.dumps(solved_row(given.folder, given.seconds, given.points)))
        return
    rows = [json.loads(line) for line in given.rows.read_text().splitlines()] if given.rows.exists() else []
    known = {(row["suite"], row["name"]): row["solved"] for row in rows}
    files = sorted(given.folder.glob("*.json"), key=lambda file: file.stat().st_size)
    wanted = set(given.names.read_text().split()) if given.names else None
    commit = subprocess.run(["git", "-C", str(ROOT), "log", "-1", "--format=%h"], capture_output=True, text=True)
    for file in files:
        name = name_of(file)
        if not re.search(given.only, name) or (wanted is not None and name not in wanted):
            continue
        if known.get((given.suite, name), not given.again if (given.suite, name) in known else None) is not None and not (given.again and not known[(given.suite, name)]):
            continue
        row = {"suite": given.suite, "name": name, "family": family_of(name), **row_of(file, given)}
        row |= {"limit": given.seconds, "commit": commit.stdout.strip(), "cores": os.cpu_count()}
        with given.rows.open("a") as out:
            out.write(json.dumps(row) + "\n")
        print(name, row["solved"], row.get("objective"), row["status"], row.get("b_stationary"), row["seconds"], flush=True)


if __name__ == "__main__":
    main()
