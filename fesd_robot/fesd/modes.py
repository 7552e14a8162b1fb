"""The equations of a control interval when it is prescribed which side of every pair is zero in every element.

With the active sides fixed the complementarity conditions become equations and the interval a square system in its own
variables: Newton's method solves it to round-off, and its derivative gives the sensitivities.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import structural_rank
from scipy.sparse.linalg import splu

from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.errors import SolverError
from fesd_robot.exactness import SINGULAR_STEP
from fesd_robot.fesd.element import ElementPoints, SystemFunctions, element_equations, read_elements
from fesd_robot.fesd.impulse_functions import impulse_function, jump_function
from fesd_robot.fesd.layout import IntervalLayout, layout_of
from fesd_robot.fesd.options import FesdOptions
from fesd_robot.fesd.schemes import lagrange

Modes = np.ndarray
"""(elements, n_pairs) booleans, or (elements * n_s, n_pairs) without switch detection: True where H_i may be positive
and G_i is zero, False where it is the other way round. Behind those of the pairs, of a system that jumps, is one for
every impulse: whether it acts at the left boundary of the element."""

LARGEST_DENSE = 400
"""Up to this number of unknowns a step is solved with dense matrices."""


@dataclass(frozen=True)
class NewtonResult:
    """The own variables of an interval after Newton's method.

    Attributes:
        own: u and the variables that were solved for.
        residual: largest residual.
        iterations: Newton iterations.
        converged: whether the residual is below the tolerance.
    """

    own: np.ndarray
    residual: float
    iterations: int
    converged: bool


@dataclass(frozen=True)
class ModeEquations:
    """The square system of one control interval for prescribed modes.

    Unknowns are the steps and all points of the interval. Equations are the scheme's; in every element n and pair i
    either G_i = 0 or H_i = 0 at its points; sum_n h_n = length; and at each inner boundary, if the modes of both sides
    are the same ``h_{n+1} = h_n``, if pairs become active ``sum G_i = 0`` over those, at the boundary, and if pairs
    only leave ``sum H_i = 0`` over those, extrapolated to the boundary. (Signs make each term of a sum vanish.)
    Where an impulse acts, its law is zero, else the impulse is, and G of its pair counts as one that becomes active.
    Without switch detection the steps are fixed instead and every stage has a mode of its own.

    Args:
        system: the dynamics; vanishing constraints are not known here.
        options: scheme and form.
        elements: number of elements.
    """

    system: ComplementaritySystem
    options: FesdOptions
    elements: int

    @cached_property
    def layout(self) -> IntervalLayout:
        """Order of the variables."""
        return layout_of(self.system, self.options, self.elements)

    @property
    def cells(self) -> int:
        """Number of modes of the interval."""
        return self.elements if self.options.switch_detection else self.elements * self.layout.stages

    @property
    def points(self) -> int:
        """Number of points with algebraic variables in an element."""
        return self.layout.stages + self.layout.end_algebraic

    @property
    def pairs(self) -> int:
        """Number n_pairs of complementarity pairs."""
        return len(self.system.pairs)

    @cached_property
    def fractions(self) -> np.ndarray:
        """Where the points of an element sit between its boundaries, (points,)."""
        return np.append(self.options.tableau.c, 1.0)[: self.points]

    @cached_property
    def sign_checked(self) -> np.ndarray:
        """At which points the sign of G counts, (points,).

        A stage that shares its node with a boundary without being the boundary's state is no second opinion on the
        sign there: its state is off by the stage order of the scheme, which is enough to fall on the wrong side.
        """
        tableau = self.options.tableau
        inner = (self.fractions > 0.0) & (self.fractions < 1.0)
        inner[-1] |= tableau.ends_at_stage or self.layout.end_algebraic
        inner[0] |= tableau.starts_at_stage
        return inner if self.options.switch_detection else np.ones(self.points, dtype=bool)

    @cached_property
    def to_left(self) -> np.ndarray:
        """What extrapolates values at the stages to the left boundary of an element, (n_s)."""
        return self._extrapolation(0.0)

    @cached_property
    def to_right(self) -> np.ndarray:
        """What extrapolates values at the stages to the right boundary of an element, (n_s)."""
        return self._extrapolation(1.0)

    def _extrapolation(self, fraction: float) -> np.ndarray:
        distinct, first = np.unique(self.options.tableau.c, return_index=True)
        weights = np.zeros(self.layout.stages)
        weights[first] = lagrange(distinct, np.array([fraction]))[0]
        return weights

    @cached_property
    def _symbols(self) -> tuple[ca.SX, ca.SX, ca.SX, list[ElementPoints]]:
        left, own = ca.SX.sym("left", self.layout.n_x), ca.SX.sym("own", self.layout.size)
        p = ca.SX.sym("p", self.system.parameters.sparsity())
        padded = ca.vertcat(left, ca.SX.zeros(self.layout.n_z))
        return left, own, p, read_elements(self.layout, self.options.tableau, padded, own)

    @cached_property
    def _rows(self) -> ca.SX:
        """All rows that modes choose from: scheme, steps, G, H by point, H at the right ends."""
        _, own, p, parts = self._symbols
        functions, jump = SystemFunctions.of(self.system), self._jump
        u = own[: self.layout.n_u]
        scheme, G, H, ends, sizes, laws = [], [], [], [], [], []
        for part in parts:
            scheme += [rows.expression for rows in element_equations(part, functions, self.options, self.layout, u, p)]
            sides = [functions.sides(z) for _, z in part.points[1:]]
            G += [G_j for G_j, _ in sides]
            H += [H_j for _, H_j in sides]
            ends.append(sum((w * sides[j][1] for j, w in enumerate(self.to_right) if w), ca.SX.zeros(self.pairs)))
            size, law = jump(part.before, part.jump)
            sizes.append(size)
            laws.append(law)
        return ca.vertcat(*scheme, *[part.h for part in parts], *G, *H, *ends, *sizes, *laws)

    @cached_property
    def _jump(self) -> ca.Function:
        return jump_function(self.system)

    @cached_property
    def _impulses(self) -> ca.Function:
        return impulse_function(self.system, *self._symbols)

    def impulses(self, own: np.ndarray, left: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the values of `impulse_function` at the elements' left boundaries, (elements, n) each."""
        return tuple(np.asarray(part.full()).T for part in self._impulses(left, own, p))

    @cached_property
    def _evaluate(self) -> ca.Function:
        left, own, p, _ = self._symbols
        return ca.Function("rows", [left, own, p], [self._rows, ca.jacobian(self._rows, own)])

    @cached_property
    def _sides(self) -> ca.Function:
        """G and H alone, without the derivative that Newton's method needs."""
        left, own, p, _ = self._symbols
        first = self._first
        G, H = self._rows[first["G"] : first["H"]], self._rows[first["H"] : first["end"]]
        return ca.Function("sides", [left, own, p], [G, H])

    @cached_property
    def _outer(self) -> ca.Function:
        left, own, p, _ = self._symbols
        return ca.Function("outer", [left, own, p], [ca.jacobian(self._rows, left), ca.jacobian(self._rows, p)])

    @cached_property
    def _pattern(self) -> tuple[np.ndarray, np.ndarray]:
        row, column = self._evaluate.sparsity_out(1).get_triplet()
        return np.array(row, dtype=np.int32), np.array(column, dtype=np.int32)

    @cached_property
    def _first(self) -> dict[str, int]:
        """Index of the first row of each kind."""
        side = self.elements * self.points * self.pairs
        total = int(self._rows.numel())
        impulses = self.elements * len(self.system.impulses)
        ends = total - 2 * impulses - self.elements * self.pairs
        return {
            "steps": ends - 2 * side - self.elements,
            "G": ends - 2 * side,
            "H": ends - side,
            "end": ends,
            "impulse": total - 2 * impulses,
            "law": total - impulses,
            "all": total,
        }

    def values(self, own: np.ndarray, left: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return G and H at all points, (elements, points, n_pairs) each."""
        G, H = self._sides(left, own, p)
        shape = (self.elements, self.points, self.pairs)
        return np.asarray(G).reshape(shape), np.asarray(H).reshape(shape)

    def read_modes(self, own: np.ndarray, left: np.ndarray, p: np.ndarray) -> Modes:
        """Return the modes of a relaxed solution: of each pair the larger side is taken for the positive one."""
        G, H = self.values(own, left, p)
        if self.options.switch_detection:
            G, H = G.sum(axis=1), H[:, : self.layout.stages].sum(axis=1)
        else:
            G, H = G.reshape(self.cells, -1), H.reshape(self.cells, -1)
        if not self.system.impulses:
            return H > G
        sizes, laws, *_ = self.impulses(own, left, p)
        return np.hstack([H > G, sizes > np.abs(laws)])

    @cached_property
    def impulse_pairs(self) -> np.ndarray:
        """Number of the pair of every impulse, (n_impulses)."""
        return np.array([impulse.pair for impulse in self.system.impulses], dtype=int)

    def goes_on(self, modes: Modes) -> np.ndarray:
        """Return for every cell but the first whether the mode of the cell before goes on in it, without an impulse."""
        pairs, acts = modes[:, : self.pairs], modes[:, self.pairs :]
        return np.asarray((pairs[1:] == pairs[:-1]).all(axis=1) & ~acts[1:].any(axis=1))

    def active_rows(self, modes: Modes, length: float) -> tuple[sparse.csr_matrix, np.ndarray]:
        """Return (C, d): the equations of these modes are C rows - d = 0."""
        key = modes.tobytes()
        if key not in self._known_rows:
            self._known_rows[key] = self._choose_rows(modes)
        matrix, target = self._known_rows[key]
        return matrix, length * target

    @cached_property
    def _known_rows(self) -> dict[bytes, tuple[sparse.csr_matrix, np.ndarray]]:
        return {}

    def _choose_rows(self, modes: Modes) -> tuple[sparse.csr_matrix, np.ndarray]:
        """Return (C, d) for a length of 1."""
        first, n_pairs = self._first, self.pairs
        scheme = first["steps"]
        modes, acts = modes[:, :n_pairs], modes[:, n_pairs:]
        per_point = np.repeat(modes, self.points, axis=0) if self.options.switch_detection else modes
        zero = np.where(per_point.ravel(), first["G"], first["H"]) + np.arange(per_point.size)
        count = scheme + per_point.size
        row, column = list(range(count)), list(range(scheme)) + zero.tolist()
        value, target = [1.0] * count, [0.0] * count

        def add(columns: list[int], weights: list[float], to: float = 0.0) -> None:
            nonlocal count
            row.extend([count] * len(columns))
            column.extend(columns)
            value.extend(weights)
            target.append(to)
            count += 1

        for n, acting in np.ndenumerate(acts):
            at = n[0] * acts.shape[1] + n[1]
            add([first["law" if acting else "impulse"] + at], [1.0])
        steps = list(range(scheme, scheme + self.elements))
        if not self.options.switch_detection:
            for step in steps:
                add([step], [1.0], 1.0 / self.elements)
        else:
            add(steps, [1.0] * self.elements, 1.0)
            for n in range(self.elements - 1):
                entering = np.flatnonzero(self.hit(np.append(modes[n + 1], acts[n + 1])) & ~modes[n])
                leaving = np.flatnonzero(modes[n] & ~modes[n + 1])
                if entering.size:
                    at = first["G"] + ((n + 1) * self.points - 1) * n_pairs
                    add((at + entering).tolist(), [1.0] * entering.size)
                elif leaving.size:
                    add((first["end"] + n * n_pairs + leaving).tolist(), [1.0] * leaving.size)
                else:
                    add([steps[n], steps[n + 1]], [-1.0, 1.0])
        matrix = sparse.csr_matrix((value, (row, column)), shape=(count, first["all"]))
        return matrix, np.array(target)

    def hit(self, mode: np.ndarray) -> np.ndarray:
        """Return booleans, (n_pairs): the pair is active, or its impulse acts at the left boundary."""
        hit = np.array(mode[: self.pairs])
        hit[self.impulse_pairs[mode[self.pairs :]]] = True
        return hit

    def _jacobian(self, nonzeros: list[float]) -> np.ndarray | sparse.csc_matrix:
        """Return the derivative of all rows by the own variables, a full matrix where that is small."""
        shape = (self._first["all"], self.layout.size)
        if self.layout.size > LARGEST_DENSE:
            return sparse.csc_matrix((nonzeros, self._pattern), shape=shape)
        full = np.zeros(shape)
        full[self._pattern] = nonzeros
        return full

    def newton(
        self,
        start: np.ndarray,
        modes: Modes,
        left: np.ndarray,
        p: np.ndarray,
        length: float,
        *,
        tolerance: float = 1e-12,
        max_iterations: int = 25,
    ) -> NewtonResult:
        """Solve the interval for these modes, down to round-off.

        Args:
            start: own variables to start from, (size); its u stays.
            modes: see `Modes`.
            left: state the interval starts from, (n_x).
            p: parameters, (n_p).
            length: sum of the steps.
            tolerance: largest residual of a converged result.
            max_iterations: limit.
        """
        matrix, target = self.active_rows(modes, length)
        n_u = self.layout.n_u
        own, residual, iterations = start.copy(), np.inf, 0
        best = own
        for iterations in range(max_iterations + 1):
            rows, jacobian = self._evaluate(left, own, p)
            value = matrix @ np.asarray(rows).ravel() - target
            if self.system.jump is not None and iterations == 0:
                tolerance = max(tolerance, self._round_off(jacobian, own))
            size = float(np.abs(value).max())
            if not np.isfinite(size):
                break
            if size >= residual and residual <= tolerance:
                break  # round-off
            improving = size < 1e4 * max(residual, 1.0)
            if size < residual:
                residual, best = size, own
            if not improving or residual == 0.0 or iterations == max_iterations:
                break
            reduced = matrix @ self._jacobian(jacobian.nonzeros())[:, n_u:]
            step = _solve(reduced, value, singular=iterations > 8)
            if step is None:
                break
            own = own.copy()
            own[n_u:] -= step
        return NewtonResult(best, residual, iterations, residual <= tolerance)

    def _round_off(self, jacobian: ca.DM, own: np.ndarray) -> float:
        """Return the residuals that stiff forces leave where every term is known to the last bit."""
        terms = ca.fabs(jacobian) @ ca.fabs(ca.DM(own))
        return float(8.0 * np.finfo(float).eps * np.asarray(terms).max())

    def sensitivity(
        self, own: np.ndarray, modes: Modes, left: np.ndarray, p: np.ndarray, length: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return d x_end / d x_left, d x_end / d u, d x_end / d p of a solved interval with its modes held.

        With F(y; q) = 0 the interval's equations, ``dy/dq = -(dF/dy)^-1 dF/dq`` (implicit function theorem). Where
        steps are free the switch times move with q: the result contains the jump of the sensitivity at a switch.

        Source: Nurkanovic et al., arXiv 2205.05337, section 4.5, Theorem 19.
        """
        matrix, _ = self.active_rows(modes, length)
        n_u = self.layout.n_u
        inner = matrix @ self._jacobian(self._evaluate(left, own, p)[1].nonzeros())
        by_left, by_p = (np.asarray(part.full()) for part in self._outer(left, own, p))
        by_u = inner[:, :n_u]
        outer = np.hstack([matrix @ by_left, by_u.toarray() if sparse.issparse(by_u) else by_u, matrix @ by_p])
        solved = _solve(inner[:, n_u:], outer, singular=False)
        if solved is None:
            raise SolverError("the sensitivities of a step do not exist: its equations are singular and not finite")
        end = self.layout.end(self.elements - 1)[: self.layout.n_x] - n_u
        parts = np.split(-solved[end], [self.layout.n_x, self.layout.n_x + n_u], axis=1)
        return parts[0], parts[1], parts[2]


def _solve(matrix: np.ndarray | sparse.csr_matrix, right: np.ndarray, *, singular: bool) -> np.ndarray | None:
    """Solve a square system; a singular one by the least-norm solution, which exists when the rows are consistent."""
    if not isinstance(matrix, np.ndarray):
        # SuperLU reads uninitialised memory on structurally singular matrices (its issue 33).
        singular = singular or structural_rank(matrix) < matrix.shape[0]
        if not singular:
            try:
                return np.asarray(splu(sparse.csc_matrix(matrix)).solve(right))
            except RuntimeError:
                singular = True
        matrix = matrix.toarray()
    if not np.isfinite(matrix).all():
        return None
    if not singular:
        try:
            return np.asarray(np.linalg.solve(matrix, right))
        except np.linalg.LinAlgError:
            pass
    try:
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=SINGULAR_STEP)[0])
    except np.linalg.LinAlgError:
        return None
