"""IPOPT; only this file knows its options.

Source: Waechter, Biegler, Math. Program. 106, 2006.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fesd_robot.errors import SolverError
from fesd_robot.native import kkt_library
from fesd_robot.nlp.casadi_solver import CasadiSolver
from fesd_robot.nlp.nlp import Nlp
from fesd_robot.nlp.settings import NlpSettings
from fesd_robot.nlp.status import NlpStatus

_QUIET: dict[str, Any] = {"print_level": 0, "sb": "yes", "option_file_name": ""}
"""No lines, and no options from an `ipopt.opt` in the current folder."""

_PUSHES = ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac")
_WARM_PUSHES = ("warm_start_bound_push", "warm_start_slack_bound_push", "warm_start_mult_bound_push")

_AT_REST = {"acceptable_tol": 1e-2, "acceptable_constr_viol_tol": 1e-9, "acceptable_obj_change_tol": 1e-6}
"""Changes below this count as standing still."""


def ipopt_options(settings: NlpSettings) -> dict[str, Any]:
    """Return IPOPT's options.

    Raises:
        SolverError: our own linear solver is asked for, and cannot be compiled.
    """
    start = settings.start
    options: dict[str, Any] = {
        **_QUIET,
        **_linear_solver(settings.linear_solver),
        "tol": settings.tolerance,
        "max_iter": settings.iterations,
        "mu_init": start.barrier,
        "acceptable_iter": settings.at_rest,
        "bound_relax_factor": 0.0,
        "honor_original_bounds": "no",
        "mu_strategy": "monotone",
    }
    if start.multipliers:
        options |= {"warm_start_init_point": "yes", **dict.fromkeys(_WARM_PUSHES, start.push)}
    else:
        options |= dict.fromkeys(_PUSHES, start.push)
    if settings.violation is not None:
        options["constr_viol_tol"] = settings.violation
    if settings.adaptive:
        options |= {"mu_strategy": "adaptive", "mu_oracle": "quality-function"}
    if settings.regularised:
        options["perturb_always_cd"] = "yes"
    if settings.whole_steps:
        options["accept_every_trial_step"] = "yes"
    if settings.at_rest:
        options |= _AT_REST
    return {**options, **dict(settings.further)}


def linear_program_options(seconds: float, iterations: int, tolerance: float) -> dict[str, Any]:
    """Return IPOPT's options for a large linear program: Mehrotra's predictor and corrector, by our linear solver."""
    return {
        **_QUIET,
        "max_wall_time": max(seconds, 1e-3),
        "max_iter": iterations,
        "tol": tolerance,
        "bound_relax_factor": 0.0,
        "mehrotra_algorithm": "yes",
        "mu_strategy": "adaptive",
        "perturb_always_cd": "yes",
        "bound_push": 0.1,
        "hessian_constant": "yes",
        "jac_c_constant": "yes",
        "jac_d_constant": "yes",
        **_linear_solver("auto"),
    }


def our_linear_solver(library: Path) -> dict[str, Any]:
    """Return IPOPT's options that choose a library from `native.kkt_library`; it stands in for HSL's MA27.

    A pivot may be 1e-5 of its column, not IPOPT's 1e-8: a factorization takes 2 to 5 % longer, and backward errors of
    1e-3 become 1e-7.
    """
    pivots = {"ma27_pivtol": 1e-5, "ma27_pivtolmax": 1e-2}
    return {"linear_solver": "ma27", "hsllib": str(library), "linear_system_scaling": "none", **pivots}


def _linear_solver(name: str) -> dict[str, Any]:
    """Return IPOPT's options that choose a linear solver, see `NlpSettings`."""
    if name not in ("auto", "fesd"):
        return {"linear_solver": name}
    library = kkt_library()
    if library:
        return our_linear_solver(library)
    if name == "fesd":
        raise SolverError("linear solver 'fesd' needs a C++ compiler (the log says what failed; valid: auto, mumps)")
    return {"linear_solver": "mumps"}


def prepared_ipopt(nlp: Nlp, settings: NlpSettings) -> CasadiSolver:
    """Return an NLP with IPOPT.

    Raises:
        SolverError: it could not be made.
    """
    options = {
        "ipopt": ipopt_options(settings),
        "grad_f": nlp.gradient,
        "jac_g": nlp.jacobian,
        "hess_lag": nlp.hessian,
    }
    return CasadiSolver(nlp, "ipopt", options, NlpStatus.of_ipopt)
