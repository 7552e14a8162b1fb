"""A block of the relaxed NLP: its rows and their derivatives as CasADi functions of its own variables."""

from __future__ import annotations

import casadi as ca
import numpy as np

from fesd_robot.mpcc.block_derivatives import BlockDerivatives, identity_of, record, recorded
from fesd_robot.mpcc.problem import Block, BlockEquations, Mpcc
from fesd_robot.mpcc.relaxations import Relaxation
from fesd_robot.mpcc.steering import Steering, pair_parameters
from fesd_robot.native import Formula
from fesd_robot.running import Kept, check_time

UNRELAXED_SIGMA = 3e-3
"""Sigma of the velocity level up to which the cost of a relaxed NLP is that of the problem itself."""


_KEPT: Kept[BlockDerivatives] = Kept(64)


def differentiate(
    block: Block,
    problem: Mpcc,
    relaxation: Relaxation,
    steering: Steering,
    slacks: int,
    *,
    shared: bool = True,
    known: bool = False,
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
        known: whether they are not made where an earlier run has recorded them; for those that are compiled.

    Raises:
        OutOfTime: the time limit comes meanwhile.
    """
    equations, box = block.equations, (np.zeros(0), np.zeros(0))
    if block.pairs and block.copies:
        box = problem.lower[block.index].min(axis=1), problem.upper[block.index].max(axis=1)
    key = (equations, *(side.tobytes() for side in box), relaxation.name, steering, slacks, shared)

    def made() -> BlockDerivatives:
        return _differentiated(equations, box, relaxation, steering, slacks, shared=shared)

    def found() -> BlockDerivatives:
        if not known:
            return made()
        numbers = (side.tobytes() for side in (equations.lower, equations.upper, *box))
        words = (equations.function.serialize(), equations.cost_while_relaxed.serialize())
        how = f"{equations.vanishing} {equations.velocity_level} {relaxation.name} {steering} {slacks} {shared}"
        identity = identity_of(*words, how, *numbers)
        before = recorded(identity, made)
        if before is None:
            before = made()
            record(identity, before)
        return before

    return _KEPT.of(key, found)


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
        cost=Formula.of(function("cost", arguments, f)),
        rows=Formula.of(function("rows", arguments, rows)),
        gradient=Formula.of(function("gradient", arguments, _nonzeros(gradient))),
        jacobian=Formula.of(function("jacobian", arguments, _nonzeros(jacobian))),
        hessian=Formula.of(function("hessian", [*arguments, weight, multiplier], _nonzeros(hessian))),
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
