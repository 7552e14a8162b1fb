"""IPOPT behind CasADi: one relaxed NLP in, one point with Lagrange multipliers and IPOPT's own words out."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from fesd_robot.errors import SolverError
from fesd_robot.mpcc.assembly import RelaxedNlp
from fesd_robot.mpcc.status import NlpStatus


@dataclass(frozen=True)
class NlpPoint:
    """A point of the relaxed NLP: variables x, Lagrange multipliers lam_x of bounds and lam_g of constraints."""

    x: np.ndarray
    lam_x: np.ndarray
    lam_g: np.ndarray


@dataclass(frozen=True)
class NlpResult:
    """What IPOPT returned: the point, how it ended, iterations and seconds."""

    point: NlpPoint
    status: NlpStatus
    iterations: int
    seconds: float

    @property
    def converged(self) -> bool:
        """IPOPT met its tolerance or its acceptable level."""
        return self.status.converged


Stop = Callable[[int, float], bool]
"""(iteration, objective) -> whether the user wants the solve to end."""

Hopeless = Callable[[int, float, float], bool]
"""(iteration, objective, violation of constraints) -> whether nothing is to be expected of an NLP any more."""


class IterationCallback(ca.Callback):
    """Called by IPOPT once an iteration; asks whether to end.

    Args:
        size, constraints: of the NLP.
        stop: whether the user wants that.
        hopeless: (iteration, objective, rows) -> whether nothing is to be expected any more; `given_up` then.
    """

    def __init__(
        self,
        size: int,
        constraints: int,
        stop: Stop | None,
        hopeless: Callable[[int, float, np.ndarray], bool] | None = None,
    ) -> None:
        super().__init__()
        self._shapes = {"x": size, "f": 1, "g": constraints, "lam_x": size, "lam_g": constraints, "lam_p": 2}
        self._stop, self._hopeless = stop, hopeless
        self.iterations, self.given_up = 0, False
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
        self.iterations += 1
        objective = float(arguments[1])
        if self._stop and self._stop(self.iterations, objective):
            return [1]
        if self._hopeless:
            self.given_up = self._hopeless(self.iterations, objective, np.asarray(arguments[2]).ravel())
        return [int(self.given_up)]


def solve_nlp(
    nlp: RelaxedNlp,
    *,
    sigma: tuple[float, float],
    start: NlpPoint,
    lower: np.ndarray,
    upper: np.ndarray,
    options: dict[str, Any],
    stop: Stop | None = None,
    hopeless: Hopeless | None = None,
) -> NlpResult:
    """Solve the relaxed NLP for given sigmas of the position and the velocity level.

    Args:
        nlp: functions, derivatives and bounds of the rows.
        sigma: of the position and the velocity level; zero where nothing is relaxed.
        start: initial point; its multipliers are used when the options ask for a warm start.
        lower, upper: bounds of the variables, (n).
        options: IPOPT options by IPOPT's names.
        stop: called with (iteration, objective); True ends the solve.
        hopeless: called with (iteration, objective, violation); True ends the solve as if it had no iterations left.

    Raises:
        SolverError: IPOPT could not be started.
    """
    settings: dict[str, Any] = {
        "ipopt": {"print_level": 0, "sb": "yes", **options},
        "print_time": False,
        "error_on_fail": False,
        "calc_lam_p": False,
        "no_nlp_grad": True,
        "grad_f": nlp.gradient,
        "jac_g": nlp.jacobian,
        "hess_lag": nlp.hessian,
    }

    def given_up(iteration: int, objective: float, g: np.ndarray) -> bool:
        violation = np.maximum(nlp.lower - g, g - nlp.upper).max(initial=0.0)
        return hopeless is not None and hopeless(iteration, objective, float(violation))

    size, constraints = nlp.jacobian.size1_in(0), len(nlp.lower)
    asked = given_up if hopeless else None
    callback = IterationCallback(size, constraints, stop, asked) if stop or asked else None
    if callback:
        settings["iteration_callback"] = callback
    begin = time.perf_counter()
    try:
        solver = ca.nlpsol("relaxed", "ipopt", nlp.nlp, settings)
        result = solver(
            x0=start.x, lam_x0=start.lam_x, lam_g0=start.lam_g, p=list(sigma),
            lbx=lower, ubx=upper, lbg=nlp.lower, ubg=nlp.upper,
        )  # fmt: skip
    except RuntimeError as error:
        raise SolverError(f"IPOPT could not be run: {str(error).strip().splitlines()[-1]}") from error
    statistics, hopeless_now = solver.stats(), callback is not None and callback.given_up
    return NlpResult(
        point=NlpPoint(*(np.asarray(result[key]).ravel() for key in ("x", "lam_x", "lam_g"))),
        status=NlpStatus.ITERATION_LIMIT if hopeless_now else NlpStatus.of_ipopt(statistics["return_status"]),
        iterations=int(statistics["iter_count"]),
        seconds=time.perf_counter() - begin,
    )
