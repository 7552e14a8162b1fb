"""Run IMPACT on its own planar tasks, and the MPCC solver here on the same problems, for the page of public tasks.

    git clone https://github.com/JonasPflaume/IMPACT
    git -C IMPACT checkout f56f1403659122bd4017ed36b21d83a490bc6687
    cmake -S IMPACT -B IMPACT/build -DCMAKE_BUILD_TYPE=Release -DIMPACT_BUILD_ALLEGRO=OFF
    cmake --build IMPACT/build
    python scripts/benchmarks/compare_impact.py IMPACT/build/experiments
    python scripts/benchmarks/compare_impact.py IMPACT/build/experiments impact_box

Writes docs/results/public_tasks_impact.json, and draws docs/results/public_tasks.md anew. IMPACT needs CasADi 3.7,
Eigen and OpenBLAS. With CasADi from its Python wheel, in the folder CASADI, cmake needs these words, too:

    -DCMAKE_PREFIX_PATH=CASADI/cmake -DCMAKE_CXX_FLAGS="-ICASADI/include -D_GLIBCXX_USE_CXX11_ABI=0"
    -DCMAKE_SHARED_LINKER_FLAGS=-LCASADI -DCMAKE_EXE_LINKER_FLAGS="-LCASADI -Wl,-rpath,CASADI"

Its settings are those of its programs. Everything runs three times, in processes of their own with one thread; medians
count. IMPACT has to print the objective that the equations here give for its motion.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from scripts.benchmarks import _impact_page
from scripts.benchmarks._impact import PROBLEMS, Judged, Problem
from scripts.tools.arguments import machine

REPEATS = 3
PRINTED = 1e-3
"""Of an objective, by which four printed digits may differ from it."""

Numbers = dict[str, Any]


def motion_in(text: str) -> tuple[np.ndarray, np.ndarray]:
    """Return states (steps + 1, n) and controls (steps, m) of one of IMPACT's files."""

    def rows(title: str) -> np.ndarray:
        lines = text.partition(f"# {title}")[2].split("\n#")[0].splitlines()[1:]
        return np.array([[float(word) for word in line.split()] for line in lines if line.strip()])

    return rows("State Trajectory"), rows("Control Trajectory")


def by_impact(problem: Problem, folder: Path) -> tuple[Numbers, tuple[np.ndarray, np.ndarray]]:
    """Return what IMPACT's program makes of its problem, and its motion.

    Args:
        problem: one of `PROBLEMS`.
        folder: `experiments` of IMPACT's build.
    """
    with tempfile.TemporaryDirectory() as own:
        file = Path(own) / "motion.txt"
        command = [str(folder / problem.program), *problem.words.split(), str(file)]
        begin = time.perf_counter()
        printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        whole, motion = time.perf_counter() - begin, motion_in(file.read_text(encoding="utf-8"))

    def number(label: str) -> float:
        found = re.search(rf"{label}: (\S+)", printed)
        if found is None:
            raise SystemExit(f"{problem.program}: found no line '{label}' in what it prints")
        return float(found.group(1))

    judged, objective = problem.judged(*motion), number("Objective value")
    if abs(judged.objective - objective) > PRINTED * objective:
        raise SystemExit(f"{problem.program}: printed the objective {objective:g}, expected {judged.objective:g}")
    return {
        "solved": "Converged: YES" in printed,
        **_numbers(judged),
        "solve_seconds": number("Solve time"),
        "seconds": whole,
        "iterations": int(number("Total inner iterations")),
    }, motion


def here(problem: Problem, begin: tuple[np.ndarray, np.ndarray] | None = None) -> Numbers:
    """Return what the MPCC solver makes of a problem in this process, from the peer's guess or another motion."""
    mpcc, started = problem.mpcc(), time.perf_counter()
    found, judged = problem.solved(mpcc, begin)
    return {
        "solved": found.solution.exact,
        **_numbers(judged),
        "solve_seconds": time.perf_counter() - started,
        "iterations": found.solution.iterations,
        "b_stationary": found.certificate.b_stationary if found.certificate else "",
        "attempt": found.attempt,
    }


def _numbers(judged: Judged) -> Numbers:
    return {**asdict(judged), "missed": float(np.linalg.norm(judged.missed))}


def here_apart(name: str) -> Numbers:
    """Return what `here` makes of the peer's guess in a process of its own, and how many seconds all of it took."""
    begin = time.perf_counter()
    command = [sys.executable, "-m", "scripts.benchmarks.compare_impact", "--one", name]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return {**json.loads(done.stdout.splitlines()[-1]), "seconds": time.perf_counter() - begin}


def median(answers: Sequence[Numbers]) -> Numbers:
    """Return the first of some answers, with the medians of all times."""
    times = {key: statistics.median(one[key] for one in answers) for key in ("solve_seconds", "seconds")}
    return {**answers[0], **times}


def measured(name: str, folder: Path) -> Mapping[str, Numbers]:
    """Return what a problem's tools make of it: tool -> numbers."""
    problem = PROBLEMS[name]
    answers = [by_impact(problem, folder) for _ in range(REPEATS)]
    return {
        "impact": median([numbers for numbers, _ in answers]),
        "mpcc": median([here_apart(name) for _ in range(REPEATS)]),
        "mpcc_from_impact": here(problem, answers[0][1]),
    }


def parse(words: Sequence[str] | None) -> argparse.Namespace:
    """Return the command line's options."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("experiments", type=Path, nargs="?", help="that folder of IMPACT's build")
    parser.add_argument("names", nargs="*", metavar="CASE", help="default: all")
    parser.add_argument("--one", choices=list(PROBLEMS), help="print what the MPCC solver makes of this, nothing more")
    given = parser.parse_args(words)
    if unknown := sorted(set(given.names) - set(PROBLEMS)):
        parser.error(f"argument CASE: found '{unknown[0]}', expected one of {', '.join(PROBLEMS)}")
    if given.one is None and (given.experiments is None or not given.experiments.is_dir()):
        parser.error(f"argument experiments: there is no folder {given.experiments}")
    return given


def main(words: Sequence[str] | None = None) -> None:
    """Run what the command line says."""
    given = parse(words)
    if given.one:
        print(json.dumps(here(PROBLEMS[given.one])))
        return
    from scripts.benchmarks.public_tasks import TABLE

    asked = ["git", "-C", str(given.experiments), "rev-parse", "HEAD"]
    commit = subprocess.run(asked, capture_output=True, text=True, check=True).stdout.strip()
    for name in given.names or PROBLEMS:
        print(name, file=sys.stderr, flush=True)
        about = {"commit": commit, "machine": machine(), "load": os.getloadavg()[0]}
        _impact_page.put(name, {**about, **measured(name, given.experiments)})
    TABLE.draw()


if __name__ == "__main__":
    main()
