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
"""Hash of this file; another version may write other C for the same function."""


def lanes_source(name: str, function: ca.Function) -> str:
    """Return C of ``void NAME(const lanes *in, lanes *out, lanes *work)``, to be included after lanes.h.

    Inputs and outputs are the nonzeros of the function's, one after the other; `work` holds ``function.sz_w()``.
    Straight-line code is cut into pieces, between which intermediate values are kept in `work`, at CasADi's own places.

    Args:
        name: of the C function.
        function: of SX expressions.

    Raises:
        CompilationError: an operation has no C form; the message names it.
    """
    program = _Program(name, function)
    starts = range(0, max(program.count, 1), CHUNK)
    arguments = "(const lanes *restrict in, lanes *restrict out, lanes *restrict work)"
    pieces = [
        f"static void {name}_{number}{arguments}\n{{\n{program.piece(begin, min(begin + CHUNK, program.count))}\n}}\n"
        for number, begin in enumerate(starts)
    ]
    calls = "".join(f"    {name}_{number}(in, out, work);\n" for number in range(len(starts)))
    whole = f"void {name}{arguments}\n{{\n{calls}}}\n"
    return "\n".join([*pieces, whole])


class _Program:
    """CasADi's instructions of a function, each known by its number, with the ones that its operands come from."""

    def __init__(self, name: str, function: ca.Function) -> None:
        self._name, self._function = name, function
        self.count = int(function.n_instructions())
        self._operations = [function.instruction_id(k) for k in range(self.count)]
        self._inputs = [function.instruction_input(k) for k in range(self.count)]
        self._targets = [function.instruction_output(k) for k in range(self.count)]
        self._first_in, self._first_out = _offsets(function, "in"), _offsets(function, "out")
        self._words = [""] * self.count
        self._sources: list[list[int]] = []
        self._last_use = [-1] * self.count
        made: dict[int, int] = {}
        for k, operation in enumerate(self._operations):
            operands = [] if operation in (ca.OP_CONST, ca.OP_INPUT) else [made[place] for place in self._inputs[k]]
            for value in operands:
                self._last_use[value] = k
            self._sources.append(operands)
            if operation != ca.OP_OUTPUT:
                made[self._targets[k][0]] = k

    def piece(self, begin: int, end: int) -> str:
        """Return C of the instructions from begin to end; it loads earlier results and stores those needed later."""
        lines: list[str] = []
        loaded: set[int] = set()
        for k in range(begin, end):
            for value in self._sources[k]:
                if value < begin and value not in loaded and self._is_variable(value):
                    lines.append(f"const lanes a{value} = work[{self._targets[value][0]}];")
                    loaded.add(value)
            lines += self._line(k)
        kept = (k for k in range(begin, end) if self._last_use[k] >= end and self._is_variable(k))
        return "\n".join([*lines, *(f"work[{self._targets[k][0]}] = a{k};" for k in kept)])

    def _is_variable(self, k: int) -> bool:
        """Return whether a result is a variable, kept in `work` between pieces; others are written out."""
        return self._operations[k] not in (ca.OP_CONST, ca.OP_INPUT)

    def _line(self, k: int) -> list[str]:
        operation, source, target = self._operations[k], self._inputs[k], self._targets[k]
        if operation == ca.OP_CONST:
            self._words[k] = f"ALL({_number(self._function.instruction_constant(k))})"
            return []
        if operation == ca.OP_INPUT:
            self._words[k] = f"in[{self._first_in[source[0]] + source[1]}]"
            return []
        operands = [self._words[value] for value in self._sources[k]]
        if operation == ca.OP_OUTPUT:
            return [f"out[{self._first_out[target[0]] + target[1]}] = {operands[0]};"]
        if operation not in OPERATIONS:
            raise CompilationError(f"{self._name}: CasADi's operation {operation} has no C form")
        self._words[k] = f"a{k}"
        return [f"const lanes a{k} = {OPERATIONS[operation].format(*operands)};"]


def _offsets(function: ca.Function, side: str) -> list[int]:
    sizes = [getattr(function, f"nnz_{side}")(i) for i in range(getattr(function, f"n_{side}")())]
    return [sum(sizes[:i]) for i in range(len(sizes))]


def _number(value: float) -> str:
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0 else "-INFINITY"
    return value.hex()
