"""IPOPT behind CasADi: one relaxed NLP in, one point with Lagrange multipliers and IPOPT's own words out."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from fesd_robot.errors import SolverError
from fesd_robot.mpcc.assembly import RelaxedNlp
from fesd_robot.mpcc.status import NlpStatus
from fesd_robot.running import Stop


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


class Iterate(NamedTuple):
    """An iterate of IPOPT.

    Attributes:
        iteration: its number, from one.
        objective: f(x).
        bound: objective that the solution has at least, if the NLP is convex there and the gradient of the Lagrangian
            has vanished, f(x) + lam_g^T (g - active bound) + lam_x^T (x - active bound).
        violation: largest of the constraints.

    Source: weak duality, Boyd & Vandenberghe, Convex Optimization, 5.2.2.
    """

    iteration: int
    objective: float
    bound: float
    violation: float


Hopeless = Callable[[Iterate], bool]
"""Whether nothing is to be expected of an NLP any more."""

_Values = Sequence[np.ndarray]
"""x (n), f, g (m), and the multipliers of x and g."""


class IterationCallback(ca.Callback):
    """Called by IPOPT once an iteration; asks whether to end.

    Args:
        size, constraints: of the NLP.
        stop: whether the user wants that.
        hopeless: (iteration, values) -> whether nothing is to be expected any more; `given_up` then.
    """

    def __init__(
        self,
        size: int,
        constraints: int,
        stop: Stop | None,
        hopeless: Callable[[int, _Values], bool] | None = None,
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
            self.given_up = self._hopeless(self.iterations, [np.asarray(one).ravel() for one in arguments[:5]])
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
        hopeless: called with every iterate; True ends the solve as if it had no iterations left.

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

    def given_up(iteration: int, values: _Values) -> bool:
        x, f, g, lam_x, lam_g = values
        violation = np.maximum(nlp.lower - g, g - nlp.upper).max(initial=0.0)
        bound = f[0] + _with_multipliers(lam_x, x, lower, upper) + _with_multipliers(lam_g, g, nlp.lower, nlp.upper)
        return hopeless is not None and hopeless(Iterate(iteration, float(f[0]), float(bound), float(violation)))

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


def _with_multipliers(lam: np.ndarray, values: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> float:
    """Return lam^T (values - active bound); the active one is the upper bound where a multiplier is positive."""
    active = np.where(lam > 0, upper, lower)
    bounded = np.isfinite(active)
    return float(lam[bounded] @ (values[bounded] - active[bounded]))
