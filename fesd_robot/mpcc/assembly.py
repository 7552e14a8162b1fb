"""From the MPCC's blocks to one sparse NLP: derivatives are taken once a block and scattered to all its copies.

Taking derivatives of the whole graph instead would colour a matrix with hundreds of columns and evaluate the whole
problem once per colour.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from typing import Literal

import casadi as ca
import numpy as np

from fesd_robot.mpcc.problem import Block, Mpcc
from fesd_robot.mpcc.relaxations import Relaxation
from fesd_robot.mpcc.steering import Slacks, Steering, check_one_sided, check_steering, pair_parameters, slacks_of
from fesd_robot.native import CompilationError, compile_functions

logger = logging.getLogger(__name__)

Compile = Literal["auto", "never", "always"]
"""Whether an NLP's functions become machine code; auto: large ones, where there is a C compiler."""

WORTHWHILE = 100_000
"""Instructions of one evaluation of all derivatives from which on compiling pays for itself within a solve."""


@dataclass(frozen=True)
class RelaxedNlp:
    """The relaxed problem with its two sigmas as parameters: CasADi functions and constraint bounds.

    Attributes:
        nlp: ``x, p -> f, g`` with p = (sigma of rank 0, sigma of rank 1).
        gradient, jacobian, hessian: derivative functions in CasADi's nlpsol signatures.
        lower, upper: bounds of g.
        relaxation, steering: what it was assembled with.
        slacks: the steering's slack variables, which end x.
    """

    nlp: ca.Function
    gradient: ca.Function
    jacobian: ca.Function
    hessian: ca.Function
    lower: np.ndarray
    upper: np.ndarray
    relaxation: Relaxation
    steering: Steering
    slacks: Slacks


@dataclass(frozen=True)
class _BlockDerivatives:
    value: ca.Function
    gradient: ca.Function
    jacobian: ca.Function
    hessian: ca.Function
    jacobian_sparsity: ca.Sparsity
    hessian_sparsity: ca.Sparsity
    lower: np.ndarray
    upper: np.ndarray

    @property
    def instructions(self) -> int:
        """Number of operations of one evaluation of all functions."""
        return sum(int(f.n_instructions()) for f in (self.value, self.gradient, self.jacobian, self.hessian))


