"""IPOPT behind CasADi: an NLP is prepared once and solved for many numbers; only this file knows IPOPT's options.

Source: Waechter, Biegler, Math. Program. 106, 2006.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from fesd_robot.errors import SolverError
from fesd_robot.native import kkt_library
from fesd_robot.nlp.nlp import Iterate, Nlp, NlpNumbers, NlpPoint, NlpResult
from fesd_robot.nlp.settings import NlpSettings
from fesd_robot.nlp.status import NlpStatus
from fesd_robot.running import Stop

Hopeless = Callable[[Iterate], bool]
"""Whether nothing is to be expected of an NLP any more."""

PREPARED = 6
"""Solvers that are kept for when they are needed again."""

_QUIET: dict[str, Any] = {"print_level": 0, "sb": "yes"}

_PUSHES = ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac")
_WARM_PUSHES = ("warm_start_bound_push", "warm_start_slack_bound_push", "warm_start_mult_bound_push")

_AT_REST = {"acceptable_tol": 1e-2, "acceptable_constr_viol_tol": 1e-9, "acceptable_obj_change_tol": 1e-6}
"""What counts as standing still."""


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


class IterationCallback(ca.Callback):
    """Called by IPOPT once an iteration; asks whether to end.

    Args:
        size, rows, parameters: of the NLP.
        ends: called with x, f, g and the multipliers of x and g; True ends the solve.
    """

    def __init__(
        self, size: int, rows: int, parameters: int, ends: Callable[[Sequence[ca.DM]], bool] | None = None
    ) -> None:
        super().__init__()
        self._shapes = {"x": size, "f": 1, "g": rows, "lam_x": size, "lam_g": rows, "lam_p": parameters}
        self.ends = ends
        self.construct("iteration", {})

    def get_n_in(self) -> int:
        """CasADi: number of inputs."""
        return ca.nlpsol_n_out()

    def get_n_out(self) -> int:
        """CasADi: number of outputs."""
        return 1

    def get_sparsity_in(self, index: int) -> ca.Sparsity:
        """CasADi: input shapes."""
        return ca.Sparsity.dense(self._shapes[ca.nlpsol_out(index)], 1)

    def eval(self, arguments: Sequence[ca.DM]) -> list[int]:
        """CasADi: one iteration."""
        return [int(self.ends is not None and self.ends(arguments[:5]))]


class Prepared:
    """An NLP with a solver that was made for it once.

    Args:
        nlp: the program.
        settings: of the solver.

    Raises:
        SolverError: IPOPT could not be made.
    """

    def __init__(self, nlp: Nlp, settings: NlpSettings) -> None:
        self._callback = IterationCallback(nlp.size, nlp.rows, nlp.parameters)
        options: dict[str, Any] = {
            "ipopt": ipopt_options(settings),
            "print_time": False,
            "error_on_fail": False,
            "calc_lam_p": False,
            "no_nlp_grad": True,
            "grad_f": nlp.gradient,
            "jac_g": nlp.jacobian,
            "hess_lag": nlp.hessian,
            "iteration_callback": self._callback,
        }
        try:
            self._solver = ca.nlpsol("nlp", "ipopt", nlp.nlp, options)
        except RuntimeError as error:
            raise _failed(error) from error

    def solve(
        self,
        numbers: NlpNumbers,
        start: NlpPoint,
        *,
        seconds: float | None = None,
        stop: Stop | None = None,
        hopeless: Hopeless | None = None,
    ) -> NlpResult:
        """Return where the solver ends.

        Args:
            numbers: bounds and parameters.
            start: initial point; its multipliers are used if the settings' start says so.
            seconds: of the time limit, None for none.
            stop: called with (iteration, objective); True ends the solve.
            hopeless: called with every iterate; True ends the solve as if it had no iterations left.

        Raises:
            SolverError: IPOPT could not be started.
        """
        begin, iterations = time.perf_counter(), 0
        ended: list[NlpStatus] = []

        def ends(values: Sequence[ca.DM]) -> bool:
            nonlocal iterations
            iterations += 1
            objective = float(values[1])
            if stop and stop(iterations, objective):
                ended.append(NlpStatus.INTERRUPTED)
            elif seconds is not None and time.perf_counter() - begin > seconds:
                ended.append(NlpStatus.TIME_LIMIT)
            elif hopeless:
                x, _, g, lam_x, lam_g = (np.asarray(one).ravel() for one in values)
                if hopeless(Iterate.of(iterations, objective, NlpPoint(x, lam_x, lam_g), g, numbers)):
                    ended.append(NlpStatus.ITERATION_LIMIT)
            return bool(ended)

        asked = stop is not None or seconds is not None or hopeless is not None
        self._callback.ends = ends if asked else None
        try:
            result = self._solver(
                x0=start.x, lam_x0=start.lam_x, lam_g0=start.lam_g, p=numbers.p,
                lbx=numbers.lower, ubx=numbers.upper, lbg=numbers.g_lower, ubg=numbers.g_upper,
            )  # fmt: skip
        except RuntimeError as error:
            raise _failed(error) from error
        finally:
            self._callback.ends = None
        statistics = self._solver.stats()
        return NlpResult(
            point=NlpPoint(*(np.asarray(result[key]).ravel() for key in ("x", "lam_x", "lam_g"))),
            status=ended[0] if ended else NlpStatus.of_ipopt(statistics["return_status"]),
            iterations=int(statistics["iter_count"]),
            seconds=time.perf_counter() - begin,
        )


@lru_cache(maxsize=PREPARED)
def prepared(nlp: Nlp, settings: NlpSettings) -> Prepared:
    """Return an NLP with its solver, made once for every NLP and its settings."""
    return Prepared(nlp, settings)


def _failed(error: RuntimeError) -> SolverError:
    return SolverError(f"IPOPT could not be run: {str(error).strip().splitlines()[-1]}")
