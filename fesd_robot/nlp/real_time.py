"""Interior-point steps in two halves: all that can be done before a measurement, and what comes after it.

The numbers that a measurement brings, as the state in which a motion begins, are values of fixed variables. Functions,
derivatives and the factors of the KKT matrix do not wait for them; afterwards there is one right-hand side.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from scipy import sparse

from fesd_robot.errors import SolverError
from fesd_robot.native import kkt_library
from fesd_robot.native.linear_solver import RepeatedKktSystem
from fesd_robot.nlp.nlp import Nlp, NlpNumbers

BARRIER = 1e-4
"""Product of a multiplier and the distance from its bound."""

STRENGTH = 1e3
"""Multiplier above which a bound gives way."""

PROXIMITY, STRONGEST = 1e-8, 1e4
"""Weight of the step, which decides variables on which nothing depends, and the strongest one that is tried."""

SMALLER = 0.85
"""Order of a KKT matrix as a part of the last one's, from which on it is worth one of its own."""

REGULARISATION = 1e-9
"""Of equality rows, which may depend on each other; it acts on changes of their multipliers only."""

PIVOT = 1e-6
"""Least pivot, as a part of its column."""

TO_BOUNDARY = 0.9
"""How much of the way to the boundary a step takes at most."""

BLOCKED = 0.5
"""Share of a step below which a longer one is looked for."""

LESS = 0.1
"""By how much a longer step lessens violations, as a part of what its linear model promises."""

NEAREST = 0.1
"""Least distance from a bound that a point begins with, as a part of what belongs to its multiplier."""

FIRST = 1e-3
"""Distance from bounds at which iterates without multipliers begin, at least."""


@dataclass(frozen=True)
class PrimalDual:
    """A primal-dual point.

    Attributes:
        x: variables, (n).
        slack: values that inequality rows are meant to have, (m_i).
        lam: multipliers of all bounded rows, (m).
        z: multipliers of bounds, between 0 and the strength of these, (b).
        inside, beyond: distances t and e from a bound, of which t - e is how far a value is inside of it, (b).
    """

    x: np.ndarray
    slack: np.ndarray
    lam: np.ndarray
    z: np.ndarray
    inside: np.ndarray
    beyond: np.ndarray


@dataclass(frozen=True)
class Step:
    """Where a step leads.

    Attributes:
        iterate: behind it.
        share: how much of it was taken, 1 unless a bound was in the way.
    """

    iterate: PrimalDual
    share: float


