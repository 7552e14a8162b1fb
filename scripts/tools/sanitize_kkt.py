"""The linear solver under the address and undefined-behaviour sanitizers, on systems of every kind.

Random systems (definite, indefinite, singular, empty rows, not finite, optimality systems that stop early) and, if
given, files that check_kkt.py's variant of the library wrote. Exit code 1 if a sanitizer finds anything.
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from fesd_robot.native.linear_solver import KktSystem, build_library

SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer", "-g")


def random_matrix(generator: np.random.Generator) -> np.ndarray:
    """A symmetric matrix with a constraint block, of random size, sparsity, scaling, curvature and rank."""
    n, m = int(generator.integers(1, 60)), int(generator.integers(0, 40))
    dense = generator.normal(size=(n, n)) * (generator.uniform(size=(n, n)) < generator.choice([0.02, 0.1, 1.0]))
    jacobian = generator.normal(size=(m, n)) * (generator.uniform(size=(m, n)) < generator.choice([0.05, 0.3]))
    hessian = dense @ dense.T + generator.choice([-1.0, 0.0, 1e-8, 1.0]) * np.eye(n)
    corner = generator.choice([0.0, 1e-8, 1.0]) * np.eye(m)
    scale = 10.0 ** generator.uniform(-1, 1, n + m) ** generator.choice([0, 1, 9])
    return scale[:, None] * np.block([[hessian, jacobian.T], [jacobian, -corner]]) * scale


def exercise(library: Path, rounds: int, files: list[Path]) -> None:
    """Factorize and solve."""
    from scripts.tools.check_kkt import Dumped

    for seed in range(rounds):
        generator = np.random.default_rng(seed)
        matrix = random_matrix(generator)
        row, column = np.nonzero(np.tril(matrix))
        system, values = KktSystem(row, column, len(matrix), library), matrix[row, column]
        for trial in range(6):
            threshold = float(generator.choice([1e-8, 1e-4, 0.5]))
            system.factorize(values, threshold, stop_early=bool(trial % 2))
            system.solve(generator.normal(size=len(matrix)))
            values = values + generator.normal(size=len(values)) * (generator.uniform(size=len(values)) < 0.1)
            if trial == 4:
                values = np.where(
                    generator.uniform(size=len(values)) < 0.05, generator.choice([np.nan, np.inf, 0]), values
                )
    for file in files:
        dumped = Dumped.read(file)
        system = KktSystem(dumped.row, dumped.column, dumped.order, library)
        for stop_early in (False, False, True):
            system.factorize(dumped.value, dumped.threshold, stop_early=stop_early)
            system.solve(np.ones(dumped.order))


def main() -> int:
    """Run this script again with the sanitizers' run-time library loaded first."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=300)
    parser.add_argument("--dumps", type=Path, help="folder with systems of real solves")
    arguments = parser.parse_args()
    if platform.system() != "Linux":
        parser.error("needs Linux and GCC, whose sanitizer can be loaded before Python")
    library = build_library("kkt-sanitized", SANITIZERS)
    if os.environ.get("KKT_SANITIZED"):
        exercise(library, arguments.rounds, sorted(arguments.dumps.glob("*.kkt")) if arguments.dumps else [])
        return 0
    runtime = [
        subprocess.run(["g++", f"-print-file-name={name}"], capture_output=True, text=True, check=True).stdout.strip()
        for name in ("libasan.so", "libubsan.so", "libstdc++.so")
    ]
    environment = os.environ | {
        "LD_PRELOAD": ":".join(runtime),
        "ASAN_OPTIONS": "detect_leaks=0",  # Python's own
        "KKT_SANITIZED": "1",
    }
    done = subprocess.run([sys.executable, *sys.argv], env=environment, check=False)
    print("nothing found" if done.returncode == 0 else f"failed with exit code {done.returncode}")
    return 1 if done.returncode else 0


if __name__ == "__main__":
    sys.exit(main())
