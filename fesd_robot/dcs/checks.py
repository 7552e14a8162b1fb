"""Checks of the expressions of nonsmooth models, before these are reduced to complementarity conditions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import casadi as ca
import numpy as np

from fesd_robot.errors import DimensionError, ModelError


def as_expression(name: str, value: object) -> ca.SX:
    """Return an SX expression, or numbers as one; one-dimensional numbers become a column.

    Raises:
        ModelError: neither an SX nor numbers.
    """
    if isinstance(value, ca.SX):
        return value
    try:
        numbers = value.full() if isinstance(value, ca.DM) else np.asarray(value)
        if numbers.dtype.kind not in "biuf":  # asking for floats would make nan of None and of symbols
            raise TypeError
        return ca.SX(ca.DM(numbers.astype(float)))
    except (TypeError, ValueError, NotImplementedError):
        raise ModelError(f"{name} is of type {type(value).__name__}, must be a casadi SX or numbers") from None


def as_symbols(name: str, value: object) -> ca.SX:
    """Return a column of SX symbols; None and an empty expression become (0, 1).

    Raises:
        DimensionError: not a column.
        ModelError: an entry is not a symbol.
    """
    expression = ca.SX(0, 1) if value is None else as_expression(name, value)
    if not expression.numel():
        return ca.SX(0, 1)
    if expression.shape[1] != 1:
        raise DimensionError(f"{name} has shape {expression.shape}, expected ({expression.numel()}, 1)")
    for i in range(expression.numel()):
        if not (expression[i].is_dense() and expression[i].is_valid_input()):
            raise ModelError(f"{name}[{i}] is {expression[i]}, must be a symbol (ca.SX.sym)")
    return expression


def check_distinct(groups: Mapping[str, ca.SX]) -> None:
    """Check that no symbol occurs twice.

    Raises:
        ModelError: a symbol in two groups or twice in one.
    """
    owner: dict[int, str] = {}
    for name, symbols in groups.items():
        for symbol in _entries(symbols):
            key = symbol.element_hash()
            if key in owner:
                where = f"twice in {name}" if owner[key] == name else f"in {owner[key]} and in {name}"
                raise ModelError(f"the symbol {symbol} is {where}, every variable needs a symbol of its own")
            owner[key] = name


def check_unique(what: str, names: Iterable[str]) -> None:
    """Check that no name occurs twice.

    Raises:
        ModelError: a name that does.
    """
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise ModelError(f"two {what} are called '{name}', every one needs a name of its own")
        seen.add(name)


def check_shape(name: str, expression: ca.SX, shape: tuple[int, int], why: str = "") -> None:
    """Check the shape of an expression.

    Raises:
        DimensionError: another shape; the message names both and ends with `why`.
    """
    if expression.shape != shape:
        raise DimensionError(f"{name} has shape {expression.shape}, expected {shape}{why}")


def check_content(name: str, expression: ca.SX, allowed: Mapping[str, ca.SX]) -> None:
    """Check that an expression uses the symbols of the allowed groups only, and finite constants.

    Raises:
        ModelError: the message names the expression and the unknown symbols or the constant.
    """
    names = {symbol.element_hash(): str(symbol) for group in allowed.values() for symbol in _entries(group)}
    used = ca.symvar(expression)
    unknown = sorted({str(symbol) for symbol in used if symbol.element_hash() not in names})
    if unknown:
        twins = [symbol for symbol in unknown if symbol in names.values()]
        hint = f"; {twins[0]} there has the same name but is another symbol" if twins else ""
        groups = [group for group, symbols in allowed.items() if symbols.numel()]
        raise ModelError(f"{name} uses {', '.join(unknown)}, not found in {' or '.join(groups)}{hint}")
    function = ca.Function("constants", used, [expression])
    for i in range(function.n_instructions()):
        if function.instruction_id(i) == ca.OP_CONST and not np.isfinite(function.instruction_constant(i)):
            raise ModelError(f"{name} contains the constant {function.instruction_constant(i)}, must be finite")


def check_switching(name: str, expression: ca.SX, allowed: Mapping[str, ca.SX], forbidden: Mapping[str, ca.SX]) -> None:
    """Check a switching function or indicator; what is not continuous in time must not occur in it.

    Raises:
        ModelError: a symbol of a forbidden group, or whatever `check_content` refuses.
    """
    for group, symbols in forbidden.items():
        hashes = {symbol.element_hash() for symbol in _entries(symbols)}
        used = [str(symbol) for symbol in ca.symvar(expression) if symbol.element_hash() in hashes]
        if used:
            raise ModelError(
                f"{name} depends on {used[0]} of {group}, which may jump: its multipliers would not be continuous in "
                f"time (valid: {', '.join(allowed)}; make {used[0]} a state to switch on it)"
            )
    check_content(name, expression, allowed)


def _entries(symbols: ca.SX) -> list[ca.SX]:
    return [symbols[i] for i in range(symbols.numel())]
