"""Random piecewise linear systems, simulated with default settings and by an event-driven integrator.

500 systems x' = A_s x + b_s with 2 to 6 states and 1 to 4 switching functions, regions s by their signs; every second
one is a sum of independent relays in the form of Stewart, the others have a field for every vector of signs and step
functions. The reference is SciPy's DOP853 at 1e-12 with events, on modes that are written here with NumPy alone.

    python scripts/results/random_piecewise_linear.py            # writes docs/results/random_piecewise_linear.md
    python scripts/results/random_piecewise_linear.py --seeds 0 50
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

from fesd_robot.dcs import ComplementaritySystem, Model, Subsystem, heaviside_from_regions, stewart
from fesd_robot.fesd import SimulationError, simulate

SYSTEMS = 500
DURATION = 3.0
RTOL = 1e-6
"""The default of `simulate`."""
REPORT = Path(__file__).resolve().parents[2] / "docs" / "results" / "random_piecewise_linear.md"


@dataclass(frozen=True)
class RandomSystem:
    """Normals and offsets of the switching functions, and a linear field for every vector of signs.

    Attributes:
        normals, offsets: c(x) = normals x - offsets.
        A, b: (2, ..., 2, n, n) and (2, ..., 2, n) by signs, 0 for negative; of a sum (k, 2, n, n) and (k, 2, n).
        additive: whether the fields of the switching functions are added.
        start: x(0).
    """

    normals: np.ndarray
    offsets: np.ndarray
    A: np.ndarray
    b: np.ndarray
    additive: bool
    start: np.ndarray

    @classmethod
    def of(cls, seed: int) -> RandomSystem:
        """Return the system of a seed."""
        rng = np.random.default_rng(seed)
        n, k = int(rng.integers(2, 7)), int(rng.integers(1, 5))
        normals = rng.normal(size=(k, n))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        additive = seed % 2 == 0
        shape = (k, 2) if additive else (2,) * k
        share = k if additive else 1
        A = (rng.normal(size=(*shape, n, n)) / np.sqrt(n) - 0.3 * np.eye(n)) / share
        b = rng.normal(size=(*shape, n)) / np.sqrt(share)
        return cls(normals, 0.3 * rng.normal(size=k), A, b, additive, rng.normal(size=n))

    def field(self, x: np.ndarray, alpha: np.ndarray) -> np.ndarray:
        """x' for the values alpha of the steps, which multiply the fields."""
        value = self.A @ x + self.b
        if self.additive:
            return np.einsum("ks,ksn->n", np.column_stack([1 - alpha, alpha]), value)
        for step in alpha:
            value = (1 - step) * value[0] + step * value[1]
        return value

    def system(self) -> ComplementaritySystem:
        """The same for `simulate`."""
        k, n = self.normals.shape
        x = ca.SX.sym("x", n)
        c = ca.mtimes(ca.DM(self.normals), x) - ca.DM(self.offsets)
        if self.additive:
            subsystems = [
                Subsystem(
                    fields=ca.horzcat(*[ca.mtimes(ca.DM(self.A[i, s]), x) + ca.DM(self.b[i, s]) for s in (0, 1)]),
                    switching=c[i],
                    sign_matrix=np.array([[-1], [1]]),
                    name=f"relay {i + 1}",
                )
                for i in range(k)
            ]
            return stewart(Model(x), subsystems)
        signs = list(product((0, 1), repeat=k))
        fields = ca.horzcat(*[ca.mtimes(ca.DM(self.A[s]), x) + ca.DM(self.b[s]) for s in signs])
        return heaviside_from_regions(
            Model(x), Subsystem(fields=fields, switching=c, sign_matrix=2 * np.array(signs) - 1)
        )


Mode = tuple[int | None, ...]
"""0 or 1 for the side of every switching function, None where it is slid on."""


@dataclass(frozen=True)
class Event:
    """An event of `solve_ivp`: a value that falls to zero ends the integration."""

    value: Callable[[float, np.ndarray], float]
    terminal: bool = True
    direction: int = -1

    def __call__(self, time: float, y: np.ndarray) -> float:
        """Return the value."""
        return self.value(time, y)


class NotUnique(Exception):
    """Several motions go on from a point."""


