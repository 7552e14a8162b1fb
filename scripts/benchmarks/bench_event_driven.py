"""Time at equal error: `simulate` over a span of time beside an event-driven DOP853 with modes written by hand.

    python scripts/benchmarks/bench_event_driven.py            # writes docs/results/bench_event_driven.md

Two systems: the planar oscillator that crosses the unit circle (arXiv 2205.05337, section 4.4) and a mass on a moving
belt whose friction falls with the sliding speed. Every tolerance is run 15 times, the processor time is the median.
Times at an error lie on the line between the two nearest points, in logarithms.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

from fesd_robot.dcs import ComplementaritySystem, Model, Subsystem, stewart
from fesd_robot.fesd import simulate

RUNS = 15
TOLERANCES = 10.0 ** -np.arange(3, 13)
ERRORS = (1e-4, 1e-6, 1e-8, 1e-10)
OMEGA = 2 * np.pi
BELT, END = 0.3, 20.0
REPORT = Path(__file__).resolve().parents[2] / "docs" / "results" / "bench_event_driven.md"

INSIDE, OUTSIDE = np.array([[1, -OMEGA], [OMEGA, 1]]), np.array([[1, OMEGA], [-OMEGA, 1]])
OSCILLATOR_END = np.array([-1.5974603774506981221, 0.76149362060601145276])


def oscillator() -> ComplementaritySystem:
    """x' = A x, turning left inside the unit circle and right outside."""
    x = ca.SX.sym("x", 2)
    fields = ca.horzcat(ca.mtimes(ca.DM(INSIDE), x), ca.mtimes(ca.DM(OUTSIDE), x))
    regions = Subsystem(fields=fields, switching=ca.sumsqr(x) - 1, sign_matrix=np.array([[-1], [1]]))
    return stewart(Model(x), regions)


def oscillator_by_hand(rtol: float) -> np.ndarray:
    """The same with an event at the circle."""

    def circle(t: float, x: np.ndarray) -> float:
        return float(x[0] * x[0] + x[1] * x[1] - 1.0)

    circle.terminal = True  # type: ignore[attr-defined]
    first = solve_ivp(
        lambda t, x: INSIDE @ x,
        (0.0, np.pi / 2),
        [np.exp(-1), 0.0],
        "DOP853",
        rtol=rtol,
        atol=rtol * 1e-3,
        events=circle,
    )
    second = solve_ivp(
        lambda t, x: OUTSIDE @ x, (first.t[-1], np.pi / 2), first.y[:, -1], "DOP853", rtol=rtol, atol=rtol * 1e-3
    )
    return np.asarray(second.y[:, -1])


def stick_slip() -> ComplementaritySystem:
    """A mass on a spring and a belt: friction 1 / (1 + 2 |v - belt|) against the sliding speed."""
    x = ca.SX.sym("x", 2)
    speed = x[1] - BELT
    fields = ca.horzcat(ca.vertcat(x[1], -x[0] + 1 / (1 - 2 * speed)), ca.vertcat(x[1], -x[0] - 1 / (1 + 2 * speed)))
    return stewart(Model(x), Subsystem(fields=fields, switching=speed, sign_matrix=np.array([[-1], [1]])))


def stick_slip_by_hand(rtol: float) -> np.ndarray:
    """The same with events where the mass reaches the belt, and sticks that end where the spring pulls with 1."""

    def slip(t: float, y: np.ndarray) -> list[float]:
        return [y[1], -y[0] + 1 / (1 + 2 * (BELT - y[1]))]

    def belt(t: float, y: np.ndarray) -> float:
        return float(y[1] - BELT)

    belt.terminal, belt.direction = True, 1  # type: ignore[attr-defined]
    settings = {"method": "DOP853", "rtol": rtol, "atol": rtol * 1e-3}
    now, state = 0.0, np.array([0.0, 0.0])
    while True:
        begun = solve_ivp(slip, (now, min(now + 0.2, END)), state, **settings)  # leaves the belt
        ran = solve_ivp(slip, (begun.t[-1], END), begun.y[:, -1], events=belt, **settings)
        if not ran.status:
            return np.asarray(ran.y[:, -1])
        now = ran.t[-1] + (1.0 - ran.y[0, -1]) / BELT
        if now >= END:
            return np.array([1.0 - BELT * (now - END), BELT])
        state = np.array([1.0, BELT])


def measured(run: Callable[[float], np.ndarray], exact: np.ndarray) -> list[tuple[float, float]]:
    """Error and median processor time in milliseconds of every tolerance."""
    points = []
    for rtol in TOLERANCES:
        run(float(rtol))
        times = []
        for _ in range(RUNS):
            begin = time.process_time()
            end = run(float(rtol))
            times.append(time.process_time() - begin)
        points.append((max(float(np.abs(end - exact).max()), 1e-16), 1e3 * float(np.median(times))))
    return points


def at_error(points: list[tuple[float, float]], error: float) -> float:
    """Least time with which an error is reached."""
    reached = [(abs(np.log(own / error)), spent) for own, spent in points if own <= error]
    better = min((spent for _, spent in reached), default=np.nan)
    for (error_1, spent_1), (error_2, spent_2) in pairwise(points):
        if error_2 <= error < error_1:
            share = np.log(error_1 / error) / np.log(error_1 / error_2)
            better = min(better, float(np.exp(np.log(spent_1) + share * np.log(spent_2 / spent_1))))
    return better


def main() -> None:
    """Measure and write the table."""
    lines = [
        "# Time at equal error beside an event-driven integrator",
        "",
        "Written by `scripts/benchmarks/bench_event_driven.py`. Processor time in milliseconds until the end "
        "state has the error,",
        f"median of {RUNS} runs after the first one, which also compiles the system.",
        "",
        "| system | error | `simulate` | DOP853, modes by hand | ratio |",
        "|---|---|---|---|---|",
    ]
    for name, system, by_hand, start, end in (
        ("oscillator", oscillator(), oscillator_by_hand, np.array([np.exp(-1), 0.0]), np.pi / 2),
        ("stick-slip", stick_slip(), stick_slip_by_hand, np.array([0.0, 0.0]), END),
    ):
        exact = OSCILLATOR_END if name == "oscillator" else by_hand(1e-13)

        def ours(
            rtol: float, system: ComplementaritySystem = system, start: np.ndarray = start, end: float = end
        ) -> np.ndarray:
            return simulate(system, start, (0.0, end), rtol=rtol).states[-1]

        own, other = measured(ours, exact), measured(by_hand, exact)
        for error in ERRORS:
            here, there = at_error(own, error), at_error(other, error)
            lines.append(f"| {name} | {error:.0e} | {here:.1f} | {there:.1f} | {here / there:.1f} |")
    lines.append("")
    print("\n".join(lines))
    REPORT.write_text("\n".join(lines))


if __name__ == "__main__":
    main()
