"""The linear solver on KKT systems of real solves: backward error, inertia, time of a factorization.

While IPOPT solves the relaxed problems of the shipped tasks, and of the same with few intervals, a variant of the
library writes some of the systems to disk; a sample over all phases of the solves is factorized again here. The table
goes to docs/results/kkt.md.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from scipy import sparse

from fesd_robot import load_task
from fesd_robot.fesd import Transcription
from fesd_robot.mpcc import Run, solve
from fesd_robot.native import kkt_library
from fesd_robot.native.linear_solver import KktSystem, build_library
from fesd_robot.nlp import our_linear_solver
from fesd_robot.ocp import formulate
from fesd_robot.ocp.solver_options import homotopy_options
from fesd_robot.running.deadline import Deadline

ROOT = Path(__file__).parents[2]
SHORT: dict[str, list[str] | None] = {
    "published_hopper_five_jumps": ["horizon.intervals=3", "reference={type: line}"],
    "pusher_slider": ["horizon.intervals=4"],
    "solo12_jump": None,  # its waypoints need all intervals
}
"""What makes a task small enough for dense eigenvalues, if not three intervals."""
DENSE = 1500
"""Up to this order the inertia is checked by all eigenvalues, above by pivots chosen for stability alone."""


TIME_LIMIT = 40.0
"""Seconds for the solve that systems are taken from."""


@dataclass(frozen=True)
class Dumped:
    """A KKT system as IPOPT passed it, indices from 0."""

    order: int
    row: np.ndarray
    column: np.ndarray
    value: np.ndarray
    threshold: float

    @classmethod
    def read(cls, file: Path) -> Dumped:
        """Read what the library wrote."""
        with file.open("rb") as stream:
            order, entries = np.fromfile(stream, np.int32, 2)
            row, column = np.fromfile(stream, np.int32, entries), np.fromfile(stream, np.int32, entries)
            value, threshold = np.fromfile(stream, float, entries), np.fromfile(stream, float, 1)
        return cls(int(order), row - 1, column - 1, value, float(threshold[0]))

    @property
    def matrix(self) -> sparse.csr_matrix:
        """A, both triangles."""
        off = self.row != self.column
        row, column = np.append(self.row, self.column[off]), np.append(self.column, self.row[off])
        values = np.append(self.value, self.value[off])
        return sparse.coo_matrix((values, (row, column)), shape=(self.order, self.order)).tocsr()


def dump(name: str, overrides: list[str], folder: Path, iterations: int, every: int) -> None:
    """Solve a task with the variant that writes one of `every` systems to a folder."""
    library = build_library("kkt-dump", ["-DKKT_DUMP"])
    task = load_task(ROOT / "tasks" / f"{name}.yaml", overrides)
    motion = formulate(task)
    chosen = our_linear_solver(library)
    options = replace(homotopy_options(task), linear_solver="ma27", ipopt=chosen, max_iterations=iterations)
    os.environ |= {"KKT_FOLDER": str(folder), "KKT_EVERY": str(every)}
    solve(Transcription(motion.ocp, motion.fesd).problem, Run(options, Deadline(TIME_LIMIT)))


@dataclass(frozen=True)
class Checked:
    """What one system showed: backward errors, whether inertia and the verdict of a stopped factorization are right."""

    first: float
    refined: float
    inertia: bool
    verdict: bool
    stopped: bool
    seconds: float


def check(system: Dumped, library: Path, early: KktSystem) -> Checked:
    """Factorize a system and solve with it; `early` has seen the systems before it and may stop early."""
    ours = KktSystem(system.row, system.column, system.order, library)
    for _ in range(2):  # the first shows which columns are delayed, the second places them
        ours.factorize(system.value, system.threshold)
    begin = time.process_time()
    rank, negative = ours.factorize(system.value, system.threshold)
    seconds = time.process_time() - begin
    matrix = system.matrix
    size, right = abs(matrix), np.random.default_rng(0).normal(size=system.order)

    def error(x: np.ndarray) -> float:
        return float((np.abs(right - matrix @ x) / (size @ np.abs(x) + np.abs(right))).max())

    x = ours.solve(right)
    first = error(x)
    for _ in range(5):
        x = x + ours.solve(right - matrix @ x)
    if system.order <= DENSE:
        scale = 1 / np.sqrt(np.maximum(size.max(axis=1).toarray().ravel(), 1e-300))
        expected = int((np.linalg.eigvalsh(scale[:, None] * matrix.toarray() * scale) < 0).sum())
    else:
        _, expected = KktSystem(system.row, system.column, system.order, library).factorize(system.value, 0.5)
    constraints = count_constraints(system)
    _, reported = early.factorize(system.value, system.threshold, stop_early=True)
    if reported == constraints:
        early.solve(right)
    return Checked(
        first=first,
        refined=error(x),
        inertia=rank == system.order and negative == expected,
        verdict=reported == negative or (reported == constraints + 1 and negative > constraints),
        stopped=reported != negative,
        seconds=seconds,
    )


def count_constraints(system: Dumped) -> int:
    """Return the number of rows at the end of a system that are not coupled among themselves: the constraints."""
    off = system.row != system.column
    low, high = (function(system.row, system.column)[off] for function in (np.minimum, np.maximum))
    coupled = np.full(system.order, -1)
    np.maximum.at(coupled, low, high)
    return int(np.argmax(coupled[::-1] >= 0))


def main() -> int:
    """Dump, check, write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--systems", type=int, default=200, help="systems checked in all")
    parser.add_argument("--iterations", type=int, default=40, help="IPOPT iterations of each NLP")
    parser.add_argument("--tasks", nargs="+", default=sorted(file.stem for file in (ROOT / "tasks").glob("*.yaml")))
    parser.add_argument("--page", type=Path, default=ROOT / "docs" / "results" / "kkt.md")
    arguments = parser.parse_args()
    library = kkt_library()
    if library is None:
        print("the linear solver could not be compiled")
        return 1
    lines = ["# The linear solver on KKT systems of real solves", ""]
    lines += [
        f"Made by `python scripts/tools/check_kkt.py --systems {arguments.systems}`, Python "
        f"{platform.python_version()}, "
        f"casadi {version('casadi')}. Backward error: largest |b - A x| / (|A| |x| + |b|) of any row, with up to five "
        "steps of refinement (IPOPT makes up to ten). Inertia: compared with all eigenvalues up to order "
        f"{DENSE}, and with a factorization whose pivots are chosen for stability alone (threshold 0.5) above. "
        "Stopped: factorizations that ended early because of a wrong inertia. Verdict: for how many of all systems the "
        "answer on the inertia was right.",
        "",
        "| task | intervals | order | systems | factorization [ms] | worst error | refined: median | worst | inertia "
        "| stopped | verdict |",
        "| :-- | :-- | --: | --: | --: | --: | --: | --: | --: | --: | --: |",
    ]
    failed = total = 0
    cases = [(name, SHORT.get(name, ["horizon.intervals=3"])) for name in arguments.tasks]
    both = [(name, small) for name, small in cases if small] + [(name, list[str]()) for name, _ in cases]
    for name, overrides in sorted(both):
        with tempfile.TemporaryDirectory() as folder:
            dump(name, overrides, Path(folder), arguments.iterations, 7)
            files = sorted(Path(folder).glob("*.kkt"))
            count = min(len(files), -(-arguments.systems // len(both)))
            chosen = [files[i] for i in np.linspace(0, len(files) - 1, count).astype(int)]
            systems = [Dumped.read(file) for file in chosen]
        early = KktSystem(systems[0].row, systems[0].column, systems[0].order, library)
        results = [check(system, library, early) for system in systems]
        wrong = [one for one in results if not (one.inertia and one.verdict and one.refined <= 1e-10)]
        failed, total = failed + len(wrong), total + len(results)
        lines.append(
            f"| {name} | {'few' if overrides else 'all'} | {systems[0].order} | {len(systems)} | "
            f"{1e3 * np.median([one.seconds for one in results]):.2f} | {max(one.first for one in results):.1e} | "
            f"{np.median([one.refined for one in results]):.1e} | {max(one.refined for one in results):.1e} | "
            f"{sum(one.inertia for one in results)} agree | {sum(one.stopped for one in results)} | "
            f"{sum(one.verdict for one in results)} right |"
        )
        print(lines[-1], flush=True)
    lines += ["", f"{total} systems, {total - failed} of them without a fault."]
    arguments.page.write_text("\n".join([*lines, ""]))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
