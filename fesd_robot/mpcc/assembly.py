"""From the MPCC's blocks to one sparse NLP: derivatives are taken once a block and scattered to all its copies.

Taking derivatives of the whole graph instead would colour a matrix with hundreds of columns and evaluate the whole
problem once per colour.
"""

from __future__ import annotations

import logging
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Literal

import casadi as ca
import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.mpcc.block_derivatives import BlockDerivatives
from fesd_robot.mpcc.blocks import differentiate
from fesd_robot.mpcc.problem import Block, Mpcc
from fesd_robot.mpcc.relaxations import Relaxation
from fesd_robot.mpcc.steering import Slacks, Steering, check_steering, check_vanishing, slacks_of
from fesd_robot.native import CompilationError, NlpBlock, NotCompiledYet, Output, compile_nlp
from fesd_robot.nlp import Nlp
from fesd_robot.running import Kept

logger = logging.getLogger(__name__)

Compile = Literal["auto", "never", "always"]
"""Whether an NLP's functions become machine code; auto: large ones, where there is a C compiler, once it is done."""

COMPILE_THRESHOLD = 100_000
"""Instructions of one evaluation of all derivatives from which on compiling pays for itself within a solve."""

OFTEN = 40
"""Copies of a block from which on common parts are worth looking for, for a few evaluations of the problem."""

VERY_OFTEN = 400
"""Copies of a block from which on it is worth compiling for them: that takes as long as 20,000 evaluations."""


@dataclass(frozen=True, eq=False)
class RelaxedNlp:
    """The relaxed problem with its two sigmas, of the position and of the velocity level, as parameters.

    Attributes:
        program: its functions, which problems share that differ in their numbers only.
        values: parameters of all copies of the problem's blocks.
        lower, upper: bounds of g.
        relaxation, steering: what it was assembled with.
        slacks: the steering's slack variables, which end x.
        awaited: files that a compiler still works on; functions are interpreted until it is done.
    """

    program: Nlp
    values: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    relaxation: Relaxation
    steering: Steering
    slacks: Slacks
    awaited: tuple[Path, ...] = ()

    @property
    def outdated(self) -> bool:
        """Whether there are faster functions now."""
        return _is_outdated(self.awaited)

    def parameters(self, sigmas: Sequence[float]) -> np.ndarray:
        """Return the parameters of the program at sigmas of the position and of the velocity level."""
        return np.concatenate([sigmas, self.values])


def _is_outdated(awaited: tuple[Path, ...]) -> bool:
    return bool(awaited) and all(library.exists() for library in awaited)


@dataclass(frozen=True)
class _Entries:
    """Entries of a gradient or a matrix: which nonzero each output of each copy of a block is.

    Attributes:
        shape: of the matrix.
        nonzeros: column * rows + row of every nonzero, ascending.
        places: for each block the number of the nonzero, (outputs, K).
    """

    shape: tuple[int, int]
    nonzeros: np.ndarray
    places: list[np.ndarray]

    @classmethod
    def of(cls, shape: tuple[int, int], rows: Sequence[np.ndarray], columns: Sequence[np.ndarray]) -> _Entries:
        """Return them from row and column of every output of every copy, (outputs, K) for each block."""
        keys = [column.astype(np.int64) * shape[0] + row for row, column in zip(rows, columns, strict=True)]
        nonzeros, position = np.unique(_flat(keys), return_inverse=True)
        ends = np.cumsum([0, *(key.size for key in keys)])
        parts = zip(keys, ends[:-1], ends[1:], strict=True)
        return cls(shape, nonzeros, [position[i:j].reshape(key.shape, order="F") for key, i, j in parts])

    def filled(self, values: Sequence[ca.MX]) -> ca.MX:
        """Return the matrix from each block's outputs, (outputs, K); those of one entry are added up."""
        count, key, stacked = len(self.nonzeros), _flat(self.places), ca.vertcat(*[ca.vec(value) for value in values])
        row, column = self.nonzeros % self.shape[0], self.nonzeros // self.shape[0]
        sparsity = ca.Sparsity.triplet(*self.shape, row.tolist(), column.tolist())
        if len(key) == count:
            return ca.MX(sparsity, stacked[np.argsort(key).tolist()])
        pattern = ca.Sparsity.triplet(count, len(key), key.tolist(), list(range(len(key))))
        return ca.MX(sparsity, ca.mtimes(ca.DM(pattern, np.ones(len(key))), stacked))


