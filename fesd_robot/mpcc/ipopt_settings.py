"""IPOPT's options for the NLPs of a homotopy."""

from __future__ import annotations

from enum import Enum
from typing import Any

from fesd_robot.errors import SolverError
from fesd_robot.mpcc.options import HomotopyOptions
from fesd_robot.mpcc.schedule import ACTIVE_SET_SETTLED_SIGMA, Sigmas
from fesd_robot.native import ipopt_options, kkt_library

LOOSE_TOLERANCE = 1e-2
"""IPOPT's tolerance in the loose homotopy; constraints hold to sigma of the velocity level where that is smaller."""

NEAR_BARRIER, NEAR_PUSH = 1e-2, 1e-4
"""Barrier parameter and distance from bounds with which an NLP of the loose homotopy begins that is near to the one
before: ten times the parameter at which that ended. With IPOPT's own of 0.1 it leaves that point and comes back."""

STANDS_STILL = {
    "acceptable_iter": 3,
    "acceptable_tol": 1e-2,
    "acceptable_constr_viol_tol": 1e-9,
    "acceptable_obj_change_tol": 1e-6,
}
"""IPOPT's options for an NLP that is at its point and does not end: constraints that depend on each other, as of two
fingers on one box, and forces that cost nothing leave multipliers undetermined. It ends where its constraints hold and
its cost stands still."""

STOOD_STILL_LONG = {**STANDS_STILL, "acceptable_iter": 10}
"""The same for an NLP that may still converge: what does so takes a few iterations more."""

WHOLE_STEPS = {"accept_every_trial_step": "yes"}
"""IPOPT's option for a solution that is near: no step is shortened. Newton's steps along forces that hardly cost
anything, as those of legs against each other, leave the constraints by a little and come back; a line search cuts them
to a thousandth, and the linear systems of such iterates are ill-conditioned."""

SHORTENED_STEPS = {"accept_every_trial_step": "no"}


class Trial(Enum):
    """Which try at one NLP it is."""

    FIRST = "first"
    """With the monotone barrier."""
    AGAIN = "again"
    """From the same point, with the adaptive barrier."""


def linear_solver_options(name: str) -> dict[str, Any]:
    """Return IPOPT's options that choose a linear solver; ours stands in for HSL's MA27.

    Args:
        name: ``auto``, ``fesd``, or one of IPOPT's own.

    Raises:
        SolverError: ``fesd``, and it cannot be compiled.
    """
    if name not in ("auto", "fesd"):
        return {"linear_solver": name}
    library = kkt_library()
    if library:
        return ipopt_options(library)
    if name == "fesd":
        raise SolverError("linear solver 'fesd' needs a C++ compiler (the log says what failed; valid: auto, mumps)")
    return {"linear_solver": "mumps"}


def nlp_options(
    options: HomotopyOptions,
    sigmas: Sigmas,
    remaining: float | None,
    trial: Trial,
    *,
    last: bool,
    loose: bool,
    near: bool,
) -> dict[str, Any]:
    """Return IPOPT's options at given sigmas; only an NLP that may be the last is more accurate than sigma deserves.

    Args:
        options: of the homotopy.
        sigmas: of the position and the velocity level.
        remaining: seconds left, None for no limit.
        trial: which try at this NLP it is.
        last: the NLP may be the last of the homotopy.
        loose: the NLP is one of the loose homotopy.
        near: it is a shortened step away from the one before, in whose multipliers it begins.
    """
    sigma, velocity_level_sigma = sigmas
    floor = min(1e-9, options.tolerance if last else 1e-9)
    tolerance = max(min(0.1 * (options.tolerance if last else sigma), 1e-3), floor)
    settings: dict[str, Any] = {
        **linear_solver_options(options.linear_solver),
        "max_iter": options.max_iterations,
        "tol": tolerance,
        "constr_viol_tol": min(0.1 * options.feasibility, 0.005 * options.tolerance) if last else min(tolerance, 1e-6),
        "acceptable_iter": 0,
        "mu_strategy": "monotone",
        "bound_relax_factor": 0.0,
        "honor_original_bounds": "no",
    }
    if velocity_level_sigma <= ACTIVE_SET_SETTLED_SIGMA:
        settings |= continued_at(max(sigma, 1e-9), 1e-8)
    elif near and trial is Trial.FIRST:
        settings |= continued_at(NEAR_BARRIER, NEAR_PUSH)
    if trial is Trial.AGAIN:
        settings |= {"mu_strategy": "adaptive", "mu_oracle": "quality-function"}
    if loose:
        settings |= {
            "max_iter": options.loose_iterations,
            "tol": LOOSE_TOLERANCE,
            "constr_viol_tol": min(LOOSE_TOLERANCE, velocity_level_sigma),
        }
    if remaining is not None:
        settings["max_wall_time"] = remaining
    return {**settings, **options.ipopt}


def starting_at(mu: float, push: float) -> dict[str, Any]:
    """Return IPOPT's options for a start at a barrier parameter, at least `push` away from every bound."""
    pushes = ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac")
    return {"mu_init": mu, **dict.fromkeys(pushes, push)}


def continued_at(mu: float, push: float) -> dict[str, Any]:
    """Return IPOPT's options for a start that keeps its multipliers, at a barrier parameter, near every bound."""
    pushes = ("warm_start_bound_push", "warm_start_slack_bound_push", "warm_start_mult_bound_push")
    return {"warm_start_init_point": "yes", "mu_init": mu, **dict.fromkeys(pushes, push)}
