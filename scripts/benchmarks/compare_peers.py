"""Run IMPACT and CRISP on their own tasks, and the MPCC solver on the same problems, for the page of public tasks.

    python scripts/benchmarks/compare_peers.py impact IMPACT/build/experiments
    python scripts/benchmarks/compare_peers.py crisp CRISP/run "crisp_push_box, 0 degrees"

Writes docs/results/public_tasks_{impact,crisp}.json, and draws docs/results/public_tasks.md anew. Peers run at the
settings of their own files, three times, the MPCC solver once; all in processes of their own with one thread. What a
peer prints as its objective has to be that which the equations here give for its motion.

IMPACT needs CasADi 3.7, Eigen and OpenBLAS:

    git clone https://github.com/JonasPflaume/IMPACT
    git -C IMPACT checkout f56f1403659122bd4017ed36b21d83a490bc6687
    cmake -S IMPACT -B IMPACT/build -DCMAKE_BUILD_TYPE=Release -DIMPACT_BUILD_ALLEGRO=OFF
    cmake --build IMPACT/build

With CasADi from its Python wheel, in the folder CASADI, cmake needs these words, too:

    -DCMAKE_PREFIX_PATH=CASADI/cmake -DCMAKE_CXX_FLAGS="-ICASADI/include -D_GLIBCXX_USE_CXX11_ABI=0"
    -DCMAKE_SHARED_LINKER_FLAGS=-LCASADI -DCMAKE_EXE_LINKER_FLAGS="-LCASADI -Wl,-rpath,CASADI"

CRISP needs CppAD, CppADCodeGen, PIQP 0.5.0, Eigen, Boost and yaml-cpp, where the compiler finds their headers.
`compare/crisp_instances.cpp` stands for the main functions of its example files, which solve one instance each; CRISP
compiles functions of its own when a program runs for the first time, into the folder `model` beside it:

    git clone https://github.com/ComputationalRobotics/CRISP
    git -C CRISP checkout 9199a78e9e6f6b82b2f5ef780a7bd037076960d1
    mkdir CRISP/run
    for TASK in TRANSPORT PUSH_BOX PUSH_T
    do g++ -std=c++14 -O3 -march=native -DNDEBUG -D$TASK -ICRISP/src -ICRISP/src/core/include -I/usr/include/eigen3
       scripts/benchmarks/compare/crisp_instances.cpp CRISP/src/core/src/cppad_core/CppAdInterface.cpp
       -o CRISP/run/crisp_${TASK,,} -lboost_filesystem -lboost_system -lyaml-cpp -ldl
    done
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
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from scripts.benchmarks import _crisp, _impact, _peer_page
from scripts.benchmarks._peer_problems import Judged, Motion, Problem
from scripts.tools.arguments import machine

REPEATS = 3
PRINTED = 1e-3
"""Of an objective, by which four printed digits may differ from it."""

Numbers = dict[str, Any]


@dataclass(frozen=True)
class Peer:
    """A peer's programs.

    Attributes:
        problems: case -> its problem.
        command: (words, file) -> arguments of a program, whose motion goes into the file.
        motion: (problem, text of that file) -> the motion.
        prints: what precedes numbers that it prints: objective, iterations, and the time of a solve.
        unit: of that time, s.
        converged: what it prints if it has.
    """

    problems: Mapping[str, Problem]
    command: Callable[[Sequence[str], str], Sequence[str]]
    motion: Callable[[Problem, str], Motion]
    prints: Mapping[str, str]
    unit: float
    converged: str


def impact_motion(problem: Problem, text: str) -> Motion:
    """Return the motion in one of IMPACT's files."""

    def rows(title: str) -> np.ndarray:
        lines = text.partition(f"# {title}")[2].split("\n#")[0].splitlines()[1:]
        return np.array([[float(word) for word in line.split()] for line in lines if line.strip()])

    return rows("State Trajectory"), rows("Control Trajectory")


def crisp_motion(problem: Problem, text: str) -> Motion:
    """Return the motion in all variables of CRISP, step by step; places on lines and slips precede forces there.

    Its T has an angle of which sine and cosine alone are given at the start: it counts from there.
    """
    values = np.array(text.split(), float).reshape(problem.steps + 1, -1)
    states, controls = np.split(values, [len(problem.start)], axis=1)
    states[:, -1] -= TURN * np.round((states[0, -1] - problem.start[-1]) / TURN) * (problem.program == "crisp_push_t")
    return states, controls[:-1, CRISP_CONTROLS.get(problem.program, slice(None))]


TURN = 2 * np.pi

CRISP_CONTROLS: Mapping[str, list[int]] = {
    "crisp_transport": [2, 3, 0, 1],
    "crisp_push_t": [0, 1, *range(16, 24), *range(2, 16, 2), *range(3, 16, 2)],
}
"""Where the controls of a problem here are among the variables of a step of CRISP, after the states."""

