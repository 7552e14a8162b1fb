"""Solve every MPCC of a suite, file by file, and write a row for each: `mpcc_suites.py FOLDER --suite NOSBENCH`."""

from __future__ import annotations

import argparse
import json
import re
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))

from arguments import machine  # noqa: E402

KILLED_AFTER = 30.0
"""s after the time limit, in which a process may still write what it has found."""


def name_of(file: Path) -> str:
    """Return the name of the problem in a file."""
    return file.name.removesuffix(".json").removesuffix(".nl")


def family_of(name: str) -> str:
    """Return the family of a problem: its name up to a mark or number, and for findNNN its letter."""
    family = re.match(r"[0-9]*[A-Za-z]+[0-9]*[A-Za-z]*(?=_)|[A-Za-z_]+", name)
    return re.sub(r"_$", "", family.group()) if family else name


def solved_row(file: Path, given: argparse.Namespace) -> dict[str, Any]:
    """Return the row of one file, solved in this process."""
    from fesd_robot.mpcc import Run
    from fesd_robot.mpcc.attempts import solve_by_attempts
    from fesd_robot.mpcc.sources import read_casadi_json
    from fesd_robot.running import Deadline

    begin, cpu = time.perf_counter(), time.process_time()
    problem = read_casadi_json(file)
    found = solve_by_attempts(problem, Run(deadline=Deadline(given.seconds)), further=given.further)
    took, cpu_took = time.perf_counter() - begin, time.process_time() - cpu
    solution, certificate, conflict = found.solution, found.certificate, found.conflict
    residuals = problem.residuals(solution.w)
    if given.points:
        given.points.mkdir(parents=True, exist_ok=True)
        np.save(given.points / f"{name_of(file)}.npy", solution.w)
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


def commit() -> str:
    """Return the commit of the checkout, with + where the package differs from it."""
    git = ["git", "-C", str(ROOT)]
    last = subprocess.run(
        [*git, "log", "-1", "--format=%h"], capture_output=True, text=True, check=False
    ).stdout.strip()
    status = [*git, "status", "--porcelain", "fesd_robot"]
    return last + ("+" if subprocess.run(status, capture_output=True, text=True, check=False).stdout else "")


def row_of(file: Path, given: argparse.Namespace) -> dict[str, Any]:
    """Return the row of one file, solved in a process of its own that is ended where it takes too long."""
    words = [
        str(file),
        "--one",
        "--seconds",
        str(given.seconds),
        "--suite",
        given.suite,
        "--further",
        str(given.further),
    ]
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
    parser.add_argument("--further", type=int, default=0, help="homotopies after a solution, for a cheaper one")
    parser.add_argument("--memory", type=float, default=6.0, help="GB of address space of a process")
    parser.add_argument("--rows", type=Path, default=ROOT / "docs/results/mpcc_suites.jsonl")
    parser.add_argument("--points", type=Path)
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        print(json.dumps(solved_row(given.folder, given)))
        return
    rows = [json.loads(line) for line in given.rows.read_text().splitlines()] if given.rows.exists() else []
    done = {row["name"] for row in rows if row["suite"] == given.suite and (row["solved"] or not given.again)}
    files = sorted(given.folder.glob("*.json"), key=lambda file: file.stat().st_size)
    wanted = set(given.names.read_text().split()) if given.names else {name_of(file) for file in files}
    made = {"limit": given.seconds, "further": given.further, "machine": machine(), "commit": commit()}
    for file in files:
        name = name_of(file)
        if name in done or name not in wanted or not re.search(given.only, name):
            continue
        row = {"suite": given.suite, "name": name, "family": family_of(name), **row_of(file, given), **made}
        with given.rows.open("a", encoding="utf-8") as out:
            out.write(json.dumps(row) + "\n")
        print(
            *(row.get(key, "") for key in ("name", "solved", "objective", "status", "b_stationary", "seconds")),
            flush=True,
        )


if __name__ == "__main__":
    main()