@dataclass(frozen=True)
class _Layout:
    """The NLP before it has functions: blocks with derivatives, and where everything belongs.

    Attributes:
        size: number of variables with slacks.
        indices: of the variables of every block, slacks last, (n, K).
        first_rows: of every block; one more at the end is the number of rows.
    """

    problem: Mpcc
    slacks: Slacks
    size: int
    indices: list[np.ndarray]
    derivatives: list[BlockDerivatives]
    first_rows: list[int]

    @property
    def blocks(self) -> Sequence[Block]:
        return self.problem.blocks

    @property
    def key(self) -> tuple[Hashable, ...]:
        """What its functions depend on."""
        return (
            self.size,
            tuple(self.derivatives),
            tuple((index.shape, index.tobytes()) for index in self.indices),
            self.slacks.levels.tobytes(),
        )

    @property
    def parameters(self) -> list[range]:
        """Which parameters are those of every block, behind the two sigmas."""
        ends = np.cumsum([2, *(block.values.size for block in self.blocks)]).tolist()
        return [range(*both) for both in pairwise(ends)]

    def gradient(self) -> _Entries:
        rows = [
            block.index[np.array(d.gradient_sparsity.row(), dtype=int)]
            for block, d in zip(self.blocks, self.derivatives, strict=True)
        ]
        return _Entries.of((self.size, 1), rows, [np.zeros_like(row) for row in rows])

    def jacobian(self) -> _Entries:
        rows, columns = [], []
        for block, index, d, first in zip(self.blocks, self.indices, self.derivatives, self.first_rows, strict=False):
            row, column = _triplet(d.jacobian_sparsity)
            rows.append(first + row[:, None] + len(d.lower) * np.arange(block.copies))
            columns.append(index[column])
        return _Entries.of((self.first_rows[-1], self.size), rows, columns)

    def hessian(self) -> _Entries:
        rows, columns = [], []
        for index, d in zip(self.indices, self.derivatives, strict=True):
            row, column = _triplet(d.hessian_sparsity)
            rows.append(np.minimum(index[row], index[column]))
            columns.append(np.maximum(index[row], index[column]))
        return _Entries.of((self.size, self.size), rows, columns)


@checked
def assemble(
    problem: Mpcc,
    relaxation: Relaxation,
    compiled: Compile = "never",
    steering: Steering = "direct",
    *,
    few_evaluations: bool = False,
) -> RelaxedNlp:
    """Return the NLP in which every pair is replaced by the relaxation's rows, and G >= 0, H >= 0 if they ask for it.

    Rows G >= 0 or H >= 0 that already follow from the bounds on the variables are left out.

    Args:
        problem, relaxation: what is to be solved, and how.
        compiled: whether its functions become machine code.
        steering: where sigma comes from.
        few_evaluations: that the functions are made faster than they run; they are not compiled then, unless always, or
            their blocks have very many copies.

    Raises:
        CompilationError: `compiled` is ``always`` and there is no C compiler, or it failed.
        ModelError: the problem has vanishing constraints and the relaxation cannot hold them.
        OptionError: there is no such steering.
    """
    check_steering(steering)
    check_vanishing(problem, relaxation)
    slacks = slacks_of(problem, steering, relaxation.power)
    blocks = problem.blocks
    derivatives = [
        differentiate(
            block,
            problem,
            relaxation,
            steering,
            len(own),
            shared=not few_evaluations or block.copies >= OFTEN,
            known=compiled != "never" and not few_evaluations,
        )
        for block, own in zip(blocks, slacks.index, strict=True)
    ]
    layout = _Layout(
        problem=problem,
        slacks=slacks,
        size=problem.size + slacks.count,
        indices=[np.vstack([b.index, problem.size + own]) for b, own in zip(blocks, slacks.index, strict=True)],
        derivatives=derivatives,
        first_rows=np.cumsum(
            [0, *(len(d.lower) * b.copies for b, d in zip(blocks, derivatives, strict=True))]
        ).tolist(),
    )
    instructions = sum(d.instructions * block.copies for block, d in zip(blocks, derivatives, strict=True))
    often = VERY_OFTEN * sum(d.instructions for d in derivatives) <= instructions
    worthwhile = instructions >= COMPILE_THRESHOLD and (often or not few_evaluations)
    wanted = compiled == "always" or (compiled == "auto" and worthwhile)

    def functions() -> tuple[Nlp, tuple[Path, ...]]:
        machine_code, awaited = _compiled(layout, required=compiled == "always") if wanted else (None, ())
        made = machine_code or _interpreted(layout)
        return Nlp(made["nlp"], made["nlp_grad_f"], made["nlp_jac_g"], made["nlp_hess_l"]), awaited

    program, awaited = _KEPT.of((*layout.key, wanted, compiled == "always"), functions)
    return RelaxedNlp(
        program=program,
        values=problem.values,
        lower=np.concatenate([np.tile(d.lower, b.copies) for b, d in zip(blocks, derivatives, strict=True)]),
        upper=np.concatenate([np.tile(d.upper, b.copies) for b, d in zip(blocks, derivatives, strict=True)]),
        relaxation=relaxation,
        steering=steering,
        slacks=slacks,
        awaited=awaited,
    )


_KEPT: Kept[tuple[Nlp, tuple[Path, ...]]] = Kept(8, outdated=lambda program: _is_outdated(program[1]))


