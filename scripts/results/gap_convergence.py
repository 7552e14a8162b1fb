"""How far the true gap leaves zero in stance, over the order of the scheme and the length of an element.

    python scripts/results/gap_convergence.py

The foot of the hopper stands and slides on the ground while constant forces turn the robot and shorten its leg, so that
the direction from body to foot changes all the time. Contact holds the integrated gap at zero exactly; what the true
gap differs by is the error of the Runge-Kutta scheme. The table goes to docs/results/gap_convergence.md. Exit code
1 if a slope is below the order of the scheme by more than a half, or if an error does not shrink.
"""

from __future__ import annotations

import argparse
import os
import sys
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import casadi as ca
import numpy as np

from fesd_robot import load_task
from fesd_robot.fesd import Transcription
from fesd_robot.fesd.polishing import BranchTranscription
from fesd_robot.mpcc import HomotopyOptions, Run, solve
from fesd_robot.ocp import formulate

ROOT = Path(__file__).resolve().parents[2]
TASK = ROOT / "tasks" / "published_hopper_one_jump.yaml"
DURATION = 0.2
FORCES = (1.0, -0.6)
"""N m on the body, N along the leg: gentle enough for the foot to stay on the ground."""
RATE = 1.5
"""rad/s, first speed of the pitch, about the foot."""
INTERVALS = (2, 4, 8, 16)


def largest_gap(stages: int, intervals: int, gain: float) -> float:
    """Return the largest true gap at the ends of the elements, m."""
    task = load_task(
        TASK,
        [
            f"horizon.duration={DURATION}",
            f"horizon.intervals={intervals}",
            f"method.stages={stages}",
            "method.elements=1",
            f"method.formulation.baumgarte_gain={gain}",
            "reference={type: line}",
            f"initial.velocity={{root_x: {0.5 * RATE}, root_pitch: {RATE}}}",
            "goal.configuration={}",
        ],
    )
    motion = formulate(task)
    ocp = motion.ocp
    lower, upper = ocp.control_lower.copy(), ocp.control_upper.copy()
    lower[:2] = upper[:2] = FORCES
    free = np.full(len(ocp.terminal_lower), np.inf)
    ocp = replace(
        ocp, control_lower=lower, control_upper=upper, running_cost={}, terminal_cost={}, terminal_lower=-free,
        terminal_upper=free, control_guess=np.clip(ocp.control_guess, lower[:, None], upper[:, None]),
    )  # fmt: skip
    transcription = Transcription(ocp, motion.fesd)
    solution = solve(
        transcription.problem,
        Run(HomotopyOptions(tolerance=1e-9, linear_solver="auto")),
        polisher=BranchTranscription(transcription),
    )
    if not solution.solved:
        raise RuntimeError(f"{stages} stages, {intervals} intervals: {solution.status}")
    gap = ca.Function("gap", [motion.dynamics.configuration], [motion.contacts[0].gap])
    elements = transcription.unpack(solution.w)
    if max(abs(float(element.x[-1][-1])) for element in elements) > 1e-9:
        raise RuntimeError(f"{stages} stages, {intervals} intervals: the foot left the ground")
    return max(abs(float(gap(element.x[-1][:4]))) for element in elements)


def main() -> int:
    """Measure and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--page", type=Path, default=ROOT / "docs" / "results" / "gap_convergence.md")
    page = parser.parse_args().page
    lines, passed = [], True
    for gain in (30.0, 0.0):
        for stages in (1, 2, 3):
            errors = [largest_gap(stages, n, gain) for n in INTERVALS]
            slope = float(np.polyfit(np.log(DURATION / np.array(INTERVALS)), np.log(errors), 1)[0])
            order = 2 * stages - 1
            passed &= slope >= order - 0.5 and errors == sorted(errors, reverse=True)
            cells = " | ".join(f"{error:.1e}" for error in errors)
            lines.append(f"| {gain:g} | {stages} | {order} | {cells} | {slope:.2f} |")
            print(lines[-1], flush=True)
    header = [
        "# The true gap in stance",
        "",
        "Made by `python scripts/results/gap_convergence.py`: the largest true gap, m, of a foot that slides "
        "on the ground for "
        f"{DURATION} s while the robot turns, one Radau IIA element per interval. Contact holds the integrated gap, "
        "which is zero to 1e-9 in all runs; the true gap differs from it by the error of the scheme. kappa is the gain "
        "of the Baumgarte stabilisation, `method.formulation.baumgarte_gain`.",
        "",
        f"| kappa [1/s] | stages | order | {' | '.join(f'h = {DURATION / n:g} s' for n in INTERVALS)} | slope |",
        f"|{' --: |' * (4 + len(INTERVALS))}",
    ]
    page.write_text("\n".join([*header, *lines, ""]))
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
