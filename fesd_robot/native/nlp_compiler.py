"""Compile the functions of an NLP: each block's functions as C, and one loop over their copies."""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import casadi as ca
import numpy as np

from fesd_robot.native.compiler import instruction_set, object_files, shared_library
from fesd_robot.native.lanes import LANES_VERSION, lanes_source

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
        parameters: (n_p, K).
        rows: number of rows of a copy; first_row: of the first copy.
        outputs: by kind, see `KINDS`.
    """

    index: np.ndarray
    parameters: np.ndarray
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
) -> dict[str, ca.Function]:
    """Return the NLP's functions by the names nlp, nlp_grad_f, nlp_jac_g, nlp_hess_l, from the cache if they are there.

    Large functions of the blocks are compiled by themselves, and again only when their formulas change; numbers of
    copies, parameters and indices go into a small library that is linked with them.

    Args:
        slacks: level of each slack variable, the index of its sigma; they are the last variables.

    Raises:
        CompilationError: no C compiler, or it failed.
    """
    serialized = {
        (number, kind): output.function.serialize()
        for number, block in enumerate(blocks)
        for kind, output in block.outputs.items()
        if output.function.nnz_out(0)
    }
    # Named by their contents, so that the same block is not compiled again where it has another number.
    names = {at: f"stage_{hashlib.sha256(text.encode()).hexdigest()[:20]}" for at, text in serialized.items()}
    pieces = {name: blocks[number].outputs[kind].function for (number, kind), name in names.items()}
    large = [name for name, function in pieces.items() if function.n_instructions() >= LARGE]
    groups = [*([name] for name in large), sorted(name for name in pieces if name not in large)]
    header = SOURCES / "lanes.h"

    def text(group: list[str]) -> str:
        return "\n".join(['#include "lanes.h"', *(lanes_source(name, pieces[name]) for name in group)])

    def key(group: list[str]) -> str:
        return "\n".join([LANES_VERSION, *group])

    objects = object_files(
        "nlp",
        {key(group): partial(text, group) for group in groups if group},
        [*STAGE_FLAGS, instruction_set()],
        headers=[header],
        folders=[SOURCES],
    )
    with tempfile.TemporaryDirectory() as folder:
        tables = Path(folder) / "tables.h"
        tables.write_text(_tables(blocks, names, size, rows, jacobian_nonzeros, hessian_nonzeros, slacks))
        library = shared_library(
            "nlp",
            [SOURCES / "nlp.c", *objects],
            [*LOOP_FLAGS, instruction_set(), "-lm"],
            headers=[header, tables],
            folders=[SOURCES, Path(folder)],
        )
    return {name: ca.external(name, str(library)) for name in ("nlp", "nlp_grad_f", "nlp_jac_g", "nlp_hess_l")}


def _tables(
    blocks: Sequence[NlpBlock],
    names: dict[tuple[int, str], str],
    size: int,
    rows: int,
    jacobian_nonzeros: int,
    hessian_nonzeros: int,
    slacks: np.ndarray,
) -> str:
    """Return tables.h, which nlp.c includes.

    Args:
        names: of each block's functions in C, by its number and kind.
    """
    lines = [f"stage {name};" for name in dict.fromkeys(names.values())]
    entries, work = [], 0
    for number, block in enumerate(blocks):
        name = f"block{number}"
        lines += [_array("double", f"{name}_parameter", [float(v).hex() for v in block.parameters.ravel(order="F")])]
        fields = [
            f".copies = {block.index.shape[1]}",
            f".variables = {len(block.index)}",
            f".parameters = {len(block.parameters)}",
            f".rows = {block.rows}",
            f".first_row = {block.first_row}",
            f".parameter = {name}_parameter",
            f".index = {_places(f'{name}_index', block.index, lines)}",
        ]
        for place, kind in enumerate(KINDS):
            output = block.outputs[kind]
            outputs = output.function.nnz_out(0)
            if not outputs:
                continue
            own = f"{name}_{kind}"
            fields += [f".function[{place}] = {names[number, kind]}", f".size[{place}] = {outputs}"]
            if output.at.size:
                fields.append(f".at[{place}] = {_places(f'{own}_at', output.at, lines)}")
            if output.row.size:
                lines += [_array("int", f"{own}_row", output.row), _array("int", f"{own}_column", output.column)]
                fields += [f".row[{place}] = {own}_row", f".column[{place}] = {own}_column"]
            need = len(block.index) + len(block.parameters) + 3 + block.rows + outputs
            work = max(work, need + output.function.sz_w())
        entries.append("    {" + ",\n     ".join(fields) + "}")
    adds = {
        kind: int(sum(block.outputs[kind].at.size for block in blocks) > nonzeros)
        for kind, nonzeros in (("jacobian", jacobian_nonzeros), ("hessian", hessian_nonzeros))
    }
    lines += [
        _array("int", "slack_level", slacks),
        f"enum {{ BLOCKS = {len(blocks)}, VARIABLES = {size}, ROWS_IN_ALL = {rows}, SLACKS = {len(slacks)},",
        f"       WORK = {work},",
        f"       JACOBIAN_NONZEROS = {jacobian_nonzeros}, HESSIAN_NONZEROS = {hessian_nonzeros},",
        f"       JACOBIAN_ADDS = {adds['jacobian']}, HESSIAN_ADDS = {adds['hessian']} }};",
        "static const block blocks[] = {\n" + ",\n".join(entries) + "\n};\n",
    ]
    return "\n".join(lines)


def _places(name: str, table: np.ndarray, lines: list[str]) -> str:
    """Return a C initialiser of indices (entries, K); copies that differ by a shift alone share a pattern."""
    entries, copies = table.shape
    shift = table[0] if entries else np.zeros(copies, int)
    patterns: dict[bytes, int] = {}
    which = [patterns.setdefault(copy.tobytes(), len(patterns)) for copy in np.ascontiguousarray((table - shift).T)]
    _, first = np.unique(which, return_index=True)
    lines += [
        _array("int", f"{name}_pattern", (table - shift)[:, first].ravel(order="F")),
        _array("int", f"{name}_which", which),
        _array("int", f"{name}_shift", shift),
    ]
    return f"{{{entries}, {name}_pattern, {name}_which, {name}_shift}}"


def _array(kind: str, name: str, values: Sequence[object] | np.ndarray) -> str:
    """Return a C table, of one zero if it would be empty."""
    return f"static const {kind} {name}[] = {{{', '.join(map(str, values)) or '0'}}};"