class Reference:
    """Event-driven integration; a mode is a value 0, 1 or None (sliding) for every switching function."""

    def __init__(self, system: RandomSystem) -> None:
        self.system = system

    def steps(self, x: np.ndarray, mode: Mode, start: np.ndarray | None = None) -> np.ndarray | None:
        """Values of the steps in a mode: those of sliding ones make dc/dt zero, by Newton's method."""
        sliding = [i for i, value in enumerate(mode) if value is None]
        alpha = np.array([0.5 if value is None else value for value in mode], dtype=float)
        if not sliding:
            return alpha
        if start is not None:
            alpha[sliding] = start[sliding]
        normals = self.system.normals[sliding]
        for _ in range(30):
            value = normals @ self.system.field(x, alpha)
            jacobian = np.empty((len(sliding), len(sliding)))
            for column, i in enumerate(sliding):  # multilinear: differences of whole steps are derivatives
                high, low = alpha.copy(), alpha.copy()
                high[i], low[i] = 1.0, 0.0
                jacobian[:, column] = normals @ (self.system.field(x, high) - self.system.field(x, low))
            try:
                change = np.linalg.solve(jacobian, value)
            except np.linalg.LinAlgError:
                return None
            alpha[sliding] -= change
            if np.abs(change).max() < 1e-14:
                return alpha
            if np.abs(alpha).max() > 1e6:
                return None
        return alpha if np.abs(change).max() < 1e-10 else None

    def modes(self, x: np.ndarray, mode: Mode, zero: list[int]) -> list[Mode]:
        """The modes that fit a point, one for every x'; those of switching functions that are not zero stay."""
        found: list[tuple[Mode, np.ndarray]] = []
        for choice in product((0, 1, None), repeat=len(zero)):
            candidate = list(mode)
            for i, value in zip(zero, choice, strict=True):
                candidate[i] = value
            sliding = [i for i, value in enumerate(candidate) if value is None]
            grid = (0.5,) if self.system.additive or len(sliding) < 2 else (0.05, 0.35, 0.65, 0.95)
            for start in product(grid, repeat=len(sliding)):
                full = np.full(len(mode), 0.5)
                full[sliding] = start
                alpha = self.steps(x, tuple(candidate), full)
                if alpha is None or alpha.min() < -1e-7 or alpha.max() > 1 + 1e-7:
                    continue
                rate = self.system.field(x, alpha)
                speed = self.system.normals @ rate
                sides = [(i, candidate[i]) for i in zero]
                if any(side is not None and (2 * side - 1) * speed[i] < -1e-7 for i, side in sides):
                    continue
                if not any(np.abs(rate - other).max() < 1e-6 for _, other in found):
                    found.append((tuple(candidate), rate))
        return [one for one, _ in found]

    def run(self, duration: float) -> np.ndarray:
        """Return x at the end."""
        x, now = self.system.start.copy(), 0.0
        c = self.system.normals @ x - self.system.offsets
        mode: Mode = tuple(int(value > 0) for value in c)
        just_left: list[int] = []
        for _ in range(500):
            rate, events, about = self.smooth_part(x, mode, just_left)
            ran = solve_ivp(
                rate, (now, duration), x, method="DOP853", rtol=1e-12, atol=1e-13, events=events, max_step=0.05
            )
            x, now = ran.y[:, -1], ran.t[-1]
            if ran.status == 0:
                return x
            if ran.status < 0:
                raise NotUnique(f"a sliding mode ceases to exist at {now:.6f}")
            i, kind = about[next(number for number, times in enumerate(ran.t_events) if len(times))]
            mode, just_left = self.after(x, now, mode, i, kind)
        raise RuntimeError("500 switches")

    def smooth_part(self, x: np.ndarray, mode: Mode, just_left: list[int]) -> tuple[Callable, list, list]:
        """Right-hand side and events of a mode: a surface is met, or a step reaches one of its bounds."""
        guess = {"alpha": self.steps(x, mode)}

        def rate(t: float, y: np.ndarray) -> np.ndarray:
            alpha = self.steps(y, mode, guess["alpha"])
            if alpha is None:
                return np.full(len(y), np.nan)  # a shorter step is taken
            guess["alpha"] = alpha
            return self.system.field(y, alpha)

        def event(i: int, kind: str) -> Event:
            def value(t: float, y: np.ndarray) -> float:
                side = mode[i]
                if side is not None:
                    c = self.system.normals[i] @ y - self.system.offsets[i]
                    return (2 * side - 1) * c + (1e-10 if i in just_left else 0.0)
                alpha = self.steps(y, mode, guess["alpha"])
                if alpha is None:
                    return -1.0
                return alpha[i] if kind == "low" else 1 - alpha[i]

            return Event(value)

        about = [
            (i, kind) for i, side in enumerate(mode) for kind in (("low", "high") if side is None else ("surface",))
        ]
        return rate, [event(*one) for one in about], about

    def after(self, x: np.ndarray, now: float, mode: Mode, i: int, kind: str) -> tuple[Mode, list[int]]:
        """The mode after an event, and the surfaces that it leaves."""
        c = self.system.normals @ x - self.system.offsets
        zero = sorted({i, *(j for j, side in enumerate(mode) if side is None), *np.flatnonzero(np.abs(c) < 1e-9)})
        if kind == "surface":
            found = self.modes(x, mode, zero)
        else:
            # A sliding mode ends: the step is at its bound, and the field is continuous.
            new = (*mode[:i], int(kind == "high"), *mode[i + 1 :])
            found = self.modes(x, new, [j for j in zero if j != i])
            if len(found) != 1:
                found = self.modes(x, mode, zero)
            if len(found) == 1 and found[0][i] is None:
                found = [new]
        if len(found) != 1:
            raise NotUnique(f"{len(found)} modes at {now:.6f}")
        left = [j for j in zero if mode[j] is None and found[0][j] is not None]
        return found[0], left + ([i] if kind != "surface" else [])