class RealTimeInteriorPoint:
    """Newton steps on the primal-dual equations of one NLP with a fixed barrier parameter.

        min f(x) + rho sum(e) - mu sum(log(t) + log(e))
        subject to  c_E(x) = b,  c_I(x) = s,  t - e = distances of x and s from their bounds

    The equations are smooth: their solution is a smooth function of the fixed variables, and one step with the exact
    Hessian follows it to second order. Equality rows are met to round-off; bounds are kept at a distance of mu over
    their multiplier, and give way where nothing else can.

    Args:
        nlp: the program.
        numbers: its bounds and parameters; variables whose bounds agree are fixed, at values that a step is given.
        elastic: numbers of fixed variables that are not: they are held by bounds, which may give way.
        barrier: mu.
        strength: rho.

    Raises:
        SolverError: the linear solver cannot be compiled.

    Source: Waechter, Biegler, On the implementation of an interior-point filter line-search algorithm for large-scale
    nonlinear programming, 2006; Zanelli, Quirynen, Jerez, Diehl, A homotopy-based nonlinear interior-point method for
    NMPC, 2017; Diehl, Bock, Schloeder, A real-time iteration scheme for nonlinear optimization in optimal feedback
    control, 2005.
    """

    def __init__(
        self,
        nlp: Nlp,
        numbers: NlpNumbers,
        elastic: np.ndarray | None = None,
        barrier: float = BARRIER,
        strength: float = STRENGTH,
    ) -> None:
        library = kkt_library()
        if library is None:
            raise SolverError("steps in real time need a C++ compiler (the log says what failed)")
        self.size, self.barrier, self.strength = nlp.size, barrier, strength
        self._always_fixed = numbers.lower == numbers.upper
        if elastic is not None:
            self._always_fixed[elastic] = False
        self._p = numbers.p
        self._rows = np.flatnonzero(np.isfinite(numbers.g_lower) | np.isfinite(numbers.g_upper))
        self._m, self._all_rows = len(self._rows), nlp.rows
        lower, upper = numbers.g_lower[self._rows], numbers.g_upper[self._rows]
        self._unequal = np.flatnonzero(lower != upper)
        self._is_equal = lower == upper
        self._equal = np.flatnonzero(self._is_equal)
        self._own_target = self._target = np.where(lower == upper, lower, 0.0)
        free_lower, free_upper = (np.where(self._always_fixed, np.nan, each) for each in (numbers.lower, numbers.upper))
        self._bounds = _Bounds(
            np.concatenate([free_lower, lower[self._unequal]]), np.concatenate([free_upper, upper[self._unequal]])
        )
        self._cost, self._of_rows = _Buffered(nlp.nlp, 0), _Buffered(nlp.nlp, 1)
        self._of_cost, self._first_order = _Buffered(nlp.gradient, 1), _Buffered(nlp.jacobian, 0, 1)
        self._second_order = _Buffered(nlp.hessian, 0)
        self._library = library
        self._set_pattern(nlp)
        self._systems = list[_KktMatrix]()
        self.analyse(np.zeros(self.size, dtype=bool), np.zeros(0, dtype=int))

    def renumber(self, numbers: NlpNumbers) -> None:
        """Let the program have other bounds and parameters; what is bounded, equal and fixed stays so."""
        lower, upper = numbers.g_lower[self._rows], numbers.g_upper[self._rows]
        self._p = numbers.p
        self._own_target = self._target = np.where(lower == upper, lower, 0.0)
        self._bounds.move(
            np.concatenate([numbers.lower, lower[self._unequal]]), np.concatenate([numbers.upper, upper[self._unequal]])
        )

    def restrict(self, passed: np.ndarray, left_out: np.ndarray) -> None:
        """Fix further variables at their values, and leave out the rows and the bounds of fixed ones alone.

        Args:
            passed: which variables, (n) of bool; none of earlier calls stay fixed.
            left_out: numbers of further rows that are left out.
        """
        in_matrix = self._leave_out(passed, left_out)
        self._system = next(each for each in reversed(self._systems) if not in_matrix[~each.kept].any())

    def analyse(self, passed: np.ndarray, left_out: np.ndarray) -> bool:
        """Make a smaller KKT matrix ready for whenever these variables, or more of them, have passed.

        Returns:
            Whether it is so much smaller than the last one that it was made.
        """
        in_matrix = self._leave_out(passed, left_out)
        if self._systems and in_matrix.sum() > SMALLER * self._systems[-1].kept.sum():
            return False
        self._system = _KktMatrix(self._row, self._column, in_matrix, self.size, self._library)
        self._systems.append(self._system)
        return True

    def settle(self, iterate: PrimalDual) -> None:
        """Choose the order of elimination in the KKT matrix for its pivots at an iterate, and keep it."""
        self.prepare(iterate)
        self._system.settle()

    def _leave_out(self, passed: np.ndarray, left_out: np.ndarray) -> np.ndarray:
        """Take note of what `restrict` fixes and leaves out; return what is left of the KKT matrix, (n + m) of bool."""
        self.fixed = self._always_fixed | passed
        free = ~self.fixed[self._jacobian_columns]
        live = np.bincount(self._jacobian_rows, free, minlength=self._m) > 0
        live[np.searchsorted(self._rows, left_out)] = False
        self._inert = np.flatnonzero(~live)
        self._inert_unequal = np.flatnonzero(~live[self._unequal])
        self._dead_curvature = np.flatnonzero(self.fixed[self._hessian_rows] | self.fixed[self._hessian_columns])
        self._dead_slopes = np.flatnonzero(~(free & live[self._jacobian_rows]))
        self._live = np.concatenate([~self.fixed, live[self._unequal]])[self._bounds.places]
        return np.concatenate([~self.fixed, live])

    def hold(self, rows: np.ndarray, x: np.ndarray) -> None:
        """Let equality rows keep the values that they have at a point; others have those of the program.

        Args:
            rows: their numbers among all rows; those that are inequalities are left as they are.
            x: (n).
        """
        self._target = self._own_target.copy()
        chosen = np.searchsorted(self._rows, rows)
        chosen = chosen[self._is_equal[chosen]]
        self._target[chosen] = self._values(x)[chosen]

    def shift(self, rows: np.ndarray, amount: float) -> None:
        """Let rows have values that are larger by an amount than those of the program."""
        chosen = np.searchsorted(self._rows, rows)
        self._target[chosen] = self._own_target[chosen] + amount

    @property
    def bounds(self) -> int:
        """Number b of bounds of variables and inequality rows."""
        return len(self._bounds.places)

    @property
    def bounded_rows(self) -> np.ndarray:
        """Numbers of the rows that have multipliers among all rows, (m)."""
        return self._rows

    def columns_of_rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Return numbers of rows and of the variables on which they depend, pair by pair."""
        return self._rows[self._jacobian_rows], self._jacobian_columns

    def at(self, x: np.ndarray, like: PrimalDual | None = None) -> PrimalDual:
        """Return an iterate at a point.

        Args:
            x: (n).
            like: an iterate whose multipliers it has; default: those that leave the least of the gradient.
        """
        slack = self._values(x)[self._unequal]
        if like is not None:
            return self._with_distances(x, slack, like.lam, like.z)
        h = self._bounds.inside(np.concatenate([x, slack]))
        z = self.barrier / np.maximum(h, FIRST)
        at = self._with_distances(x, slack, np.zeros(self._m), z)
        self.prepare(at)
        identity = np.where(self._hessian_rows == self._hessian_columns, 1.0, 0.0)
        self._factorise(identity)
        pull = self._bounds.spread(z)
        of_rows = np.zeros(self._m)
        of_rows[self._unequal] = pull[self.size :] / self._weights[self.size :]
        of_x = np.where(self.fixed, 0.0, pull[: self.size] - self._gradient)
        lam = self._solve(np.concatenate([of_x, of_rows]))[self.size :]
        return replace(at, lam=lam)

    def renumbering(self, variables: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers of what takes the place of multipliers of rows, (m), and of bounds, (b); -1 for nothing.

        Args:
            variables: of every variable, (n), the one that takes its place; -1 where none does.
            rows: of every row of the program, likewise.
        """
        place = np.full(self._all_rows + 1, -1)
        place[self._rows] = np.arange(self._m)
        of_rows = place[rows[self._rows]]
        unequal = np.full(self._m + 1, -1)
        unequal[self._unequal] = self.size + np.arange(len(self._unequal))
        return of_rows, self._bounds.renumbering(np.concatenate([variables, unequal[of_rows[self._unequal]]]))

    def violation(self, x: np.ndarray) -> tuple[float, float]:
        """Return the largest violation of equality rows at a point, and that of bounds."""
        rows, bounds = self._violations(x)
        return float(rows.max(initial=0.0)), float(bounds.max(initial=0.0))

    def objective(self, x: np.ndarray) -> float:
        """Return the objective at a point."""
        return float(self._cost(x, self._p)[0][0])

    def prepare(self, iterate: PrimalDual) -> None:
        """Evaluate all functions at an iterate, and factorise its KKT matrix."""
        self._prepared, x, lam = iterate, iterate.x, np.zeros(self._all_rows)
        lam[self._rows] = iterate.lam
        self._jacobian = self._evaluate(iterate)
        self._hessian = self._second_order(x, self._p, 1.0, lam)[0][self._upper_half]
        self._softness = iterate.inside / iterate.z + iterate.beyond / (self.strength - iterate.z)
        self._weights = self._bounds.spread(1.0 / self._softness, signed=False)
        self._factorise(self._hessian)

    def _evaluate(self, iterate: PrimalDual) -> np.ndarray:
        """Evaluate what the right-hand side needs at an iterate; return the entries of the Jacobian."""
        x = iterate.x
        rows, slopes = self._first_order(x, self._p)
        self._g, slopes = rows[self._rows], slopes[self._kept]
        self._gradient = self._of_cost(x, self._p)[0].copy()
        self._lagrangian = self._gradient + self._slopes.transposed(slopes, iterate.lam)
        return slopes

    def step(self, moved: np.ndarray | None = None) -> Step:
        """Return the Newton step at the prepared iterate, as far as the bounds allow.

        Args:
            moved: by how much fixed variables move, (n), zero at all others; default: none does.
        """
        own, mu, rho, n = self._prepared, self.barrier, self.strength, self.size
        moved = np.zeros(n) if moved is None else moved
        centred_inside = mu / own.z - own.inside
        centred_beyond = mu / (rho - own.z) - own.beyond
        pull = self._bounds.spread(own.z + (centred_inside - centred_beyond) / self._softness)
        of_x = pull[:n] - self._lagrangian
        of_rows = self._target - self._g
        of_slack = own.lam[self._unequal] + pull[n:]
        of_rows[self._unequal] += own.slack + of_slack / self._weights[n:]
        if moved.any():
            of_x -= self._curvature(moved)
            of_rows -= self._slopes.times(self._jacobian, moved)
        of_x[self.fixed] = 0.0
        of_rows[self._inert] = 0.0
        solution = self._solve(np.concatenate([of_x, of_rows]))
        d = self._directions(solution, of_slack, centred_inside, centred_beyond)
        step = _along(own, moved, d, rho)
        further = self._further(moved, d, step) if step.share < BLOCKED else None
        return step if further is None else further

    def _directions(
        self, solution: np.ndarray, of_slack: np.ndarray, centred_inside: np.ndarray, centred_beyond: np.ndarray
    ) -> PrimalDual:
        """Return by how much all parts of an iterate change with a solution of the KKT system."""
        own, n = self._prepared, self.size
        x, lam = solution[:n], solution[n:]
        x[self.fixed], lam[self._inert] = 0.0, 0.0
        slack = (lam[self._unequal] + of_slack) / self._weights[n:]
        slack[self._inert_unequal] = 0.0
        towards = self._bounds.signs * np.concatenate([x, slack])[self._bounds.places]
        z = (centred_inside - centred_beyond - towards) / self._softness
        z[~self._live] = 0.0
        inside = centred_inside - own.inside / own.z * z
        beyond = centred_beyond + own.beyond / (self.strength - own.z) * z
        inside[~self._live] = beyond[~self._live] = 0.0
        return PrimalDual(x, slack, lam, z, inside, beyond)

    def _further(self, moved: np.ndarray, d: PrimalDual, blocked: Step) -> Step | None:
        """Return a longer step, for which bounds give way, if it violates equality rows and bounds less."""
        own, kept = self._prepared, 1 - TO_BOUNDARY
        start = own.x + moved
        nearest, at_start = self._beyond(blocked.iterate.x), self._beyond(start)
        z = np.clip(own.z + d.z, kept * own.z, self.strength - kept * (self.strength - own.z))
        longer = 1.0
        while longer > blocked.share:
            x = start + longer * d.x
            if self._beyond(x) < min(nearest, (1 - LESS * longer) * at_start):
                slack, lam = own.slack + longer * d.slack, own.lam + longer * d.lam
                return Step(self._with_distances(x, slack, lam, own.z + longer * (z - own.z)), longer)
            longer *= 0.5
        return None

    def _with_distances(self, x: np.ndarray, slack: np.ndarray, lam: np.ndarray, z: np.ndarray) -> PrimalDual:
        """Return a point whose distances from bounds belong to its values, and nearly to its multipliers."""
        h = self._bounds.inside(np.concatenate([x, slack]))
        nearest, beyond = NEAREST * self.barrier / z, self.barrier / (self.strength - z)
        return PrimalDual(x, slack, lam, z, np.maximum(nearest, h + beyond), np.maximum(beyond, nearest - h))

    def sensitivity(self, of: np.ndarray, to: np.ndarray) -> np.ndarray:
        """Return the derivatives of variables of the solution by fixed ones, (len(of), len(to)).

        Args:
            of: numbers of variables.
            to: numbers of fixed variables.
        """
        columns = []
        for fixed in to:
            moved = np.zeros(self.size)
            moved[fixed] = 1.0
            of_x = np.where(self.fixed, 0.0, -self._curvature(moved))
            of_rows = -self._slopes.times(self._jacobian, moved)
            of_rows[self._inert] = 0.0
            columns.append(self._solve(np.concatenate([of_x, of_rows]))[of])
        return np.array(columns).T

    def _beyond(self, x: np.ndarray) -> float:
        """Return the sum of the violations of equality rows and bounds."""
        return float(sum(each.sum() for each in self._violations(x)))

    def _violations(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rows = self._values(x)
        h = self._bounds.inside(np.concatenate([x, rows[self._unequal]]))
        of_rows = np.abs(rows - self._target)
        of_rows[self._inert] = 0.0
        return of_rows[self._equal], np.where(self._live, np.maximum(-h, 0.0), 0.0)

    def _values(self, x: np.ndarray) -> np.ndarray:
        """Return the values of rows that are bounded, (m)."""
        return self._of_rows(x, self._p)[0][self._rows]

    def _set_pattern(self, nlp: Nlp) -> None:
        rows, columns = (np.array(part, dtype=int) for part in nlp.jacobian.sparsity_out(1).get_triplet())
        place = np.full(nlp.rows, -1)
        place[self._rows] = np.arange(self._m)
        self._kept = np.flatnonzero(place[rows] >= 0)
        self._jacobian_rows, self._jacobian_columns = place[rows[self._kept]], columns[self._kept]
        rows, columns = (np.array(part, dtype=int) for part in nlp.hessian.sparsity_out(0).get_triplet())
        self._upper_half = np.flatnonzero(rows <= columns)
        self._hessian_rows, self._hessian_columns = rows[self._upper_half], columns[self._upper_half]
        n, m = self.size, self._m
        self._curves = _Entries(self._hessian_rows, self._hessian_columns, (n, n))
        self._slopes = _Entries(self._jacobian_rows, self._jacobian_columns, (m, n))
        self._row = np.concatenate([self._hessian_rows, np.arange(n), self._jacobian_columns, n + np.arange(m)])
        self._column = np.concatenate([self._hessian_columns, np.arange(n), n + self._jacobian_rows, n + np.arange(m)])

    def _factorise(self, hessian: np.ndarray) -> None:
        """Factorise the KKT matrix; where it curves downwards, steps get a weight."""
        rows = np.full(self._m, -REGULARISATION)
        rows[self._unequal] = -1.0 / self._weights[self.size :]
        rows[self._inert] = -1.0
        curvature, slopes = hessian.copy(), self._jacobian.copy()
        curvature[self._dead_curvature] = 0.0
        slopes[self._dead_slopes] = 0.0
        self.proximity = PROXIMITY
        while True:
            diagonal = self._weights[: self.size] + self.proximity
            diagonal[self.fixed] = 1.0
            negative = self._system.factorise(np.concatenate([curvature, diagonal, slopes, rows]))
            if negative == 0 or self.proximity > STRONGEST:
                break
            self.proximity = max(100 * self.proximity, 1e-4)
        self._parts = curvature, diagonal, slopes, rows

    def _solve(self, right: np.ndarray) -> np.ndarray:
        """Return the solution of the KKT system, refined once."""
        curvature, diagonal, slopes, rows = self._parts
        solution = self._system.solve(right)
        x, lam = solution[: self.size], solution[self.size :]
        of_x = self._curves.symmetric(curvature, x) + diagonal * x + self._slopes.transposed(slopes, lam)
        of_rows = self._slopes.times(slopes, x) + rows * lam
        return solution + self._system.solve(right - np.concatenate([of_x, of_rows]))

    def _curvature(self, d: np.ndarray) -> np.ndarray:
        """Return H d."""
        return self._curves.symmetric(self._hessian, d)


class _Entries:
    """Where the entries of a sparse matrix are, column by column.

    Args:
        rows, columns: of the entries, by columns.
        shape: of the matrix.
    """

    def __init__(self, rows: np.ndarray, columns: np.ndarray, shape: tuple[int, int]) -> None:
        ends = np.searchsorted(columns, np.arange(shape[1] + 1))
        self._by_columns = sparse.csc_matrix((np.zeros(len(rows)), rows, ends), shape=shape)
        self._by_rows = sparse.csr_matrix((np.zeros(len(rows)), rows, ends), shape=shape[::-1])
        self._on_diagonal = np.flatnonzero(rows == columns)
        self._places = columns[self._on_diagonal]

    def times(self, values: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return A x of the matrix with these values."""
        self._by_columns.data = values
        return np.asarray(self._by_columns @ x)

    def transposed(self, values: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return A^T x."""
        self._by_rows.data = values
        return np.asarray(self._by_rows @ x)

    def symmetric(self, values: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return (A + A^T - diagonal of A) x, of a symmetric matrix of which this is the upper half."""
        result = self.times(values, x) + self.transposed(values, x)
        result[self._places] -= values[self._on_diagonal] * x[self._places]
        return result


class _Bounds:
    """All finite bounds of some values, one after the other.

    Attributes:
        places: numbers of the values, (b).
        signs: 1 of lower bounds, -1 of upper ones, (b).
    """

    def __init__(self, lower: np.ndarray, upper: np.ndarray) -> None:
        low, high = np.flatnonzero(np.isfinite(lower)), np.flatnonzero(np.isfinite(upper))
        self._count = len(lower)
        self._low, self._high = low, high
        self.places = np.concatenate([low, high])
        self.signs = np.concatenate([np.ones(len(low)), -np.ones(len(high))])
        self.move(lower, upper)

    def move(self, lower: np.ndarray, upper: np.ndarray) -> None:
        """Let the bounds have other values."""
        self._at = np.concatenate([lower[self._low], upper[self._high]])

    def renumbering(self, values: np.ndarray) -> np.ndarray:
        """Return the numbers of the bounds that take their places, (b), by those of values; -1 where none does."""
        found = np.full((2, self._count + 1), -1)
        upper = (self.signs < 0).astype(int)
        found[upper, self.places] = np.arange(len(self.places))
        return found[upper, values[self.places]]

    def inside(self, values: np.ndarray) -> np.ndarray:
        """Return how far values are inside of their bounds, (b)."""
        return self.signs * (values[self.places] - self._at)

    def spread(self, of_bounds: np.ndarray, *, signed: bool = True) -> np.ndarray:
        """Return the sums of what bounds have, by value."""
        amounts = self.signs * of_bounds if signed else of_bounds
        return np.bincount(self.places, amounts, minlength=self._count)


class _KktMatrix:
    """A part of the KKT matrix, analysed once; of what is not in it the solution is the right-hand side.

    Attributes:
        kept: which variables and rows are in it, (n + m) of bool.
    """

    def __init__(self, row: np.ndarray, column: np.ndarray, kept: np.ndarray, size: int, library: Any) -> None:
        self.kept = kept
        place = np.cumsum(kept) - 1
        self._entries = np.flatnonzero(kept[row] & kept[column])
        row, column = place[row[self._entries]], place[column[self._entries]]
        self._system = RepeatedKktSystem(row, column, int(kept.sum()), library)
        self._negative = int(kept[size:].sum())

    def factorise(self, values: np.ndarray) -> int | None:
        """Return how many negative eigenvalues the matrix has more than rows, 0 if it is convex along these.

        A singular matrix has None.
        """
        negative = self._system.factorize(values[self._entries], PIVOT)
        return None if negative is None else negative - self._negative

    def settle(self) -> None:
        """Keep the order of elimination that is best for the pivots of the last factorisation."""
        self._system.settle()

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Return the solution of the system."""
        result = right.copy()
        result[self.kept] = self._system.solve(right[self.kept])
        return result


class _Buffered:
    """A CasADi function that reads and writes arrays of nonzeros in place.

    Args:
        function: what is called.
        wanted: numbers of its outputs that are computed.
    """

    def __init__(self, function: ca.Function, *wanted: int) -> None:
        self._buffer, self._call = function.buffer()
        buffer: Any = self._buffer
        self._inputs = [np.zeros(function.nnz_in(i)) for i in range(function.n_in())]
        self._outputs = [np.zeros(function.nnz_out(i)) for i in wanted]
        for i, each in enumerate(self._inputs):
            buffer.set_arg(i, each.data)
        for i, each in zip(wanted, self._outputs, strict=True):
            buffer.set_res(i, each.data)

    def __call__(self, *values: np.ndarray | float) -> list[np.ndarray]:
        for own, value in zip(self._inputs, values, strict=True):
            own[:] = value
        self._call()
        return self._outputs


def _along(own: PrimalDual, moved: np.ndarray, d: PrimalDual, strength: float) -> Step:
    """Return the step from an iterate whose fixed variables move, as far as bounds allow."""
    share = min(_share(own.inside, d.inside), _share(own.beyond, d.beyond))
    of_multipliers = min(_share(own.z, d.z), _share(strength - own.z, -d.z))
    step = PrimalDual(
        own.x + moved + share * d.x,
        own.slack + share * d.slack,
        own.lam + share * d.lam,
        own.z + of_multipliers * d.z,
        own.inside + share * d.inside,
        own.beyond + share * d.beyond,
    )
    return Step(step, share)


def _share(values: np.ndarray, d: np.ndarray) -> float:
    """Return how much of a step keeps positive values positive."""
    falls = d < 0
    return min(1.0, TO_BOUNDARY * float((-values[falls] / d[falls]).min(initial=np.inf)))
