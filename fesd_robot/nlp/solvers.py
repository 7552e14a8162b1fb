"""The solvers of nonlinear programs by name."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Protocol

from fesd_robot.errors import OptionError
from fesd_robot.nlp.ipopt import prepared_ipopt
from fesd_robot.nlp.nlp import Hopeless, Nlp, NlpNumbers, NlpPoint, NlpResult
from fesd_robot.nlp.settings import NlpSettings
from fesd_robot.running import Stop

PREPARED = 6
"""Solvers that are kept for when they are needed again."""


class Prepared(Protocol):
    """An NLP with a solver that was made for it once."""

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
            SolverError: it could not be started.
        """
        ...


SOLVERS: dict[str, Callable[[Nlp, NlpSettings], Prepared]] = {"ipopt": prepared_ipopt}
"""Name of a solver -> the function that makes it for an NLP."""


def check_solver(name: str) -> None:
    """Raise if there is no such solver.

    Raises:
        OptionError: the message has the names that there are.
    """
    if name not in SOLVERS:
        raise OptionError(f"found the NLP solver '{name}', expected one of {', '.join(SOLVERS)}")


@lru_cache(maxsize=PREPARED)
def prepared(nlp: Nlp, settings: NlpSettings) -> Prepared:
    """Return an NLP with the solver of its settings, made once for both."""
    return SOLVERS[settings.solver](nlp, settings)