def compare(seed: int) -> tuple[str, float, float, int]:
    """Return what came out, the error in units of rtol, the time simulate took, and the number of switches."""
    random = RandomSystem.of(seed)
    system, begin = random.system(), time.perf_counter()
    try:
        motion = simulate(system, random.start, (0.0, DURATION))
    except SimulationError as error:
        motion, failure = error.simulation, str(error)
    else:
        failure = ""
    seconds = time.perf_counter() - begin
    switches = len(motion.switch_times)
    try:
        exact = Reference(random).run(DURATION)
    except NotUnique as reason:
        outcome = "named as not unique" if not motion.unique else f"NOT NAMED as not unique: {reason}"
        return outcome, np.nan, seconds, switches
    if failure:
        return f"FAILED: {failure}", np.nan, seconds, switches
    off = float((np.abs(motion.states[-1] - exact) / (1 + np.abs(exact))).max() / RTOL)
    if off <= 10:
        return "right", off, seconds, switches
    return ("named as not unique" if not motion.unique else "WRONG"), off, seconds, switches


def main() -> None:
    """Compare and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", nargs=2, type=int, metavar=("FIRST", "END"))
    arguments = parser.parse_args()
    seeds = range(*arguments.seeds) if arguments.seeds else range(SYSTEMS)
    results = {}
    for seed in seeds:
        results[seed] = compare(seed)
        if not results[seed][0].startswith(("right", "named")):
            print(seed, *results[seed], flush=True)
    outcomes = [result[0].split(":")[0] for result in results.values()]
    errors = np.array([result[1] for result in results.values() if result[0] == "right"])
    counts = [result[3] for result in results.values()]
    named = [str(seed) for seed, result in results.items() if result[0].startswith("named")]
    wrong = [str(seed) for seed, result in results.items() if not result[0].startswith(("right", "named"))]
    lines = [
        "# Random piecewise linear systems",
        "",
        f"Written by `scripts/results/random_piecewise_linear.py`. {len(seeds)} systems (seeds {seeds[0]} to "
        f"{seeds[-1]}) with",
        f"2 to 6 states and 1 to 4 switching functions over {DURATION:g} s, `simulate` with default settings against",
        "DOP853 at 1e-12 with events.",
        "",
        "| outcome | systems |",
        "|---|---|",
        *(f"| {outcome} | {outcomes.count(outcome)} |" for outcome in sorted(set(outcomes))),
        "",
        "Right: the error of the end state relative to 1 + |x| is at most 10 rtol (1e-5); it is "
        f"{np.median(errors):.1e} rtol in the median",
        f"and {errors.max():.1e} rtol at most. Switches: {sum(counts)} in all, at most {max(counts)} in one system.",
        "",
        f"Named as not unique: seeds {', '.join(named) or 'none'}.",
        f"Neither right nor named: seeds {', '.join(wrong) or 'none'}.",
        "",
    ]
    print("\n".join(lines))
    if not arguments.seeds:
        REPORT.write_text("\n".join(lines))


if __name__ == "__main__":
    main()
