"""Optimal control with impulses: the middle one of three boxes shifts both others over ground with friction.

    python scripts/results/reproduce/impulse_boxes.py

Boxes of 1 kg and 2 m stand in a row with gaps of 1 m; only the middle one is pushed, horizontally. The boxes slide
along each other and over the ground with friction; the impact between the middle and the right box has a restitution
of 0.5.
Source: arXiv 2305.17003, section 5.3, for which no cost and no time is published.
"""

from __future__ import annotations

from scripts.results.reproduce._common import Report, markdown_table, plt  # isort: skip  # first: sets the number of threads

import casadi as ca
import numpy as np

from fesd_robot.dcs import Mechanism, UnilateralContact
from fesd_robot.fesd import FesdOptions, OptimalControlProblem
from fesd_robot.optimal_control import OptimalControlSettings, OptimalControlSolution, optimize
from scripts.results.reproduce._transfers import transfer

GRAVITY, SIZE = 9.81, 2.0
DURATION, INTERVALS = 6.0, 15
NAMES = ("left", "middle", "right")
CONTACTS = ("left and middle", "middle and right", *(f"{name} and ground" for name in NAMES))
START, TARGET = np.array([-3.0, 1, 0, 1, 3, 1]), np.array([-7.0, 1, 0, 1, 6, 1])
WEIGHTS = np.array([10, 0.001, 1, 0, 10, 0.001, *[0.1] * 6])
HIGHEST, FASTEST = 1.01, 0.01
"""Bounds of heights, m, and of vertical speeds, m/s: no box rises, but relaxed contacts would lift it."""
HIT = 1e-2
"""N s; smaller impulses are none."""
SLIDES = 1e-6
"""m/s; a slower box stands."""


def problem() -> OptimalControlProblem:
    """Return the optimal control problem; its guess is the straight line from start to target."""
    q, v, u = ca.SX.sym("q", 6), ca.SX.sym("v", 6), ca.SX.sym("u")
    push = ca.vertcat(0, -GRAVITY, u, -GRAVITY, 0, -GRAVITY)
    mechanism = Mechanism(q, v, ca.SX.eye(6), push, control=u)
    contacts = [
        UnilateralContact(
            CONTACTS[i],
            q[2 * i + 2] - q[2 * i] - SIZE,
            _along({2 * i: -1, 2 * i + 2: 1}),
            _along({2 * i + 1: -1, 2 * i + 3: 1}),
            friction=0.1,
            restitution=restitution,
        )
        for i, restitution in enumerate((0.0, 0.5))
    ]
    contacts += [
        UnilateralContact(
            CONTACTS[2 + i], q[2 * i + 1] - SIZE / 2, _along({2 * i + 1: 1}), _along({2 * i: 1}), friction=0.2
        )
        for i in range(3)
    ]
    most = np.array([10.0, HIGHEST] * 3 + [10.0, FASTEST] * 3)
    return transfer(
        mechanism,
        contacts,
        (START, TARGET),
        lambda time: START + time / DURATION * (TARGET - START),
        (DURATION, INTERVALS),
        weights=WEIGHTS,
        most=most,
        least_gap=-np.inf,  # the distances are bounded, so the gaps need no bounds of their own
    )


def _along(entries: dict[int, float]) -> ca.SX:
    """Return a direction in the space of velocities from its entries that are not zero."""
    direction = ca.SX.zeros(6)
    for index, value in entries.items():
        direction[index] = value
    return direction


def normal_of(edges: np.ndarray, contact: int) -> float:
    """Return the normal force, or impulse, of a contact from the edges of all cones, two a contact."""
    return float(edges[2 * contact : 2 * contact + 2].sum())


def hits_of(solution: OptimalControlSolution) -> list[tuple[float, float, str]]:
    """Return time, impulse and contact of every impact."""
    return [
        (one.start, normal_of(one.jump[6:], i), name)
        for one in solution.elements
        for i, name in enumerate(CONTACTS)
        if normal_of(one.jump[6:], i) > HIT
    ]