PEERS: Mapping[str, Peer] = {
    "impact": Peer(
        problems=_impact.PROBLEMS,
        command=lambda words, file: [*words, file],
        motion=impact_motion,
        prints={
            "objective": r"Objective value: (\S+)",
            "iterations": r"Total inner iterations: (\d+)",
            "solve_seconds": r"Solve time: (\S+)",
        },
        unit=1.0,
        converged="Converged: YES",
    ),
    "crisp": Peer(
        problems=_crisp.PROBLEMS,
        command=lambda words, file: [file, *words],
        motion=crisp_motion,
        prints={
            "objective": r"obj from \S+ to (\S+)",
            "iterations": r"solved in (\d+) iterations",
            "solve_seconds": r"Solver time: (\S+)ms",
        },
        unit=1e-3,
        converged="Optimization converged.",
    ),
}


def by_peer(peer: Peer, problem: Problem, folder: Path) -> tuple[Numbers, Motion]:
    """Return what a peer's program makes of its problem, and its motion.

    Args:
        peer: one of `PEERS`.
        problem: one of its problems.
        folder: of its programs, in which they run.
    """
    with tempfile.TemporaryDirectory() as own:
        file = Path(own) / "motion.txt"
        command = [str((folder / problem.program).resolve()), *peer.command(problem.words, str(file))]
        begin = time.perf_counter()
        printed = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout
        whole, motion = time.perf_counter() - begin, peer.motion(problem, file.read_text(encoding="utf-8"))

    def number(key: str) -> float:
        found = re.search(peer.prints[key], printed)
        if found is None:
            raise SystemExit(f"{problem.program}: found no line '{peer.prints[key]}' in what it prints")
        return float(found.group(1))

    judged, objective = problem.judged(*motion), number("objective")
    if abs(judged.objective - objective) > PRINTED * objective:
        raise SystemExit(f"{problem.program}: printed the objective {objective:g}, expected {judged.objective:g}")
    return {
        "solved": peer.converged in printed,
        **_numbers(judged),
        "solve_seconds": number("solve_seconds") * peer.unit,
        "seconds": whole,
        "iterations": int(number("iterations")),
    }, motion


def here(problem: Problem, begin: Motion | None = None) -> Numbers:
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


def here_apart(name: str, case: str) -> Numbers:
    """Return what `here` makes of a peer's guess in a process of its own, and how many seconds all of it took."""
    begin = time.perf_counter()
    command = [sys.executable, "-m", "scripts.benchmarks.compare_peers", name, "--one", case]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return {**json.loads(done.stdout.splitlines()[-1]), "seconds": time.perf_counter() - begin}


def measured(name: str, case: str, folder: Path) -> Mapping[str, Numbers]:
    """Return what comes of a problem: tool -> numbers; times of the peer are medians."""
    peer = PEERS[name]
    answers = [by_peer(peer, peer.problems[case], folder) for _ in range(1 + REPEATS)][1:]  # the first one may compile
    times = {key: statistics.median(numbers[key] for numbers, _ in answers) for key in ("solve_seconds", "seconds")}
    return {
        "peer": {**answers[0][0], **times},
        "mpcc": here_apart(name, case),
        "mpcc_from_peer": here(peer.problems[case], answers[0][1]),
    }


def parse(words: Sequence[str] | None) -> argparse.Namespace:
    """Return the command line's options."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("peer", choices=list(PEERS))
    parser.add_argument("folder", type=Path, nargs="?", help="of its programs, as the first lines of this file make it")
    parser.add_argument("cases", nargs="*", metavar="CASE", help="default: all")
    parser.add_argument("--one", metavar="CASE", help="print what the MPCC solver makes of this, nothing more")
    given = parser.parse_args(words)
    known = PEERS[given.peer].problems
    for case in [*given.cases, *([given.one] if given.one else [])]:
        if case not in known:
            parser.error(f"argument CASE: found '{case}', expected one of {'; '.join(known)}")
    if given.one is None and (given.folder is None or not given.folder.is_dir()):
        parser.error(f"argument folder: there is no folder {given.folder}")
    return given


def main(words: Sequence[str] | None = None) -> None:
    """Run what the command line says."""
    given = parse(words)
    if given.one:
        print(json.dumps(here(PEERS[given.peer].problems[given.one])))
        return
    from scripts.benchmarks.public_tasks import TABLE

    asked = ["git", "-C", str(given.folder), "rev-parse", "HEAD"]
    commit = subprocess.run(asked, capture_output=True, text=True, check=True).stdout.strip()
    for case in given.cases or PEERS[given.peer].problems:
        print(case, file=sys.stderr, flush=True)
        about = {"commit": commit, "machine": machine(), "load": os.getloadavg()[0]}
        _peer_page.put(given.peer, case, {**about, **measured(given.peer, case, given.folder)})
    TABLE.draw()


if __name__ == "__main__":
    main()