def assemble(
    problem: Mpcc, relaxation: Relaxation, compiled: Compile = "never", steering: Steering = "direct"
) -> RelaxedNlp:
    """Return the NLP in which every pair is replaced by the relaxation's rows, and G >= 0, H >= 0 if they ask for it.

    Rows G >= 0 or H >= 0 that already follow from the bounds on the variables are left out.

    Raises:
        CompilationError: `compiled` is ``always`` and there is no C compiler, or it failed.
        ModelError: the problem has one-sided pairs and the relaxation cannot hold them.
        ValueError: there is no such steering.
    """
    check_steering(steering)
    check_one_sided(problem, relaxation)
    slacks = slacks_of(problem, steering, relaxation.power)
    size = problem.size + slacks.count
    indices = [np.vstack([b.index, problem.size + own]) for b, own in zip(problem.blocks, slacks.index, strict=True)]
    x, sigma, weight = ca.MX.sym("x", size), ca.MX.sym("sigma", 2), ca.MX.sym("lam_f")
    derivatives = [
        _differentiate(block, problem, relaxation, steering, len(own))
        for block, own in zip(problem.blocks, slacks.index, strict=True)
    ]
    rows = [len(d.lower) * block.copies for block, d in zip(problem.blocks, derivatives, strict=True)]
    multiplier = ca.MX.sym("lam_g", sum(rows))

    cost: ca.MX = ca.MX(0)
    constraints, gradients, jacobians, hessians = [], [], [], []
    gradient_at, jacobian_at, hessian_at = [], [], []
    first_row = 0
    for block, index, d, count in zip(problem.blocks, indices, derivatives, rows, strict=True):
        copies = block.copies
        local = ca.reshape(x[index.ravel(order="F").tolist()], index.shape)
        own = local[: block.index.shape[0], :] if len(index) > len(block.index) else local
        arguments = (local, ca.DM(block.parameters), ca.repmat(sigma, 1, copies))
        f, g = d.value.map(copies)(*arguments)
        cost += ca.sum2(f)
        constraints.append(ca.vec(g))
        gradients.append(ca.vec(d.gradient.map(copies)(own, ca.DM(block.parameters))))
        gradient_at.append(block.index.ravel(order="F"))
        jacobians.append(ca.vec(d.jacobian.map(copies)(*arguments)))
        row, column = (np.array(part, dtype=int) for part in d.jacobian_sparsity.get_triplet())
        offsets = first_row + len(d.lower) * np.arange(copies)
        jacobian_at.append(((row[:, None] + offsets).ravel(order="F"), index[column].ravel(order="F")))
        local_multiplier = ca.reshape(multiplier[first_row : first_row + count], (len(d.lower), copies))
        hessians.append(ca.vec(d.hessian.map(copies)(*arguments, ca.repmat(weight, 1, copies), local_multiplier)))
        row, column = (np.array(part, dtype=int) for part in d.hessian_sparsity.get_triplet())
        first, second = index[row].ravel(order="F"), index[column].ravel(order="F")
        hessian_at.append((np.minimum(first, second), np.maximum(first, second)))
        first_row += count

    g = ca.vertcat(*constraints)
    gradient = _scatter(np.concatenate(gradient_at), np.zeros(sum(map(len, gradient_at)), int), (size, 1), gradients)
    jacobian = _scatter(*_stack(jacobian_at), (sum(rows), size), jacobians)
    hessian = _scatter(*_stack(hessian_at), (size, size), hessians)
    if slacks.count:
        prices = ca.vertcat(ca.DM.zeros(problem.size), slacks.prices(sigma))
        cost, gradient = cost + ca.dot(prices, x), gradient + prices
    nlp = RelaxedNlp(
        nlp=ca.Function("nlp", [x, sigma], [cost, g], ["x", "p"], ["f", "g"]),
        gradient=ca.Function("nlp_grad_f", [x, sigma], [cost, ca.densify(gradient)], ["x", "p"], ["f", "grad_f_x"]),
        jacobian=ca.Function("nlp_jac_g", [x, sigma], [g, jacobian], ["x", "p"], ["g", "jac_g_x"]),
        hessian=ca.Function(
            "nlp_hess_l", [x, sigma, weight, multiplier], [hessian], ["x", "p", "lam_f", "lam_g"], ["hess_gamma_x_x"]
        ),
        lower=np.concatenate([np.tile(d.lower, b.copies) for b, d in zip(problem.blocks, derivatives, strict=True)]),
        upper=np.concatenate([np.tile(d.upper, b.copies) for b, d in zip(problem.blocks, derivatives, strict=True)]),
        relaxation=relaxation,
        steering=steering,
        slacks=slacks,
    )
    instructions = sum(d.instructions * block.copies for block, d in zip(problem.blocks, derivatives, strict=True))
    if compiled == "always" or (compiled == "auto" and instructions >= WORTHWHILE):
        return _compiled(nlp, required=compiled == "always")
    return nlp


def _compiled(nlp: RelaxedNlp, required: bool) -> RelaxedNlp:
    try:
        functions = compile_functions("nlp", [nlp.nlp, nlp.gradient, nlp.jacobian, nlp.hessian])
    except CompilationError as error:
        if required:
            raise
        logger.warning("the functions of the NLP are not compiled: %s", error)
        return nlp
    return replace(nlp, nlp=functions[0], gradient=functions[1], jacobian=functions[2], hessian=functions[3])


