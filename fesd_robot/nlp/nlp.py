"""A nonlinear program: its functions, its numbers, its points, and how a solver ended."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np

from fesd_robot.nlp.status import NlpStatus


@dataclass(frozen=True, eq=False)
class Nlp:
    """The functions of a nonlinear program, in CasADi's signatures of `nlpsol`; a program is equal to itself only.

    Attributes:
        nlp: ``x, p -> f, g``.
        gradient, jacobian, hessian: of f, of g and of the Lagrangian.
    """

    nlp: ca.Function
    gradient: ca.Function
    jacobian: ca.Function
    hessian: ca.Function

    @property
    def size(self) -> int:
        """Number of variables."""
        return int(self.jacobian.size1_in(0))

    @property
    def rows(self) -> int:
        """Number of rows of g."""
        return int(self.jacobian.size1_out("g"))

    @property
    def parameters(self) -> int:
        """Number of parameters p."""
        return int(self.jacobian.size1_in(1))


@dataclass(frozen=True)
class NlpNumbers:
    """The numbers of a nonlinear program: bounds of x (n) and of g (m), and its parameters p."""

    lower: np.ndarray
    upper: np.ndarray
    g_lower: np.ndarray
    g_upper: np.ndarray
    p: np.ndarray


@dataclass(frozen=True)
class NlpPoint:
    """A point: variables x, Lagrange multipliers lam_x of their bounds and lam_g of the rows."""

    x: np.ndarray
    lam_x: np.ndarray
    lam_g: np.ndarray

    @classmethod
    def without_multipliers(cls, x: np.ndarray, rows: int) -> NlpPoint:
        """Return a point whose multipliers are zero."""
        return cls(x, np.zeros(len(x)), np.zeros(rows))


@dataclass(frozen=True)
class NlpResult:
    """Result of a solver: the point, how it ended, iterations and seconds."""

    point: NlpPoint
    status: NlpStatus
    iterations: int
    seconds: float

    @property
    def converged(self) -> bool:
        """The solver met its tolerance or its acceptable level."""
        return self.status.converged


class Iterate(NamedTuple):
    """An iterate of a solver.

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

    @classmethod
    def of(cls, iteration: int, objective: float, point: NlpPoint, g: np.ndarray, numbers: NlpNumbers) -> Iterate:
        """Return an iterate from its point and its rows, (m)."""
        below_or_above = np.maximum(numbers.g_lower - g, g - numbers.g_upper)
        bound = objective + _with_multipliers(point.lam_x, point.x, numbers.lower, numbers.upper)
        bound += _with_multipliers(point.lam_g, g, numbers.g_lower, numbers.g_upper)
        return cls(iteration, objective, bound, float(below_or_above.max(initial=0.0)))


Hopeless = Callable[[Iterate], bool]
"""Whether nothing is to be expected of an NLP any more."""


def _with_multipliers(lam: np.ndarray, values: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> float:
    """Return lam^T (values - active bound); the active one is the upper bound where a multiplier is positive."""
    active = np.where(lam > 0, upper, lower)
    bounded = np.isfinite(active)
    return float(lam[bounded] @ (values[bounded] - active[bounded]))
