"""CasADi functions as C that evaluates several copies at once, a copy in each lane of a vector."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path

import casadi as ca

from fesd_robot.native.compiler import CompilationError

CHUNK = 500
"""Instructions of one C function; the time to compile one grows faster than its length."""

_OPERATORS = {
    ca.OP_ASSIGN: "{0}",
    ca.OP_ADD: "{0} + {1}",
    ca.OP_SUB: "{0} - {1}",
    ca.OP_MUL: "{0} * {1}",
    ca.OP_DIV: "{0} / {1}",
    ca.OP_NEG: "-{0}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "{0} + {0}",
    ca.OP_INV: "ALL(1.0) / {0}",
    ca.OP_CONSTPOW: "lanes_pow({0}, {1})",
}
_UNARY = (
    "exp log sqrt sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh log1p expm1 erf fabs floor ceil sign not"
)
_BINARY = "pow lt le eq ne and or if_else_zero fmin fmax fmod remainder copysign atan2 hypot"
OPERATIONS: dict[int, str] = {
    **_OPERATORS,
    **{getattr(ca, f"OP_{name.upper()}"): f"lanes_{name}({{0}})" for name in _UNARY.split()},
    **{getattr(ca, f"OP_{name.upper()}"): f"lanes_{name}({{0}}, {{1}})" for name in _BINARY.split()},
}
"""C of every operation between operands {0} and {1}, with the helpers of lanes.h."""

LANES_VERSION = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()
"""Another one may write other C for the same function."""


def lanes_source(name: str, function: ca.Function) -> str:
    """Return C of ``void NAME(const lanes *in, lanes *out, lanes *work)``, to be included after lanes.h.

    Inputs and outputs are the nonzeros of the function's, one after the other; `work` holds ``function.sz_w()``.
    Straight-line code is cut into pieces, between which intermediate values rest in `work`, at CasADi's own places.

    Args:
        name: of the C function.
        function: of SX expressions.

    Raises:
        CompilationError: an operation has no C form; the message names it.
    """
    first_in, first_out = _offsets(function, "in"), _offsets(function, "out")
    count = int(function.n_instructions())
    operations = [function.instruction_id(k) for k in range(count)]
    inputs = [function.instruction_input(k) for k in range(count)]
    targets = [function.instruction_output(k) for k in range(count)]
    sources, last_use = _values(operations, inputs, targets)
    words: list[str] = [""] * count
    pieces: list[str] = []
    calls: list[str] = []
    for begin in range(0, max(count, 1), CHUNK):
        end = min(begin + CHUNK, count)
        body: list[str] = []
        loaded: set[int] = set()
        for k in range(begin, end):
            operation = operations[k]
            if operation == ca.OP_CONST:
                words[k] = f"ALL({_number(function.instruction_constant(k))})"
                continue
            if operation == ca.OP_INPUT:
                words[k] = f"in[{first_in[inputs[k][0]] + inputs[k][1]}]"
                continue
            for value in sources[k]:
                if value < begin and operations[value] not in (ca.OP_CONST, ca.OP_INPUT) and value not in loaded:
                    body.append(f"const lanes a{value} = work[{targets[value][0]}];")
                    loaded.add(value)
            operands = [words[value] for value in sources[k]]
            if operation == ca.OP_OUTPUT:
                body.append(f"out[{first_out[targets[k][0]] + targets[k][1]}] = {operands[0]};")
                continue
            form = OPERATIONS.get(operation)
            if form is None:
                raise CompilationError(f"{name}: CasADi's operation {operation} has no C form")
            words[k] = f"a{k}"
            body.append(f"const lanes a{k} = {form.format(*operands)};")
        body += [
            f"work[{targets[k][0]}] = a{k};" for k in range(begin, end) if last_use[k] >= end and words[k] == f"a{k}"
        ]
        pieces.append(
            f"static void {name}_{len(pieces)}(const lanes *restrict in, lanes *restrict out, lanes *restrict work)\n"
            "{\n" + "\n".join(body) + "\n}\n"
        )
        calls.append(f"    {name}_{len(calls)}(in, out, work);\n")
    return (
        "\n".join(pieces)
        + '\n__attribute__((visibility("hidden")))'
        + f"\nvoid {name}(const lanes *restrict in, lanes *restrict out, lanes *restrict work)\n{{\n"
        + "".join(calls)
        + "}\n"
    )


def _values(
    operations: list[int], inputs: list[list[int]], targets: list[list[int]]
) -> tuple[list[list[int]], list[int]]:
    """Return for each instruction the instructions that made its operands, and the last one that reads its result."""
    made: dict[int, int] = {}
    sources: list[list[int]] = []
    last_use = [-1] * len(operations)
    for k, operation in enumerate(operations):
        found = [] if operation in (ca.OP_CONST, ca.OP_INPUT) else [made[place] for place in inputs[k]]
        for value in found:
            last_use[value] = k
        sources.append(found)
        if operation != ca.OP_OUTPUT:
            made[targets[k][0]] = k
    return sources, last_use


def _offsets(function: ca.Function, side: str) -> list[int]:
    sizes = [getattr(function, f"nnz_{side}")(i) for i in range(getattr(function, f"n_{side}")())]
    return [sum(sizes[:i]) for i in range(len(sizes))]


def _number(value: float) -> str:
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0 else "-INFINITY"
    return value.hex()
