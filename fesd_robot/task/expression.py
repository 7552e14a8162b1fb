"""Arithmetic expressions in coordinate names, as a task file writes them: parsed, never executed as Python."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from fesd_robot.errors import ExpressionError, nearest

FUNCTIONS = ("sin", "cos", "tan", "sqrt", "exp")
"""Names of the functions an expression may call, each of one argument (angles in radians)."""

_MAX_LENGTH = 1000
_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_UNARY: dict[type[ast.unaryop], Callable[[Any], Any]] = {ast.UAdd: operator.pos, ast.USub: operator.neg}
_ALLOWED = f"numbers, coordinate names, pi, + - * / **, parentheses and the functions {' '.join(FUNCTIONS)}"


def expression_names(expression: str | float) -> frozenset[str]:
    """Return the coordinate names that an expression uses.

    Args:
        expression: a number, or text such as ``-sin(root_pitch)``.

    Raises:
        ExpressionError: the text is no expression of the allowed kind; the message says why.
    """
    return frozenset(_names(_parse(expression)))


def evaluate_expression(
    expression: str | float,
    values: Mapping[str, Any],
    functions: Mapping[str, Callable[[Any], Any]] | None = None,
) -> Any:
    """Evaluate an expression on numbers or on any type with arithmetic operators (symbolic ones included).

    Args:
        expression: as for `expression_names`.
        values: coordinate name -> value, m or rad.
        functions: implementation of every name in `FUNCTIONS`; those of `math` by default.

    Raises:
        ExpressionError: not an expression of the allowed kind, or a name that is not in `values`.
    """
    table = functions if functions is not None else {name: getattr(math, name) for name in FUNCTIONS}
    return _evaluate(_parse(expression), values, table)


def _parse(expression: str | float) -> ast.expr:
    if isinstance(expression, int | float):
        return ast.Constant(float(expression))
    if len(expression) > _MAX_LENGTH:
        raise ExpressionError(f"an expression of {len(expression)} characters is longer than {_MAX_LENGTH}")
    if "^" in expression:
        raise ExpressionError("'^' is no operator here, write ** for powers")
    try:
        node = ast.parse(expression.strip(), mode="eval").body
        _check(node)
    except (SyntaxError, RecursionError, MemoryError) as error:
        raise ExpressionError("it is not an arithmetic expression") from error
    _check_constants(node)
    return node


def _check_constants(node: ast.expr) -> None:
    """Refuse parts without names that have no finite real value, such as 1/0."""
    functions = {name: getattr(math, name) for name in FUNCTIONS}
    for part in ast.walk(node):
        if isinstance(part, ast.BinOp | ast.Call) and not list(_names(part)):
            try:
                value = _evaluate(part, {}, functions)
            except (ArithmeticError, ValueError):
                value = math.nan
            if isinstance(value, complex) or not math.isfinite(value):
                raise ExpressionError(f"'{ast.unparse(part)}' is no finite number")


def _check(node: ast.expr) -> None:
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            if abs(value) > 1e300:
                raise ExpressionError("it contains a number that is not finite")
        case ast.Name(id=name):
            if name in FUNCTIONS:
                raise ExpressionError(f"'{name}' is a function, write {name}(...)")
        case ast.UnaryOp(op=op, operand=operand) if type(op) in _UNARY:
            _check(operand)
        case ast.BinOp(left=left, op=binary, right=right) if type(binary) in _BINARY:
            _check(left)
            _check(right)
        case ast.Call(func=ast.Name(id=name), args=[ast.expr() as argument], keywords=[]) if name in FUNCTIONS:
            _check(argument)
        case _:
            raise ExpressionError(f"'{ast.unparse(node)}' is not allowed, only {_ALLOWED}")


def _names(node: ast.expr) -> Iterator[str]:
    called = {id(child.func) for child in ast.walk(node) if isinstance(child, ast.Call)}
    for child in ast.walk(node):
        if isinstance(child, ast.Name) and child.id != "pi" and id(child) not in called:
            yield child.id


def _evaluate(node: ast.expr, values: Mapping[str, Any], functions: Mapping[str, Callable[[Any], Any]]) -> Any:
    match node:
        case ast.Constant(value=value):
            return float(value)  # type: ignore[arg-type]
        case ast.Name(id="pi"):
            return math.pi
        case ast.Name(id=name):
            if name not in values:
                raise ExpressionError(f"found '{name}', expected a name that has a value{nearest(name, values)}")
            return values[name]
        case ast.UnaryOp(op=op, operand=operand):
            return _UNARY[type(op)](_evaluate(operand, values, functions))
        case ast.BinOp(left=left, op=binary, right=right):
            return _BINARY[type(binary)](_evaluate(left, values, functions), _evaluate(right, values, functions))
        case ast.Call(func=ast.Name(id=name), args=[argument]):
            return functions[name](_evaluate(argument, values, functions))
    raise ExpressionError(f"'{ast.unparse(node)}' is not allowed, only {_ALLOWED}")
