"""The finish: from a point with small products to one whose pairs are exact, by smooth NLPs on what it means."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Protocol, TypeVar

import numpy as np

from fesd_robot.mpcc.assembly import Compile, RelaxedNlp, assemble
from fesd_robot.mpcc.ipopt import NlpPoint, solve_nlp
from fesd_robot.mpcc.problem import Mpcc, Residuals
from fesd_robot.mpcc.relaxations import relaxation_named

ITERATIONS = 40
"""IPOPT iterations for one structure before it is revised; one that fits needs 15 to 50."""

REVISIONS = 4
"""How often a structure is revised before the next reading."""

EXACT = 1e-12
"""Largest product of a pair at an exact point."""

TOLERANCE, VIOLATION = 1e-9, 1e-10
"""Of IPOPT, for its scaled optimality and for the constraints."""

S = TypeVar("S")


@dataclass(frozen=True)
class Held:
    """Bounds on the variables (n) and on the rows of g of a smooth problem."""

    lower: np.ndarray
    upper: np.ndarray
    g_lower: np.ndarray
    g_upper: np.ndarray


class Polisher(Protocol[S]):
    """What knows the meaning of a point: which factors of the pairs vanish, a structure."""

    @property
    def problem(self) -> Mpcc:
        """The problem without pairs."""
        ...

    def readings(self, w: np.ndarray) -> Iterator[S]:
        """Structures that a point may mean, the likelier first."""
        ...

    def revised(self, structure: S, w: np.ndarray) -> S | None:
        """The structure after an NLP that has not converged at w; None if it has nothing to change."""
        ...

    def held(self, structure: S) -> Held:
        """The bounds that hold a structure."""
        ...


@dataclass(frozen=True)
class PolishingReport:
    """One smooth NLP.

    Attributes:
        status: IPOPT's, in words.
        iterations, seconds: of the NLP.
        residuals: of the problem with pairs, at the NLP's end.
        w: the NLP's end.
        exact: the NLP converged, its constraints hold, and all products are below `EXACT`.
    """

    status: str
    iterations: int
    seconds: float
    residuals: Residuals
    w: np.ndarray
    exact: bool


@dataclass(frozen=True)
class BranchNlp:
    """A polisher with the functions of its smooth problem."""

    polisher: Polisher[Any]
    nlp: RelaxedNlp

    @classmethod
    def of(cls, polisher: Polisher[Any], compiled: Compile) -> BranchNlp:
        """Return the smooth problem with derivatives; they are made once for all structures."""
        return cls(polisher, assemble(polisher.problem, relaxation_named("scholtes"), compiled))

    def solve(
        self,
        problem: Mpcc,
        w: np.ndarray,
        *,
        options: dict[str, Any],
        iterations: int = ITERATIONS,
        feasibility: float,
        remaining: Callable[[], float | None],
        report: Callable[[PolishingReport], None],
        stop: Callable[[int, float], bool] | None = None,
    ) -> PolishingReport | None:
        """Return the first exact end of a smooth NLP, None if no structure that w may mean leads to one.

        A structure whose NLP does not converge within `iterations` is revised and continued from where it ended, at
        most `REVISIONS` times; then comes the next reading of w.

        Args:
            problem: the problem with pairs, which every end is checked against.
            options: of IPOPT, beside those set here: the linear solver.
            iterations: of IPOPT, for each NLP.
            feasibility: largest constraint violation of an exact end.
            remaining: seconds left, None for no limit.
            report: called after every NLP.
            stop: called once an IPOPT iteration with (iteration, objective); True ends the finish.
        """
        for structure in self.polisher.readings(w):
            point = w
            for _ in range(1 + REVISIONS):
                seconds = remaining()
                if seconds is not None and seconds <= 0:
                    return None
                found = self._solve_on(
                    structure, problem, point, {"max_iter": iterations, **options}, feasibility, seconds, stop
                )
                report(found)
                if found.exact or found.status == "interrupted":
                    return found if found.exact else None
                point = found.w
                changed = self.polisher.revised(structure, point)
                if changed is None or not np.isfinite(point).all():
                    break
                structure = changed
        return None

    def _solve_on(
        self,
        structure: Any,
        problem: Mpcc,
        w: np.ndarray,
        options: dict[str, Any],
        feasibility: float,
        seconds: float | None,
        stop: Callable[[int, float], bool] | None,
    ) -> PolishingReport:
        held = self.polisher.held(structure)
        settings = {
            "tol": TOLERANCE,
            "constr_viol_tol": VIOLATION,
            "acceptable_iter": 0,
            "mu_strategy": "monotone",
            "mu_init": 1e-4,
            "bound_relax_factor": 0.0,
            "honor_original_bounds": "no",
            **({} if seconds is None else {"max_wall_time": seconds}),
            **options,
        }
        begin = time.perf_counter()
        result = solve_nlp(
            replace(self.nlp, lower=held.g_lower, upper=held.g_upper),
            sigma=(0.0, 0.0),
            start=NlpPoint(np.clip(w, held.lower, held.upper), np.zeros(len(w)), np.zeros(len(held.g_lower))),
            lower=held.lower,
            upper=held.upper,
            options=settings,
            stop=stop,
        )
        residuals = problem.residuals(result.point.x)
        exact = (
            result.converged and residuals.complementarity <= EXACT and residuals.constraint_violation <= feasibility
        )
        return PolishingReport(
            result.status, result.iterations, time.perf_counter() - begin, residuals, result.point.x, exact
        )
