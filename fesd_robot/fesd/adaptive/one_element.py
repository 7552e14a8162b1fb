"""One finite element in a given mode: its equations, compiled once for all modes, and Newton's method for them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from scipy.linalg.blas import dnrm2
from scipy.linalg.lapack import dgetrf, dgetrs

from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.exactness import SINGULAR_STEP
from fesd_robot.fesd.adaptive.compiled import DenseFunction
from fesd_robot.fesd.element import SystemFunctions
from fesd_robot.fesd.schemes import lagrange
from fesd_robot.fesd.tableau import Tableau

MAX_ITERATIONS = 20
"""Iterations of Newton's method for an element."""

SAMPLES = 12
"""Places in an element at which signs are looked at, besides its stages."""

SOLVED_RESIDUAL = 1e-12
"""Norm of the residual of a solved element, in units of that of its values."""


@dataclass
class SolvedElement:
    """An element in one mode.

    Attributes:
        h: its length.
        x: states at the stages, (n_s, n_x); the last one is the right end.
        slopes: dx/dt at the stages, (n_s, n_x).
        z: algebraic variables at the stages, (n_s, n_z).
        G, H: both sides of the pairs at the stages, (n_s, n_pairs).
        residual: largest residual.
        iterations: of Newton's method.
    """

    h: float
    x: np.ndarray
    slopes: np.ndarray
    z: np.ndarray
    G: np.ndarray
    H: np.ndarray
    residual: float
    iterations: int


