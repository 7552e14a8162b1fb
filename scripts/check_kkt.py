"""The linear solver on KKT systems of real solves: backward error, inertia, time of a factorization.

Every system that IPOPT factorizes while it plans the shipped tasks is written to disk by a variant of the library; of
these a sample over all phases of the solves is factorized again here. The table goes to docs/results/kkt.md.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import casadi
import numpy as np
from scipy import sparse

from fesd_robot import load_task
from fesd_robot.fesd import Transcription
from fesd_robot.mpcc import solve
from fesd_robot.native import kkt_library, shared_library
from fesd_robot.native.linear_solver import FLAGS, SOURCES, KktSystem, instruction_set
from fesd_robot.ocp import formulate
from fesd_robot.planner import homotopy_options

ROOT = Path(__file__).parent.parent
TASKS = {
    "two intervals": ("hopper_one_jump", ["horizon.duration=0.2", "horizon.intervals=2", "reference={type: line}"]),
    "one jump": ("hopper_one_jump", []),
    "five jumps": ("hopper_five_jumps", []),
}
DENSE = 1500
"""Up to this order the inertia is checked by all eigenvalues, above by pivots chosen for stability alone."""


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


def dump(name: str, overrides: list[str], folder: Path, iterations: int) -> None:
    """Solve a task with the variant that writes every system to a folder."""
    eigen = Path(casadi.__file__).parent / "include" / "eigen3"
    flags = [*FLAGS, instruction_set(), f"-I{eigen}", f'-DKKT_DUMP="{folder}"']
    library = shared_library("kkt-dump", sorted(SOURCES.glob("*.cpp")), flags, headers=sorted(SOURCES.glob("*.hpp")))
    task = load_task(ROOT / "tasks" / f"{name}.yaml", overrides)
    motion = formulate(task)
    chosen = {"hsllib": str(library), "linear_system_scaling": "none"}
    options = replace(homotopy_options(task), linear_solver="ma27", ipopt=chosen, max_iterations=iterations)
    solve(Transcription(motion.ocp, motion.fesd).problem, options)
    library.unlink()


def check(system: Dumped, library: Path) -> tuple[float, float, bool, float]:
    """Return backward errors without and with refinement, whether the inertia agrees, seconds of a factorization."""
    ours = KktSystem(system.row, system.column, system.order, library)
    ours.factorize(system.value, system.threshold)
    begin = time.perf_counter()
    rank, negative = ours.factorize(system.value, system.threshold)
    seconds = time.perf_counter() - begin
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
    return first, error(x), rank == system.order and negative == expected, seconds


def main() -> int:
    """Dump, check, write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--systems", type=int, default=200, help="systems checked in all")
    parser.add_argument("--iterations", type=int, default=60, help="IPOPT iterations of each NLP")
    parser.add_argument("--page", type=Path, default=ROOT / "docs" / "results" / "kkt.md")
    arguments = parser.parse_args()
    library = kkt_library()
    if library is None:
        print("the linear solver could not be compiled")
        return 1
    lines = ["# The linear solver on KKT systems of real solves", ""]
    lines += [
        f"Made by `python scripts/check_kkt.py --systems {arguments.systems}`, Python {platform.python_version()}, "
        f"casadi {casadi.__version__}. Backward error: largest |b - A x| / (|A| |x| + |b|) of any row, with up to five "
        "steps of refinement (IPOPT makes up to ten). Inertia: against all eigenvalues up to order "
        f"{DENSE}, above against a factorization with pivots chosen for stability alone (threshold 0.5).",
        "",
        "| task | order | systems | factorization [ms] | worst error | refined: median | 95 % | worst | inertia |",
        "| :-- | --: | --: | --: | --: | --: | --: | --: | --: |",
    ]
    failed = 0
    for label, (name, overrides) in TASKS.items():
        with tempfile.TemporaryDirectory() as folder:
            dump(name, overrides, Path(folder), arguments.iterations)
            files = sorted(Path(folder).glob("*.kkt"))
            count = min(len(files), arguments.systems // len(TASKS) + 1)
            chosen = [files[i] for i in np.linspace(0, len(files) - 1, count).astype(int)]
            systems = [Dumped.read(file) for file in chosen]
        results = [check(system, library) for system in systems]
        first, refined, agrees, seconds = (np.array(part) for part in zip(*results, strict=True))
        failed += int((~agrees).sum()) + int((refined > 1e-10).sum())
        lines.append(
            f"| {label} | {systems[0].order} | {len(systems)} | {1e3 * np.median(seconds):.2f} | {first.max():.1e} | "
            f"{np.median(refined):.1e} | {np.quantile(refined, 0.95):.1e} | {refined.max():.1e} | "
            f"{agrees.sum()} of {len(systems)} agree |"
        )
        print(lines[-1], flush=True)
    arguments.page.write_text("\n".join([*lines, ""]))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
