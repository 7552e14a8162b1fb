"""Compile the functions of an NLP: each block's functions as C, and one loop over their copies that reads tables."""

from __future__ import annotations

import _ctypes
import ctypes
import hashlib
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache, partial
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


@dataclass(frozen=True)
class Output:
    """A function of a block, and the places of its outputs in the result.

    Attributes:
        function: of (variables, parameters, sigmas) or, for the Hessian, also (weight of the cost, multipliers).
        at: index of each output of each copy among the entries of the result, (outputs, K); empty for the cost.
        row, column: of each output in the block's rows and variables, (outputs,); empty but for the matrices.
    """

    function: ca.Function
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
    wanted = [(_name(one), one) for block in blocks for _, one in _with_outputs(block)]
    pieces = dict(wanted)
    large = [name for name, function in pieces.items() if function.n_instructions() >= LARGE]
    groups = [*([name] for name in large), *_small(blocks)]

    def text(group: Sequence[str]) -> str:
        return "\n".join(['#include "lanes.h"', *(lanes_source(name, pieces[name]) for name in group)])

    def key(group: Sequence[str]) -> str:
        return "\n".join([LANES_VERSION, *group])

    libraries = shared_libraries(
        "stage",
        {key(group): partial(text, group) for group in groups},
        [*STAGE_FLAGS, instruction_set(), "-lm"],
        headers=[SOURCES / "lanes.h"],
        folders=[SOURCES],
        wait=wait,
    )
    where = {name: library for group, library in zip(groups, libraries, strict=True) for name in group}
    return [_address(where[name], name) for name, _ in wanted]


def _small(blocks: Sequence[NlpBlock]) -> list[tuple[str, ...]]:
    """Return the names of each block's small functions, which are compiled together."""
    own = [sorted({_name(one) for _, one in _with_outputs(block) if one.n_instructions() < LARGE}) for block in blocks]
    return list(dict.fromkeys(tuple(names) for names in own if names))


def _with_outputs(block: NlpBlock) -> Iterator[tuple[str, ca.Function]]:
    """Yield the functions of a block that return something, in the order of `KINDS`."""
    for kind in KINDS:
        if block.outputs[kind].function.nnz_out(0):
            yield kind, block.outputs[kind].function


@lru_cache(maxsize=1000)
def _name(function: ca.Function) -> str:
    """Return the name of a function in C by its formula: the same formula has the same name."""
    check_time()
    return f"stage_{hashlib.sha256(function.serialize().encode()).hexdigest()[:20]}"


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
            outputs = output.function.nnz_out(0)
            body.append(np.array([outputs]))
            if not outputs:
                continue
            if kind != "cost":
                body.append(_places(output.at))
            if kind in ("jacobian", "hessian"):
                body += [output.row, output.column]
            need = variables + block.parameters + 3 + block.rows + outputs
            work = max(work, need + output.function.sz_w())
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