@dataclass(frozen=True, eq=False)
class OneElement:
    """The square system of one finite element whose mode m is a parameter.

    ``E(X_j) K_j = f(X_j, u, Z_j)``, ``X_j = X_0 + h sum_r a_jr K_r``, ``0 = g``, ``0 = e`` and
    ``m_i G_i + (1 - m_i) H_i = 0`` at every stage.

    Args:
        system: the dynamics, without vanishing constraints.
        tableau: a collocation scheme whose last stage is the right end.
    """

    system: ComplementaritySystem
    tableau: Tableau

    @classmethod
    def of(cls, system: ComplementaritySystem, tableau: Tableau) -> OneElement:
        """Return the equations of a system, whose functions are compiled once."""
        return system.compiled.setdefault((cls, tableau.stages), cls(system, tableau))

    @property
    def stages(self) -> int:
        """n_s."""
        return self.tableau.stages

    @cached_property
    def _symbols(self) -> tuple[list[ca.SX], ca.SX, ca.SX]:
        """Arguments, rows, and (X, G, H) of all stages as columns."""
        system, functions = self.system, SystemFunctions.of(self.system)
        n_x, n_z, s = system.state.numel(), system.algebraic.numel(), self.stages
        y, x_left, h = ca.SX.sym("y", n_x + n_z, s), ca.SX.sym("x", n_x), ca.SX.sym("h")
        u, p = ca.SX.sym("u", system.control.numel()), ca.SX.sym("p", system.parameters.numel())
        m = ca.SX.sym("m", len(system.pairs))
        slopes = [y[:n_x, j] for j in range(s)]
        rows, values = [], []
        for j in range(s):
            x, z = x_left + h * sum(a * K for a, K in zip(self.tableau.A[j], slopes, strict=True)), y[n_x:, j]
            E, f = functions.dynamics(x, u, z, p)
            G, H = functions.sides(z)
            rows += [ca.mtimes(E, slopes[j]) - f, functions.residual(x, u, z, p), functions.equations(x, u, z, p)]
            rows.append(m * G + (1 - m) * H)
            values.append(ca.vertcat(x, G, H))
        arguments = [ca.vec(y), x_left, h, u, p, m]
        return arguments, ca.vertcat(*rows), ca.horzcat(*values)

    @cached_property
    def _rows(self) -> DenseFunction:
        arguments, rows, _ = self._symbols
        return DenseFunction("rows", arguments, [rows])

    @cached_property
    def _derivative(self) -> DenseFunction:
        arguments, rows, _ = self._symbols
        return DenseFunction("derivative", arguments, [rows, ca.jacobian(rows, arguments[0])])

    @cached_property
    def _by_length(self) -> DenseFunction:
        arguments, rows, values = self._symbols
        n_x, n_pairs = self.system.state.numel(), len(self.system.pairs)
        G_end = values[n_x : n_x + n_pairs, -1]
        return DenseFunction(
            "by_length",
            arguments,
            [
                rows,
                ca.jacobian(rows, arguments[0]),
                ca.jacobian(rows, arguments[2]),
                G_end,
                ca.jacobian(G_end, arguments[0]),
            ],
        )

    @cached_property
    def _values(self) -> DenseFunction:
        arguments, _, values = self._symbols
        return DenseFunction("values", arguments, [values])

    def predict(self, last: SolvedElement, h: float) -> np.ndarray:
        """Return a start for the element after a solved one in the same mode: its polynomial, continued, (n_s, n_y)."""
        return self.continued(last, 1.0 + h / last.h * self.tableau.c)

    def continued(self, solved: SolvedElement, fractions: np.ndarray) -> np.ndarray:
        """Return slopes and z of an element's polynomial at fractions of it, also outside, (m, n_y)."""
        powers = np.vander(fractions, self.stages, increasing=True)
        return np.asarray(powers @ (self.coefficients @ np.hstack([solved.slopes, solved.z])))

    @cached_property
    def coefficients(self) -> np.ndarray:
        """From values at the stages to the coefficients of their polynomial, lowest power first, (n_s, n_s)."""
        return np.asarray(np.linalg.inv(np.vander(self.tableau.c, increasing=True)))

    @cached_property
    def coefficients_with_left(self) -> np.ndarray:
        """The same for values at the left boundary and the stages, (n_s + 1, n_s + 1)."""
        return np.asarray(np.linalg.inv(np.vander(self.tableau.nodes, increasing=True)))

    @cached_property
    def samples(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places in an element, and what interpolates there from left and stages, and from the stages alone."""
        places = np.unique(np.concatenate([np.arange(1, SAMPLES + 1) / SAMPLES, self.tableau.c]))
        return places, lagrange(self.tableau.nodes, places), lagrange(self.tableau.c, places)

    @cached_property
    def to_left(self) -> np.ndarray:
        """What extrapolates values at the stages to the left boundary, (n_s)."""
        return np.asarray(lagrange(self.tableau.c, np.array([0.0]))[0])

    def constant(self, rate: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return a start with the same slope and algebraic variables at all stages, (n_s, n_y)."""
        return np.tile(np.concatenate([rate, z]), (self.stages, 1))

    def solve(
        self, start: np.ndarray, x: np.ndarray, h: float, u: np.ndarray, p: np.ndarray, mode: np.ndarray
    ) -> SolvedElement | None:
        """Return the element of length h from x, or None where Newton's method does not converge.

        The derivative is kept as long as the residual falls fast.

        Args:
            start: slopes and z at the stages, (n_s, n_x + n_z).
            x, h, u, p: left state, length, control, parameters.
            mode: (n_pairs) booleans, where G vanishes.
        """
        y, m, factors = start.ravel().copy(), mode.astype(float), None
        residual = np.inf
        for iteration in range(MAX_ITERATIONS):
            if factors is None:
                rows, jacobian = self._derivative(y, x, h, u, p, m)
                factors = _Factors(jacobian)
                fresh = True
            else:
                (rows,) = self._rows(y, x, h, u, p, m)
                fresh = False
            size, scale = dnrm2(rows), 1.0 + dnrm2(y)
            if not size < np.inf:
                return None
            if size <= SOLVED_RESIDUAL * scale:
                return self._solved(y, x, h, u, p, m, size, iteration)
            if not fresh and size > 0.2 * residual:
                factors = None
                if size > 1e3 * residual:
                    return None
                residual = size
                continue
            residual = size
            step = factors.solve(rows)
            if step is None:
                return None
            y -= step
        return None

    def solve_to_zero(
        self, start: SolvedElement, x: np.ndarray, h: float, u: np.ndarray, p: np.ndarray, mode: np.ndarray, pair: int
    ) -> SolvedElement | None:
        """Return the element that ends where G of a pair is zero, its length an unknown.

        Args:
            start: a solved element that passes the zero.
            x, u, p, mode: as in `solve`.
            h: about the length.
            pair: number of the pair.
        """
        y, m = self.continued(start, h / start.h * self.tableau.c).ravel(), mode.astype(float)
        n, longest = len(y), 2.0 * start.h
        full = np.zeros((n + 1, n + 1), order="F")
        for iteration in range(MAX_ITERATIONS):
            rows, jacobian, by_h, G, by_y = self._by_length(y, x, h, u, p, m)
            value = np.append(rows, G[pair])
            size, scale = dnrm2(value), 1.0 + dnrm2(y)
            if not size < np.inf:
                return None
            if size <= SOLVED_RESIDUAL * scale:
                return self._solved(y, x, h, u, p, m, size, iteration)
            full[:n, :n], full[:n, n], full[n, :n] = jacobian, by_h, by_y[pair]
            step = _Factors(full).solve(value)
            if step is None:
                return None
            y, h = y - step[:n], float(np.clip(h - step[n], -0.1 * start.h, longest))
        return None

    def _solved(
        self, y: np.ndarray, x: np.ndarray, h: float, u: np.ndarray, p: np.ndarray, m: np.ndarray, size: float, n: int
    ) -> SolvedElement:
        n_x, n_pairs = len(x), len(m)
        (values,) = self._values(y, x, h, u, p, m)
        own, at = y.reshape(self.stages, -1), values.T
        return SolvedElement(
            h,
            at[:, :n_x].copy(),
            own[:, :n_x].copy(),
            own[:, n_x:].copy(),
            at[:, n_x : n_x + n_pairs].copy(),
            at[:, n_x + n_pairs :].copy(),
            size,
            n,
        )


class _Factors:
    """A factorised square matrix; a singular one solves by least norm."""

    def __init__(self, matrix: np.ndarray) -> None:
        self._lu, self._pivots, info = dgetrf(matrix)
        diagonal = [abs(entry) for entry in self._lu.diagonal().tolist()]  # faster than arrays of a few entries
        self._singular = info != 0 or not min(diagonal) > 1e-14 * max(diagonal)
        self._matrix = matrix.copy() if self._singular else matrix

    def solve(self, right: np.ndarray) -> np.ndarray | None:
        if not self._singular:
            return np.asarray(dgetrs(self._lu, self._pivots, right)[0])
        if not np.isfinite(self._matrix).all():
            return None
        try:
            return np.asarray(np.linalg.lstsq(self._matrix, right, rcond=SINGULAR_STEP)[0])
        except np.linalg.LinAlgError:
            return None
