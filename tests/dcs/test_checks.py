"""What counts as an expression, as symbols and as known content."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot.dcs.checks import as_expression, as_symbols, check_content
from fesd_robot.errors import ModelError

X = ca.SX.sym("x", 2)


@pytest.mark.parametrize(
    ("value", "shape"),
    [
        (2, (1, 1)),
        ([1, 2], (2, 1)),
        (np.ones((2, 3)), (2, 3)),
        (ca.DM([[1, 2], [3, 4]]), (2, 2)),
        (X.T, (1, 2)),
        ([[1, 2]], (1, 2)),
    ],
)
def test_numbers_are_expressions(value: Any, shape: tuple[int, int]) -> None:
    """Numbers keep their shape and values; a list of numbers is a column."""
    expression = as_expression("value", value)
    assert isinstance(expression, ca.SX) and expression.shape == shape
    if not isinstance(value, ca.SX):
        expected = value.full() if isinstance(value, ca.DM) else np.reshape(value, shape)
        assert np.array_equal(ca.evalf(expression).full(), expected)


@pytest.mark.parametrize("value", [None, "1", ca.MX.sym("x"), [X[0], X[1]], np.ones((2, 2, 2)), 1j, {}])
def test_anything_else_is_no_expression(value: Any) -> None:
    """What is neither an SX nor numbers of at most two dimensions is refused by name and type."""
    with pytest.raises(ModelError, match=f"gap is of type {type(value).__name__}, must be a casadi SX or numbers"):
        as_expression("gap", value)


@pytest.mark.parametrize("empty", [None, ca.SX(), ca.SX(0, 1), ca.SX(1, 0), []])
def test_no_symbols_are_an_empty_column(empty: Any) -> None:
    """Every way to say that there are none has the same shape."""
    assert as_symbols("control", empty).shape == (0, 1)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_constants_are_found_deep_in_an_expression(bad: float) -> None:
    """A constant that is not finite is found next to symbols; the same expression with a finite one is valid."""

    def expression(value: float) -> ca.SX:
        return ca.vertcat(X[0], ca.sin(X[1] + ca.SX(value)) * X[0] + 1)

    check_content("f", expression(1e300), {"state": X})
    with pytest.raises(ModelError, match=f"f contains the constant {bad}, must be finite"):
        check_content("f", expression(bad), {"state": X})


def test_unknown_symbols_are_listed_once() -> None:
    """Every unknown symbol is named, in alphabetical order, and no known one."""
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    with pytest.raises(ModelError) as caught:
        check_content("f", b * a + X[0] * b, {"state": X, "control": ca.SX(0, 1)})
    assert str(caught.value) == "f uses a, b, not found in state"