def _differentiate(
    block: Block, problem: Mpcc, relaxation: Relaxation, steering: Steering, slacks: int
) -> _BlockDerivatives:
    w = ca.SX.sym("w", block.function.sparsity_in(0))
    p = ca.SX.sym("p", block.function.sparsity_in(1))
    sigma, slack = ca.SX.sym("sigma", 2), ca.SX.sym("slack", slacks)
    x = ca.vertcat(w, slack) if slacks else w
    f, g, G, H = (ca.densify(part) for part in block.function(w, p))
    lower, upper = problem.lower[block.index].min(axis=1), problem.upper[block.index].max(axis=1)
    signs = [
        part[row]
        for part, free in ((G, block.sign_free), (H, np.zeros(len(block.sign_free), bool)))
        for row, implied in enumerate(_nonnegative_in_box(part, w, lower, upper) | free)
        if relaxation.signs and not implied
    ]
    relaxed = relaxation.formula(G, H, pair_parameters(block, relaxation, steering, sigma, slack))
    rows = ca.vertcat(g, relaxed, *signs)
    multiplier, weight = ca.SX.sym("lam", rows.numel()), ca.SX.sym("lam_f")
    jacobian = ca.jacobian(rows, x)
    hessian = ca.triu(ca.hessian(weight * f + ca.dot(multiplier, rows), x)[0])
    return _BlockDerivatives(
        value=ca.Function("value", [x, p, sigma], [f, rows]),
        gradient=ca.Function("gradient", [w, p], [ca.densify(ca.gradient(f, w))]),
        jacobian=ca.Function("jacobian", [x, p, sigma], [_nonzeros(jacobian)]),
        hessian=ca.Function("hessian", [x, p, sigma, weight, multiplier], [_nonzeros(hessian)]),
        jacobian_sparsity=jacobian.sparsity(),
        hessian_sparsity=hessian.sparsity(),
        lower=np.concatenate(
            [block.lower, np.full(relaxed.numel(), 0.0 if relaxation.equality else -np.inf), np.zeros(len(signs))]
        ),
        upper=np.concatenate([block.upper, np.zeros(relaxed.numel()), np.full(len(signs), np.inf)]),
    )


def _nonzeros(matrix: ca.SX) -> ca.SX:
    return ca.densify(matrix.nz[:]) if matrix.nnz() else ca.SX(0, 1)


def _nonnegative_in_box(part: ca.SX, w: ca.SX, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Which rows of `part` are affine in w and nonnegative for every lower <= w <= upper."""
    slope = ca.jacobian(part, w)
    varies = np.array(ca.which_depends(part, w, 2, True), dtype=bool) if part.numel() else np.zeros(0, bool)
    affine = ca.Function("affine", [w], [part, slope], {"allow_free": True})
    if affine.has_free():
        return np.zeros(part.numel(), bool)
    constant, slope_value = affine(np.zeros(w.numel()))
    slope_matrix = np.asarray(ca.DM(slope_value).full())
    with np.errstate(invalid="ignore"):
        least = np.where(slope_matrix > 0, slope_matrix * lower, np.where(slope_matrix < 0, slope_matrix * upper, 0.0))
    return ~varies & (np.asarray(constant).ravel() + least.sum(axis=1) >= 0.0)


def _stack(places: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    return np.concatenate([p[0] for p in places]), np.concatenate([p[1] for p in places])


def _scatter(row: np.ndarray, column: np.ndarray, shape: tuple[int, int], values: list[ca.MX]) -> ca.MX:
    """Return the sparse matrix with `values` added up at (row, column)."""
    key = column.astype(np.int64) * shape[0] + row
    unique, position = np.unique(key, return_inverse=True)
    sparsity = ca.Sparsity.triplet(*shape, (unique % shape[0]).tolist(), (unique // shape[0]).tolist())
    stacked = ca.vertcat(*values)
    if len(unique) == len(key):
        order = np.argsort(position)
        return ca.MX(sparsity, stacked[order.tolist()])
    summation = ca.DM(
        ca.Sparsity.triplet(len(unique), len(key), position.tolist(), list(range(len(key)))), np.ones(len(key))
    )
    return ca.MX(sparsity, ca.mtimes(summation, stacked))
