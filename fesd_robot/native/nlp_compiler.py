"""Compile the functions of an NLP: each block's functions as C, and one loop over their copies that reads tables."""

from __future__ import annotations

import _ctypes
import ctypes
import hashlib
import shutil
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, partial
from pathlib import Path

import casadi as ca
import numpy as np

from fesd_robot.errors import SolverError
from fesd_robot.native.cache import cache_folder
from fesd_robot.native.compiler import CompilationError, instruction_set, shared_libraries, shared_library
from fesd_robot.native.lanes import LANES_VERSION, lanes_source
from fesd_robot.running import check_time

SOURCES = Path(__file__).parent / "nlp"
EXACT = ("-std=gnu99", "-ffp-contract=off", "-fno-math-errno")
STAGE_FLAGS, LOOP_FLAGS = (*EXACT, "-Og"), (*EXACT, "-O2")
"""For the long straight code of the blocks -O1 doubles the time to compile for 20 %, and -O2 does so again for nothing.
Without contraction the results are those of CasADi to the last bit."""

LARGE = 1500
"""Instructions from which on a function is compiled by itself, at the same time as others."""

KINDS = ("cost", "rows", "gradient", "jacobian", "hessian")
"""In the order of nlp.c."""


@dataclass(frozen=True, eq=False)
class Formula:
    """A function, and what is known of it before it is made.

    Args:
        known_name: in C, by the formula: the same one has the same name; empty where it is not known yet.
        instructions: of one evaluation.
        outputs: nonzeros that it returns.
        work: numbers that an evaluation keeps meanwhile.
        make: the function.
    """

    known_name: str
    instructions: int
    outputs: int
    work: int
    make: Callable[[], ca.Function]

    @classmethod
    def of(cls, function: ca.Function) -> Formula:
        """Return that of a function with one output."""
        sizes = int(function.n_instructions()), int(function.nnz_out(0)), int(function.sz_w())
        return cls("", *sizes, lambda: function)

    @cached_property
    def function(self) -> ca.Function:
        """The function."""
        return self.make()

    @cached_property
    def name(self) -> str:
        """In C."""
        check_time()
        return self.known_name or f"stage_{hashlib.sha256(self.function.serialize().encode()).hexdigest()[:20]}"


@dataclass(frozen=True)
class Output:
    """A function of a block, and the places of its outputs in the result.

    Attributes:
        formula: of (variables, parameters, sigmas) or, for the Hessian, also (weight of the cost, multipliers).
        at: index of each output of each copy among the entries of the result, (outputs, K); empty for the cost.
        row, column: of each output in the block's rows and variables, (outputs,); empty but for the matrices.
    """

    formula: Formula
    at: np.ndarray
    row: np.ndarray
    column: np.ndarray


@dataclass(frozen=True)
class NlpBlock:
    """Copies of a few functions.

    Attributes:
        index: global index of each variable, (n, K).
        parameters: number n_p of parameters of a copy; those of all copies follow each other, behind the two sigmas.
        rows: number of rows of a copy; first_row: of the first copy.
        outputs: by kind, see `KINDS`.
    """

    index: np.ndarray
    parameters: int
    rows: int
    first_row: int
    outputs: dict[str, Output]


def compile_nlp(
    blocks: Sequence[NlpBlock],
    *,
    size: int,
    rows: int,
    jacobian_nonzeros: int,
    hessian_nonzeros: int,
    slacks: np.ndarray,
    wait: bool = True,
) -> dict[str, ca.Function]:
    """Return the NLP's functions by the names nlp, nlp_grad_f, nlp_jac_g, nlp_hess_l.

    Functions of the blocks are compiled, the large ones by themselves, and again only when their formulas change; the
    loop over copies is compiled once for all NLPs. Numbers of copies and indices are tables that a copy of it reads.

    Args:
        slacks: level of each slack variable, the index of its sigma; they are the last variables.
        wait: whether the caller waits for the compiler.

    Raises:
        CompilationError: no C compiler, or it failed while the caller waited.
        NotCompiledYet: the caller does not wait.
    """
    functions = _functions(blocks, wait)
    loop = build_loop()
    integers = _tables(blocks, size, rows, jacobian_nonzeros, hessian_nonzeros, slacks)
    # A library that was loaded already would be the same one, with its tables: every NLP has its own file.
    with tempfile.TemporaryDirectory(dir=cache_folder(), prefix=".nlp-") as folder:
        own = str(shutil.copyfile(loop, Path(folder) / loop.name))
        library = _loaded(Path(own))
        refused = library.nlp_tables(
            integers.ctypes.data_as(ctypes.c_void_p),
            ctypes.c_size_t(len(integers)),
            (ctypes.c_void_p * len(functions))(*functions),
        )
        if refused:
            raise SolverError("there is no memory for the tables of the NLP")
        made = {name: ca.external(name, own) for name in ("nlp", "nlp_grad_f", "nlp_jac_g", "nlp_hess_l")}
        _ctypes.dlclose(library._handle)  # CasADi keeps it
    return made


