"""A block of the relaxed NLP: its rows and their derivatives as CasADi functions of its own variables."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from fesd_robot.mpcc.problem import Block, BlockEquations, Mpcc
from fesd_robot.mpcc.relaxations import Relaxation
from fesd_robot.mpcc.steering import Steering, pair_parameters
from fesd_robot.running import Kept, check_time

UNRELAXED_SIGMA = 3e-3
"""Sigma of the velocity level up to which the cost of a relaxed NLP is that of the problem itself."""


@dataclass(frozen=True, eq=False)
class BlockDerivatives:
    """One copy of a block, relaxed, as functions of (x, p, sigmas): x are its variables and, behind them, its slacks.

    Attributes:
        cost, rows: values, (1, 1) and (n_rows, 1).
        gradient: of the cost by the variables, its nonzeros (n, 1).
        jacobian: of the rows by x, its nonzeros.
        hessian: upper triangle of that of the Lagrangian weight * cost + multipliers' * rows, its nonzeros; has the
            weight and the Lagrange multipliers as further inputs.
        gradient_sparsity, jacobian_sparsity, hessian_sparsity: where the nonzeros are.
        lower, upper: bounds of the rows.
    """

    cost: ca.Function
    rows: ca.Function
    gradient: ca.Function
    jacobian: ca.Function
    hessian: ca.Function
    gradient_sparsity: ca.Sparsity
    jacobian_sparsity: ca.Sparsity
    hessian_sparsity: ca.Sparsity
    lower: np.ndarray
    upper: np.ndarray

    @property
    def instructions(self) -> int:
        """Number of operations of one evaluation of all functions."""
        return sum(int(f.n_instructions()) for f in (self.cost, self.rows, self.gradient, self.jacobian, self.hessian))


_KEPT: Kept[BlockDerivatives] = Kept(64)


def differentiate(
    block: Block, problem: Mpcc, relaxation: Relaxation, steering: Steering, slacks: int, *, shared: bool = True
) -> BlockDerivatives:
    """Return a block's relaxed rows with all derivatives; of the same equations they are made once.

    Args:
        block: one of the problem's.
        problem: whose bounds say which signs follow from them.
        relaxation: what stands for a pair.
        steering: where sigma comes from.
        slacks: how many slack variables a copy reads.
        shared: whether common parts are looked for, so that nothing is computed twice; for functions that are evaluated
            a few times only, looking takes longer.

    Raises:
        OutOfTime: the time limit comes meanwhile.
    """
    equations, box = block.equations, (np.zeros(0), np.zeros(0))
    if block.pairs and block.copies:
        box = problem.lower[block.index].min(axis=1), problem.upper[block.index].max(axis=1)
    key = (equations, *(side.tobytes() for side in box), relaxation.name, steering, slacks, shared)
    return _KEPT.of(key, lambda: _differentiated(equations, box, relaxation, steering, slacks, shared=shared))


def _differentiated(
    block: BlockEquations,
    box: tuple[np.ndarray, np.ndarray],
    relaxation: Relaxation,
    steering: Steering,
    slacks: int,
    *,
    shared: bool,
) -> BlockDerivatives:
    """Return a block's relaxed rows with G >= 0, H >= 0 where they ask for it, and all derivatives.

    Args:
        box: bounds of its variables in all copies, (n_w); they count where it has pairs.

    The other args are those of `differentiate`.
    """
    function = _shared_function if shared else _plain_function
    w = ca.SX.sym("w", block.function.sparsity_in(0))
    p = ca.SX.sym("p", block.function.sparsity_in(1))
    sigma, slack = ca.SX.sym("sigma", 2), ca.SX.sym("slack", slacks)
    x = ca.vertcat(w, slack) if slacks else w
    f, g, G, H = (ca.densify(part) for part in block.function(w, p))
    if not block.while_relaxed.is_zero():
        added = block.cost_while_relaxed(w, p, ca.fmax(sigma[1], UNRELAXED_SIGMA))
        f += ca.if_else(sigma[1] > UNRELAXED_SIGMA, added, 0.0)
    signs = [
        side[row]
        for side, free in ((G, block.vanishing), (H, np.zeros(block.pairs, bool)))
        for row, implied in enumerate(_nonnegative_in_box(side, w, *box) | free)
        if relaxation.signs and not implied
    ]
    relaxed = relaxation.formula(G, H, pair_parameters(block, relaxation, steering, sigma, slack))
    rows = ca.vertcat(g, relaxed, *signs)
    if shared:
        f, rows = ca.cse([f, rows])  # before differentiating: a third off the Hessian of Solo12
    check_time()
    multiplier, weight = ca.SX.sym("lam", rows.numel()), ca.SX.sym("lam_f")
    gradient, jacobian = ca.gradient(f, w), ca.jacobian(rows, x)
    check_time()
    hessian = ca.triu(ca.hessian(weight * f + ca.dot(multiplier, rows), x)[0])
    arguments = [x, p, sigma]
    return BlockDerivatives(
        cost=function("cost", arguments, f),
        rows=function("rows", arguments, rows),
        gradient=function("gradient", arguments, _nonzeros(gradient)),
        jacobian=function("jacobian", arguments, _nonzeros(jacobian)),
        hessian=function("hessian", [*arguments, weight, multiplier], _nonzeros(hessian)),
        gradient_sparsity=gradient.sparsity(),
        jacobian_sparsity=jacobian.sparsity(),
        hessian_sparsity=hessian.sparsity(),
        lower=np.concatenate(
            [block.lower, np.full(relaxed.numel(), 0.0 if relaxation.equality else -np.inf), np.zeros(len(signs))]
        ),
        upper=np.concatenate([block.upper, np.zeros(relaxed.numel()), np.full(len(signs), np.inf)]),
    )


def _shared_function(name: str, arguments: list[ca.SX], value: ca.SX) -> ca.Function:
    """Return a function that computes nothing twice; CasADi's derivatives repeat common parts many times."""
    check_time()
    return _plain_function(name, arguments, ca.cse(value))


def _plain_function(name: str, arguments: list[ca.SX], value: ca.SX) -> ca.Function:
    return ca.Function(name, arguments, [ca.densify(value)])


def _nonzeros(matrix: ca.SX) -> ca.SX:
    return ca.densify(matrix.nz[:]) if matrix.nnz() else ca.SX(0, 1)


def _nonnegative_in_box(part: ca.SX, w: ca.SX, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Which rows of `part` are affine in w and nonnegative for every lower <= w <= upper."""
    if not part.numel():
        return np.zeros(0, bool)
    slope = ca.jacobian(part, w)
    varies = np.array(ca.which_depends(part, w, 2, True), dtype=bool)
    affine = ca.Function("affine", [w], [part, slope], {"allow_free": True})
    if affine.has_free():
        return np.zeros(part.numel(), bool)
    constant, slope_value = affine(np.zeros(w.numel()))
    slope_matrix = np.asarray(ca.DM(slope_value).full())
    with np.errstate(invalid="ignore"):
        least = np.where(slope_matrix > 0, slope_matrix * lower, np.where(slope_matrix < 0, slope_matrix * upper, 0.0))
    return ~varies & (np.asarray(constant).ravel() + least.sum(axis=1) >= 0.0)
