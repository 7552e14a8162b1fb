"""A solver behind CasADi's `nlpsol`: an NLP is prepared once and solved for many numbers."""

from __future__ import annotations

import contextlib
import io
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from fesd_robot.errors import SolverError
from fesd_robot.nlp.nlp import Hopeless, Iterate, Nlp, NlpNumbers, NlpPoint, NlpResult
from fesd_robot.nlp.status import NlpStatus
from fesd_robot.running import Stop

_OVERCONSTRAINED = "NLP is overconstrained"
"""What CasADi warns of where a branch has more equations than variables; how it ends is told by the status."""


@contextlib.contextmanager
def _without_warning() -> Iterator[None]:
    """Leave out that warning of CasADi's, which no option prevents; all else on stderr is written at the end."""
    written = io.StringIO()
    try:
        with contextlib.redirect_stderr(written):
            yield
    finally:
        kept = [line for line in written.getvalue().splitlines(keepends=True) if _OVERCONSTRAINED not in line]
        sys.stderr.write("".join(kept))


def _iterations(statistics: Mapping[str, Any]) -> int:
    """Return how many iterations a solver made; IPOPT's own number is any where it has not begun, as with more
    equations than variables."""
    begun = statistics["return_status"] not in ("Not_Enough_Degrees_Of_Freedom", "Invalid_Problem_Definition")
    return int(statistics["iter_count"]) if begun else 0


class IterationCallback(ca.Callback):
    """Called once an iteration; asks whether to end.

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
        """Return the number of inputs, for CasADi."""
        return ca.nlpsol_n_out()

    def get_n_out(self) -> int:
        """Return the number of outputs, for CasADi."""
        return 1

    def get_sparsity_in(self, index: int) -> ca.Sparsity:
        """Return the shape of an input, for CasADi."""
        return ca.Sparsity.dense(self._shapes[ca.nlpsol_out(index)], 1)

    def eval(self, arguments: Sequence[ca.DM]) -> list[int]:
        """Look at one iteration, for CasADi."""
        return [int(self.ends is not None and self.ends(arguments[:5]))]


class CasadiSolver:
    """An NLP with one of CasADi's solvers.

    Args:
        nlp: the program.
        plugin: name of the solver.
        options: of `nlpsol` for it.
        status_of: its name of how it ended -> status.

    Raises:
        SolverError: it could not be made.
    """

    def __init__(
        self, nlp: Nlp, plugin: str, options: Mapping[str, Any], status_of: Callable[[str], NlpStatus]
    ) -> None:
        self._plugin, self._status_of = plugin, status_of
        self._callback = IterationCallback(nlp.size, nlp.rows, nlp.parameters)
        common: dict[str, Any] = {
            "print_time": False,
            "error_on_fail": False,
            "calc_lam_p": False,
            "no_nlp_grad": True,
            "iteration_callback": self._callback,
        }
        try:
            self._solver = ca.nlpsol("nlp", plugin, nlp.nlp, {**common, **options})
        except RuntimeError as error:
            raise self._failed(error) from error

    def solve(
        self,
        numbers: NlpNumbers,
        start: NlpPoint,
        *,
        seconds: float | None = None,
        stop: Stop | None = None,
        hopeless: Hopeless | None = None,
    ) -> NlpResult:
        """Return where the solver ends, as `solvers.Prepared` says.

        Raises:
            SolverError: it could not be started.
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
        equations = int((numbers.g_lower == numbers.g_upper).sum())
        try:
            with _without_warning() if equations > len(numbers.lower) else contextlib.nullcontext():
                result = self._solver(
                    x0=start.x, lam_x0=start.lam_x, lam_g0=start.lam_g, p=numbers.p,
                    lbx=numbers.lower, ubx=numbers.upper, lbg=numbers.g_lower, ubg=numbers.g_upper,
                )  # fmt: skip
        except RuntimeError as error:
            raise self._failed(error) from error
        finally:
            self._callback.ends = None
        statistics = self._solver.stats()
        return NlpResult(
            point=NlpPoint(*(np.asarray(result[key]).ravel() for key in ("x", "lam_x", "lam_g"))),
            status=ended[0] if ended else self._status_of(statistics["return_status"]),
            iterations=_iterations(statistics),
            seconds=time.perf_counter() - begin,
        )

    def _failed(self, error: RuntimeError) -> SolverError:
        return SolverError(f"{self._plugin.upper()} could not be run: {str(error).strip().splitlines()[-1]}")
