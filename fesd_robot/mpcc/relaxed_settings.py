"""How the relaxed NLPs of a homotopy are solved."""

from __future__ import annotations

from enum import Enum

from fesd_robot.mpcc.options import HomotopyOptions
from fesd_robot.mpcc.schedule import ACTIVE_SET_SETTLED_SIGMA, Sigmas
from fesd_robot.nlp import FREE, NlpSettings, Start

LOOSE_TOLERANCE = 1e-2
"""Tolerance in the loose homotopy; constraints hold to sigma of the velocity level where that is smaller."""

NEAR_BARRIER, NEAR_PUSH = 1e-2, 1e-4
"""Barrier parameter and distance from bounds with which an NLP of the loose homotopy begins that is near to the one
before: ten times the parameter at which that ended. With that of a guess it leaves that point and comes back."""


class NlpTry(Enum):
    """Which try at one NLP it is."""

    FIRST = "first"
    """With the monotone barrier."""
    AGAIN = "again"
    """From the same point, with the adaptive barrier."""


def relaxed_settings(
    options: HomotopyOptions, sigmas: Sigmas, trial: NlpTry, *, last: bool, loose: bool, near: bool
) -> NlpSettings:
    """Return the settings at given sigmas; only an NLP that may be the last is more accurate than sigma deserves.

    Args:
        options: of the homotopy.
        sigmas: of the position and the velocity level.
        trial: which try at this NLP it is.
        last: the NLP may be the last of the homotopy.
        loose: the NLP is one of the loose homotopy.
        near: it is a shortened step away from the one before, in whose multipliers it begins.
    """
    sigma, velocity_level_sigma = sigmas
    floor = min(1e-9, options.tolerance if last else 1e-9)
    tolerance = max(min(0.1 * (options.tolerance if last else sigma), 1e-3), floor)
    violation = min(0.1 * options.feasibility, 0.005 * options.tolerance) if last else min(tolerance, 1e-6)
    start = FREE
    if velocity_level_sigma <= ACTIVE_SET_SETTLED_SIGMA:
        start = Start(max(sigma, 1e-9), 1e-8, multipliers=True)
    elif near and trial is NlpTry.FIRST:
        start = Start(NEAR_BARRIER, NEAR_PUSH, multipliers=True)
    return NlpSettings(
        start=start,
        tolerance=LOOSE_TOLERANCE if loose else tolerance,
        violation=min(LOOSE_TOLERANCE, velocity_level_sigma) if loose else violation,
        iterations=options.loose_iterations if loose else options.max_iterations,
        adaptive=trial is NlpTry.AGAIN,
        linear_solver=options.linear_solver,
        further=tuple(options.ipopt.items()),
    )
