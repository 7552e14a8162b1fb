"""Optimal control with impulses: one disc carries another one round an obstacle, and both change places.

    python scripts/results/reproduce/impulse_discs.py

Disc 1, of 2 kg, is pushed; disc 2, of 1 kg, only moves where disc 1 hits and pushes it; impacts are inelastic, and drag
brakes both. Source: arXiv 2305.17003, section 5.2, for which no cost and no time is published.
"""

from __future__ import annotations

from scripts.results.reproduce._common import Report, markdown_table, plt  # isort: skip  # first: sets the number of threads

from dataclasses import replace

import casadi as ca
import numpy as np

from fesd_robot.dcs import Mechanism, UnilateralContact
from fesd_robot.fesd import FesdOptions, OptimalControlProblem, TrajectoryConstraint
from fesd_robot.optimal_control import OptimalControlSettings, OptimalControlSolution, optimize
from scripts.results.reproduce._transfers import transfer

MASSES, RADII, OBSTACLE = (2.0, 1.0), (0.3, 0.2), 1.0
DRAG, DRAG_SPEED = 2.0, 0.1
DURATION, INTERVALS = 4.0, 25
START, TARGET = np.array([-2.0, 0.0, 2.0, 0.0]), np.array([2.0, 0.0, -2.0, 0.0])
WEIGHTS = np.array([10.0] * 4 + [0.01] * 4)
HIT = 1e-2
"""N s; smaller impulses are none."""


def problem() -> OptimalControlProblem:
    """Return the optimal control problem; its guess takes both discs round the obstacle in opposite directions."""
    q, v, u = ca.SX.sym("q", 4), ca.SX.sym("v", 4), ca.SX.sym("u", 2)
    drags = [-DRAG * w / ca.sqrt(ca.sumsqr(w) + DRAG_SPEED**2) for w in (v[:2], v[2:])]
    distance = ca.norm_2(q[:2] - q[2:])
    normal = (q[:2] - q[2:]) / distance
    masses = ca.diag(ca.SX([MASSES[0], MASSES[0], MASSES[1], MASSES[1]]))
    mechanism = Mechanism(q, v, masses, ca.vertcat(u + drags[0], drags[1]), control=u)
    contacts = [UnilateralContact("discs", distance - sum(RADII), ca.vertcat(normal, -normal))]

    def guess(time: float) -> np.ndarray:
        angles = np.pi * np.array([1 - time / DURATION, -time / DURATION])
        return 2 * np.array([np.cos(angles), np.sin(angles)]).T.ravel()

    free = transfer(
        mechanism,
        contacts,
        (START, TARGET),
        guess,
        (DURATION, INTERVALS),
        weights=WEIGHTS,
        most=np.array([10.0] * 4 + [5.0] * 4),
        least_gap=0.0,
    )
    system = free.system
    clear = [ca.sumsqr(q[2 * i : 2 * i + 2]) - (OBSTACLE + RADII[i]) ** 2 for i in range(2)]
    around = TrajectoryConstraint(
        "obstacle",
        "path",
        ca.vertcat(system.state, system.control, system.algebraic),
        range(INTERVALS),
        ca.vertcat(*clear),
        np.zeros(2),
        np.full(2, np.inf),
        ["disc 1", "disc 2"],
    )
    return replace(free, constraints=[around])


def hits_of(solution: OptimalControlSolution) -> list[tuple[float, float]]:
    """Return time and impulse of every impact."""
    return [(one.start, float(one.jump[4])) for one in solution.elements if one.jump[4] > HIT]


def main() -> None:
    """Solve the problem and check what the motion must show."""
    report = Report("impulse_discs", "Two discs change places", __doc__.splitlines()[0])
    report.parse()
    options = FesdOptions(elements=2, cross_complementarity="theta_sum")
    solution = optimize(problem(), options, OptimalControlSettings(starts=1, more_starts=0, search=False))
    hits, states = hits_of(solution), solution.states
    figure, axis = plt.subplots(figsize=(4.5, 3.2), layout="constrained")
    for i, name in enumerate(("disc 1, pushed", "disc 2")):
        axis.plot(states[:, 2 * i], states[:, 2 * i + 1], ".-", label=name)
    axis.add_patch(plt.Circle((0, 0), OBSTACLE, color="0.8"))
    axis.set_aspect("equal")
    axis.set_xlabel("x, m")
    axis.set_ylabel("y, m")
    axis.legend(fontsize=7)
    report.add(
        f"T = {DURATION:g} s, {INTERVALS} intervals of two finite elements of Radau IIA with two stages, one initial "
        f"guess. {solution.message}"
    )
    report.figure(figure, "The centres of the discs, and the obstacle.")
    report.add(
        markdown_table(["impact at, s", "impulse, N s"], [[f"{t:.4f}", f"{impulse:.3f}"] for t, impulse in hits])
    )
    first = hits[0][0] if hits else DURATION
    at_rest = max(float(np.abs(one.x_before[6:8]).max()) for one in solution.elements if one.start <= first)
    miss = np.abs(states[-1, :4] - TARGET).max()
    report.check("the motion is exact", solution.exact)
    report.check(f"disc 2 rests until the first impact, at most {at_rest:.1e} m/s", bool(hits) and at_rest < 1e-9)
    report.check(f"both discs end at their targets to 0.2 m, found {miss:.2f} m", miss < 0.2)
    report.close()


if __name__ == "__main__":
    main()