def build_loop() -> Path:
    """Return the library with the loop over copies.

    Raises:
        CompilationError: no compiler, or it failed.
    """
    flags = [*LOOP_FLAGS, instruction_set()]
    return shared_library("nlp", [SOURCES / "nlp.c"], flags, headers=[SOURCES / "lanes.h"], folders=[SOURCES])


def _functions(blocks: Sequence[NlpBlock], wait: bool) -> list[int]:
    """Return the addresses of all functions of all blocks, in their order, compiled if they have to be."""
    wanted = [one for block in blocks for one in _with_outputs(block)]
    pieces = {one.name: one for one in wanted}
    groups = [*([name] for name, one in pieces.items() if one.instructions >= LARGE), *_small(blocks)]

    def prepared(group: Sequence[str]) -> Callable[[], str]:
        functions = {name: pieces[name].function for name in group}
        return lambda: "\n".join(['#include "lanes.h"', *(lanes_source(*one) for one in functions.items())])

    def key(group: Sequence[str]) -> str:
        return "\n".join([LANES_VERSION, *group])

    libraries = shared_libraries(
        "stage",
        {key(group): partial(prepared, group) for group in groups},
        [*STAGE_FLAGS, instruction_set(), "-lm"],
        headers=[SOURCES / "lanes.h"],
        folders=[SOURCES],
        wait=wait,
    )
    where = {name: library for group, library in zip(groups, libraries, strict=True) for name in group}
    return [_address(where[one.name], one.name) for one in wanted]


def _small(blocks: Sequence[NlpBlock]) -> list[tuple[str, ...]]:
    """Return the names of each block's small functions, which are compiled together."""
    own = [sorted({one.name for one in _with_outputs(block) if one.instructions < LARGE}) for block in blocks]
    return list(dict.fromkeys(tuple(names) for names in own if names))


def _with_outputs(block: NlpBlock) -> list[Formula]:
    """Return the functions of a block that return something, in the order of `KINDS`."""
    return [formula for formula in (block.outputs[kind].formula for kind in KINDS) if formula.outputs]


@cache
def _address(library: Path, name: str) -> int:
    """Return where a function is; its library stays loaded."""
    found = ctypes.cast(getattr(_loaded(library), name), ctypes.c_void_p).value
    assert found is not None
    return found


def _loaded(library: Path) -> ctypes.CDLL:
    """Return a library in this process.

    Raises:
        CompilationError: the system does not load it.
    """
    try:
        return ctypes.CDLL(str(library))
    except OSError as error:
        raise CompilationError(f"{library.name} cannot be loaded: {error}") from error


def _tables(
    blocks: Sequence[NlpBlock], size: int, rows: int, jacobian_nonzeros: int, hessian_nonzeros: int, slacks: np.ndarray
) -> np.ndarray:
    """Return the integers that nlp.c reads, in its order."""
    body, work, parameters = list[np.ndarray](), 0, 2
    for block in blocks:
        variables, copies = block.index.shape
        body += [
            np.array([copies, variables, block.parameters, parameters, block.rows, block.first_row]),
            _places(block.index),
        ]
        parameters += block.parameters * copies
        for kind in KINDS:
            output = block.outputs[kind]
            outputs = output.formula.outputs
            body.append(np.array([outputs]))
            if not outputs:
                continue
            if kind != "cost":
                body.append(_places(output.at))
            if kind in ("jacobian", "hessian"):
                body += [output.row, output.column]
            need = variables + block.parameters + 3 + block.rows + outputs
            work = max(work, need + output.formula.work)
    first = [len(blocks), size, parameters, rows, work]
    for kind, nonzeros in (("jacobian", jacobian_nonzeros), ("hessian", hessian_nonzeros)):
        first += [nonzeros, int(sum(block.outputs[kind].at.size for block in blocks) > nonzeros)]
    integers = np.concatenate([np.array([*first, len(slacks)]), slacks, *body])
    return integers.astype(np.int32)


def _places(table: np.ndarray) -> np.ndarray:
    """Return indices, (entries, K), as nlp.c reads them; copies that differ by a shift alone share a pattern."""
    entries, copies = table.shape
    shift = table[0] if entries else np.zeros(copies, int)
    patterns: dict[bytes, int] = {}
    which = [patterns.setdefault(copy.tobytes(), len(patterns)) for copy in np.ascontiguousarray((table - shift).T)]
    _, first = np.unique(which, return_index=True)
    return np.concatenate([[entries, len(first)], (table - shift)[:, first].ravel(order="F"), which, shift])