def changes_of(solution: OptimalControlSolution) -> list[tuple[float, str, str]]:
    """Return time, box and what it does from then on, of every change between standing and sliding."""
    whole = [one for one, gone in zip(solution.elements, solution.branch.without_length, strict=True) if not gone]
    changes = []
    for i, name in enumerate(NAMES):
        doing = "stands"
        for one in whole:
            speed = float(one.x[0, 6 + 2 * i])
            now = "stands" if abs(speed) < SLIDES else "slides right" if speed > 0 else "slides left"
            if now != doing:
                changes.append((one.start, name, now))
            doing = now
    return sorted(changes)


def main() -> None:
    """Solve the problem and check what the motion must show."""
    report = Report("impulse_boxes", "Three boxes with friction", __doc__.splitlines()[0])
    report.parse()
    options = FesdOptions(elements=2, cross_complementarity="theta_sum")
    settings = OptimalControlSettings(starts=1, more_starts=0, search=False, velocity_level_ratio=5.0)
    solution = optimize(problem(), options, settings)
    hits, changes = hits_of(solution), changes_of(solution)
    states, last = solution.states, solution.elements[-1]
    figure, (places, pushes) = plt.subplots(2, 1, figsize=(5.0, 4.4), sharex=True, layout="constrained")
    for i, name in enumerate(NAMES):
        (line,) = places.plot(solution.times, states[:, 2 * i], ".-", label=name)
        places.axhline(TARGET[2 * i], color=line.get_color(), linestyle=":", linewidth=0.8)
    for time, _, _ in hits:
        places.axvline(time, color="0.6", linewidth=0.8)
    pushes.step(solution.control_times, np.append(solution.controls[0], solution.controls[0, -1]), where="post")
    places.set_ylabel("x, m")
    places.legend(fontsize=7)
    pushes.set_ylabel("force on the middle box, N")
    pushes.set_xlabel("t, s")
    report.add(
        f"T = {DURATION:g} s, {INTERVALS} intervals of two finite elements of Radau IIA with two stages, one initial "
        f"guess, the straight line from start to target. {solution.message}"
    )
    report.add(
        f"No contact lifts a box that rests on the ground, but a relaxed one does: forces at a distance hold boxes in "
        f"the air, and impulses throw them up. Heights are therefore bounded by {HIGHEST:g} m and vertical speeds by "
        f"{FASTEST:g} m/s, which the solution does not come near, and the velocity level is relaxed "
        f"{settings.velocity_level_ratio:g} times as much as the position level in place of "
        f"{OptimalControlSettings().velocity_level_ratio:g} times. The motion is not the cheapest: with three finite "
        f"elements an interval, or from more starts, cheaper ones are found."
    )
    report.figure(figure, "Where the boxes are, their targets (dotted), impacts (grey), and the force.")
    report.add(
        markdown_table(
            ["impact between", "at, s", "impulse, N s"],
            [[name, f"{time:.4f}", f"{impulse:.3f}"] for time, impulse, name in hits],
        )
    )
    report.add(markdown_table(["box", "at, s", "does"], [[name, f"{time:.4f}", now] for time, name, now in changes]))
    risen = max(float(np.abs(one.x[:, [1, 3, 5]] - SIZE / 2).max()) for one in solution.elements)
    upwards = max(float(np.abs(one.x[:, [7, 9, 11]]).max()) for one in solution.elements)
    pressed = [normal_of(last.z[-1, 5:], i) for i in range(2, 5)]
    uneven = abs(sum(pressed) - 3 * GRAVITY)
    miss = np.abs(states[-1, [0, 4]] - TARGET[[0, 4]])
    report.check("the motion is exact", solution.exact)
    report.check(f"no box rises, at most {risen:.1e} m and {upwards:.1e} m/s", risen < 1e-9 and upwards < 1e-9)
    report.check(
        "the middle box hits each of the others once", sorted(name for *_, name in hits) == sorted(CONTACTS[:2])
    )
    report.check(
        f"at the end the ground carries the weight, {', '.join(f'{one:.4f} N' for one in pressed)}, "
        f"in all but {uneven:.0e} N",
        max(abs(one - GRAVITY) for one in pressed) < 1e-6,
    )
    report.check(
        f"left and right box end at their targets to 0.3 m, found {miss[0]:.3f} m and {miss[1]:.3f} m",
        miss.max() < 0.3,
    )
    report.check(f"boxes go over from standing to sliding and back, {len(changes)} changes", len(changes) >= 4)
    report.close()


if __name__ == "__main__":
    main()