def _interpreted(layout: _Layout) -> dict[str, ca.Function]:
    """Return the functions as CasADi graphs of maps over the copies."""
    x, p, weight = ca.MX.sym("x", layout.size), ca.MX.sym("p", layout.parameters[-1].stop), ca.MX.sym("lam_f")
    sigma = p[:2]
    multiplier = ca.MX.sym("lam_g", layout.first_rows[-1])
    cost: ca.MX = ca.MX(0)
    rows, gradients, jacobians, hessians = [], [], [], []
    for block, own, index, d, first in zip(
        layout.blocks, layout.parameters, layout.indices, layout.derivatives, layout.first_rows, strict=False
    ):
        copies, count = block.copies, len(d.lower) * block.copies
        local = ca.reshape(x[index.ravel(order="F").tolist()], index.shape)
        values = ca.reshape(p[own.start : own.stop], block.values.shape)
        arguments = (local, values, ca.repmat(sigma, 1, copies))
        cost += ca.sum2(_mapped(d.cost.function, copies, *arguments))
        rows.append(ca.vec(_mapped(d.rows.function, copies, *arguments)))
        gradients.append(_mapped(d.gradient.function, copies, *arguments))
        jacobians.append(_mapped(d.jacobian.function, copies, *arguments))
        local_multiplier = ca.reshape(multiplier[first : first + count], (len(d.lower), copies))
        hessians.append(_mapped(d.hessian.function, copies, *arguments, ca.repmat(weight, 1, copies), local_multiplier))
    g, gradient = ca.vertcat(*rows), ca.densify(layout.gradient().filled(gradients))
    if layout.slacks.count:
        prices = ca.vertcat(ca.DM.zeros(layout.problem.size), layout.slacks.prices(sigma))
        cost, gradient = cost + ca.dot(prices, x), gradient + prices
    jacobian, hessian = layout.jacobian().filled(jacobians), layout.hessian().filled(hessians)
    made = [
        ca.Function("nlp", [x, p], [cost, g], ["x", "p"], ["f", "g"]),
        ca.Function("nlp_grad_f", [x, p], [cost, gradient], ["x", "p"], ["f", "grad_f_x"]),
        ca.Function("nlp_jac_g", [x, p], [g, jacobian], ["x", "p"], ["g", "jac_g_x"]),
        ca.Function(
            "nlp_hess_l", [x, p, weight, multiplier], [hessian], ["x", "p", "lam_f", "lam_g"], ["hess_gamma_x_x"]
        ),
    ]
    return {function.name(): function for function in made}


def _mapped(function: ca.Function, copies: int, *arguments: ca.MX | ca.DM) -> ca.MX:
    """Return the function's dense value at all copies; CasADi makes a call that is always zero sparse."""
    return ca.densify(function.map(copies)(*arguments))


def _compiled(layout: _Layout, required: bool) -> tuple[dict[str, ca.Function] | None, tuple[Path, ...]]:
    """Return the functions compiled, None if they are not, and the files that a compiler still works on.

    Args:
        required: whether they have to be; else nobody waits for the compiler.
    """
    gradient, jacobian, hessian = layout.gradient(), layout.jacobian(), layout.hessian()
    nothing, flat = np.zeros(0, dtype=int), np.zeros((0, 0), dtype=int)
    blocks = []
    for number, (block, index, d) in enumerate(zip(layout.blocks, layout.indices, layout.derivatives, strict=True)):
        first = layout.first_rows[number]
        row_places = first + np.arange(len(d.lower) * block.copies).reshape((len(d.lower), block.copies), order="F")
        outputs = {
            "cost": Output(d.cost, flat, nothing, nothing),
            "rows": Output(d.rows, row_places, nothing, nothing),
            "gradient": Output(d.gradient, gradient.places[number], nothing, nothing),
            "jacobian": Output(d.jacobian, jacobian.places[number], *_triplet(d.jacobian_sparsity)),
            "hessian": Output(d.hessian, hessian.places[number], *_triplet(d.hessian_sparsity)),
        }
        blocks.append(NlpBlock(index, len(block.values), len(d.lower), first, outputs))
    try:
        return compile_nlp(
            blocks,
            size=layout.size,
            rows=layout.first_rows[-1],
            jacobian_nonzeros=len(jacobian.nonzeros),
            hessian_nonzeros=len(hessian.nonzeros),
            slacks=layout.slacks.levels,
            wait=required,
        ), ()
    except NotCompiledYet as still:
        return None, still.libraries
    except CompilationError as error:
        if required:
            raise
        logger.warning("the functions of the NLP are not compiled: %s", error)
        return None, ()


def _triplet(sparsity: ca.Sparsity) -> tuple[np.ndarray, np.ndarray]:
    row, column = sparsity.get_triplet()
    return np.array(row, dtype=int), np.array(column, dtype=int)


def _flat(tables: Sequence[np.ndarray]) -> np.ndarray:
    """Return all entries, table by table and copy by copy."""
    return np.concatenate([np.zeros(0, dtype=int), *(table.ravel(order="F") for table in tables)])
