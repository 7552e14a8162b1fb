"""An MPCC to first order at a point: values, sparse Jacobians, and which constraints are active there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy import sparse

from fesd_robot.complementarity import Label
from fesd_robot.errors import DimensionError, SolverError
from fesd_robot.mpcc.problem import Block, BlockEquations, Mpcc
from fesd_robot.running import check_time, kept_with_first


@dataclass(frozen=True)
class Linearisation:
    """First-order expansion of an MPCC at a point w, rows ordered block by block and copy by copy.

    Attributes:
        w, lower, upper: the point and the bounds on the variables, shape (n,).
        f, gradient: cost and its gradient, the latter of shape (n,).
        g, g_lower, g_upper, g_jacobian: constraint values and bounds (n_g,), Jacobian (n_g, n).
        G, H, G_jacobian, H_jacobian: sides of the pairs (n_pairs,), Jacobians (n_pairs, n).
        vanishing: which pairs are vanishing constraints, H >= 0 and G H <= 0 only, (n_pairs,).
        variable_labels, constraint_labels, pair_labels: what variables, rows and pairs are.
    """

    w: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    f: float
    gradient: np.ndarray
    g: np.ndarray
    g_lower: np.ndarray
    g_upper: np.ndarray
    g_jacobian: sparse.csr_array
    G: np.ndarray
    H: np.ndarray
    G_jacobian: sparse.csr_array
    H_jacobian: sparse.csr_array
    vanishing: np.ndarray
    variable_labels: Sequence[Label]
    constraint_labels: Sequence[Label]
    pair_labels: Sequence[Label]


@dataclass(frozen=True)
class ActiveSet:
    """Which sides count as zero; a value v with gradient a does if abs(v) <= activity max(1, max abs(a)).

    Attributes:
        lower, upper: bounds on variables, (n,).
        g_lower, g_upper: bounds on rows of g, (n_g,); both are set for an equality.
        G, H: sides of the pairs, (n_pairs,); in a pair whose sides are both positive the smaller one counts as zero.
            In a vanishing constraint, G < 0 is not zero, and `G` and `H` may both be unset.
        unresolved: pairs whose sides are both positive, (n_pairs,).
        violation: largest violation of a bound, a row of g, G >= 0 or H >= 0, divided by max(1, max abs(a)).
    """

    lower: np.ndarray
    upper: np.ndarray
    g_lower: np.ndarray
    g_upper: np.ndarray
    G: np.ndarray
    H: np.ndarray
    unresolved: np.ndarray
    violation: float

    @property
    def biactive(self) -> np.ndarray:
        """Pairs with both sides zero, (n_pairs,)."""
        return self.G & self.H


def linearise(problem: Mpcc, w: np.ndarray) -> Linearisation:
    """Return values and first derivatives of f, g, G, H at w.

    Derivatives are taken once a block, F'(w) = sum over copies of S' F_b'(S w) with the selection S of a copy.

    Args:
        problem: the MPCC.
        w: the point, shape (n,), in the units of the problem's variables.

    Raises:
        DimensionError: w has another shape.
        SolverError: a value or a derivative is not finite; the message names its row.
    """
    if w.shape != problem.start.shape:
        raise DimensionError(f"w has shape {w.shape}, the problem's variables {problem.start.shape}")
    cost, gradient = 0.0, np.zeros(problem.size)
    parts: list[list[tuple[np.ndarray, sparse.csr_array]]] = [[], [], []]
    for block in problem.blocks:
        f, slope, rows = _block(block, w, problem.size)
        cost += f
        np.add.at(gradient, block.index.ravel(order="F"), slope)
        for part, row in zip(parts, rows, strict=True):
            part.append(row)
    (g, g_jacobian), (G, G_jacobian), (H, H_jacobian) = (_stack(part, problem.size) for part in parts)
    at = Linearisation(
        w=w,
        lower=problem.lower,
        upper=problem.upper,
        f=cost,
        gradient=gradient,
        g=g,
        g_lower=np.concatenate([np.zeros(0), *(np.tile(b.lower, b.copies) for b in problem.blocks)]),
        g_upper=np.concatenate([np.zeros(0), *(np.tile(b.upper, b.copies) for b in problem.blocks)]),
        g_jacobian=g_jacobian,
        G=G,
        H=H,
        G_jacobian=G_jacobian,
        H_jacobian=H_jacobian,
        vanishing=np.concatenate([np.zeros(0, bool), *(np.tile(b.vanishing, b.copies) for b in problem.blocks)]),
        variable_labels=[problem.variable_label(i) for i in range(problem.size)],
        constraint_labels=[
            b.constraint_label(row, copy)
            for b in problem.blocks
            for copy in range(b.copies)
            for row in range(len(b.constraints))
        ],
        pair_labels=problem.pair_labels,
    )
    _refuse_nonfinite(at)
    return at


def active_set(at: Linearisation, activity: float, bound_activity: float | None = None) -> ActiveSet:
    """Return which bounds, rows and sides are zero up to `activity`, and how far the point violates the others.

    Args:
        at: the expansion.
        activity: a value counts as zero up to activity max(1, largest entry of its gradient), in the value's unit.
        bound_activity: the same for the distance from bounds on variables and rows; `activity` if omitted.
    """
    at_bound = activity if bound_activity is None else bound_activity
    g_size, G_size, H_size = (np.maximum(1.0, row_sizes(J)) for J in (at.g_jacobian, at.G_jacobian, at.H_jacobian))
    G, H = at.G / G_size, at.H / H_size
    G_zero, H_zero = (activity >= G) & ~(at.vanishing & (-activity > G)), activity >= H
    unresolved = (activity < G) & (activity < H)
    pairs = ~at.vanishing
    excess = (
        at.lower - at.w,
        at.w - at.upper,
        (at.g_lower - at.g) / g_size,
        (at.g - at.g_upper) / g_size,
        -G[pairs],
        -H,
    )
    equality = at.g_upper <= at.g_lower
    return ActiveSet(
        lower=at.w - at.lower <= at_bound,
        upper=at.upper - at.w <= at_bound,
        g_lower=equality | ((at.g - at.g_lower) / g_size <= at_bound),
        g_upper=equality | ((at.g_upper - at.g) / g_size <= at_bound),
        G=G_zero | (unresolved & (G <= H)),
        H=H_zero | (unresolved & (G > H)),
        unresolved=unresolved,
        violation=max([0.0, *(float(part.max()) for part in excess if part.size)]),
    )


def row_sizes(matrix: sparse.csr_array) -> np.ndarray:
    """Return the largest absolute entry of every row, shape (rows,)."""
    if not matrix.nnz:
        return np.zeros(matrix.shape[0])
    return np.asarray(abs(matrix).max(axis=1).toarray(), dtype=float).ravel()


def row_scales(matrix: sparse.csr_array) -> np.ndarray:
    """Return by what to divide every row, shape (rows,): its size, one for a row of nothing, or what is left of it."""
    sizes = row_sizes(matrix)
    return np.where(sizes < np.finfo(float).tiny, 1.0, sizes)


def repeated_bounds(at: Linearisation, active: ActiveSet) -> tuple[np.ndarray, np.ndarray]:
    """Return which lower and upper bounds on variables, (n,) each, repeat a pair's active side to first order.

    A side that is affine in w_i alone repeats the lower bound of w_i if it grows with it, else the upper bound.
    """
    lower, upper = np.zeros(len(at.w), bool), np.zeros(len(at.w), bool)
    sides = ((at.G_jacobian, active.G & ~at.vanishing), (at.H_jacobian, active.H))
    for matrix, zero in sides:
        matrix = sparse.csr_array(matrix)
        matrix.eliminate_zeros()
        alone = np.flatnonzero((np.diff(matrix.indptr) == 1) & zero)
        column, slope = matrix.indices[matrix.indptr[alone]], matrix.data[matrix.indptr[alone]]
        lower[column[slope > 0]] = True
        upper[column[slope < 0]] = True
    return lower, upper


def _block(
    block: Block, w: np.ndarray, size: int
) -> tuple[float, np.ndarray, list[tuple[np.ndarray, sparse.csr_array]]]:
    """Return cost, its gradient copy by copy, and values and Jacobians of g, G, H of all copies of a block."""
    function, jacobians = _first_order(block.equations)
    values = function.map(block.copies)(w[block.index], block.values)
    arrays = [np.asarray(ca.DM(value).full()).reshape(value.shape) for value in values]
    sides = []
    for value, entry, (row, column) in zip(arrays[2:5], arrays[5:], jacobians, strict=True):
        at_row = (row[:, None] + value.shape[0] * np.arange(block.copies)).ravel(order="F")
        at_column = block.index[column].ravel(order="F")
        matrix = sparse.coo_array((entry.ravel(order="F"), (at_row, at_column)), shape=(value.size, size))
        sides.append((value.ravel(order="F"), sparse.csr_array(matrix)))
    return float(arrays[0].sum()), arrays[1].ravel(order="F"), sides


@kept_with_first
def _first_order(equations: BlockEquations) -> tuple[ca.Function, list[tuple[np.ndarray, np.ndarray]]]:
    """Return (w, p) -> f, its gradient, g, G, H and nonzeros of their Jacobians, and where these nonzeros are."""
    check_time()
    local = ca.SX.sym("w", equations.function.sparsity_in(0))
    p = ca.SX.sym("p", equations.function.sparsity_in(1))
    f, *rows = (ca.densify(part) for part in equations.function(local, p))
    jacobians = [ca.jacobian(part, local) for part in rows]
    entries = [ca.densify(J.nz[:]) if J.nnz() else ca.SX(0, 1) for J in jacobians]
    function = ca.Function("first_order", [local, p], [f, ca.densify(ca.gradient(f, local)), *rows, *entries])
    places = [[np.array(part, dtype=int) for part in J.sparsity().get_triplet()] for J in jacobians]
    return function, [(row, column) for row, column in places]


def _stack(parts: list[tuple[np.ndarray, sparse.csr_array]], size: int) -> tuple[np.ndarray, sparse.csr_array]:
    values = np.concatenate([np.zeros(0), *(value for value, _ in parts)])
    return values, sparse.csr_array(sparse.vstack([sparse.csr_array((0, size)), *(matrix for _, matrix in parts)]))


def _refuse_nonfinite(at: Linearisation) -> None:
    """Raise if a value or derivative is not finite."""
    if not np.isfinite([at.f, *at.gradient]).all():
        bad = [str(one) for one, slope in zip(at.variable_labels, at.gradient, strict=True) if not np.isfinite(slope)]
        raise SolverError(f"the cost is not finite or has no finite derivative by {bad[:3]}")
    for value, matrix, labels in (
        (at.g, at.g_jacobian, at.constraint_labels),
        (at.G, at.G_jacobian, at.pair_labels),
        (at.H, at.H_jacobian, at.pair_labels),
    ):
        wrong = ~np.isfinite(value)
        wrong[matrix.tocoo().row[~np.isfinite(matrix.tocoo().data)]] = True
        if wrong.any():
            raise SolverError(f"'{labels[int(np.argmax(wrong))]}' or its derivative is not finite")
