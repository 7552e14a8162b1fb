"""Expressions in a task file: what they may contain, which names they use, what they are worth."""

from __future__ import annotations

import math

import pytest

from fesd_robot.errors import ExpressionError
from fesd_robot.task import evaluate_expression, expression_names


@pytest.mark.parametrize(
    ("expression", "names", "value"),
    [
        ("-sin(pitch)", {"pitch"}, -math.sin(0.3)),
        ("cos(pitch) * leg + 2", {"pitch", "leg"}, math.cos(0.3) * 0.5 + 2),
        ("sqrt(leg**2 + tan(pitch)**2)", {"pitch", "leg"}, math.hypot(0.5, math.tan(0.3))),
        ("exp(-pi / 2) - +leg", {"leg"}, math.exp(-math.pi / 2) - 0.5),
        (" 1e-3 ", set(), 1e-3),
        ("1/2", set(), 0.5),
        (3, set(), 3.0),
        (-0.5, set(), -0.5),
    ],
)
def test_an_expression_has_names_and_a_value(expression: str | float, names: set[str], value: float) -> None:
    """The names found are those needed, and the value is that of the same formula in Python."""
    assert expression_names(expression) == names
    values = {name: {"pitch": 0.3, "leg": 0.5}[name] for name in names}
    assert evaluate_expression(expression, values) == pytest.approx(value, rel=1e-15)


def test_functions_can_be_replaced() -> None:
    """Symbolic functions take the place of those on numbers."""
    assert evaluate_expression("sin(x)", {"x": "q"}, {"sin": lambda argument: f"sine of {argument}"}) == "sine of q"


@pytest.mark.parametrize(
    "expression",
    [
        "",
        "   ",
        "sin",
        "sin()",
        "sin(1, 2)",
        "sin(x=1)",
        "atan(x)",
        "x.y",
        "x[0]",
        "x if y else z",
        "x < y",
        "x and y",
        "not x",
        "~x",
        "x // 2",
        "x % 2",
        "x @ y",
        "x ^ 2",
        "1j",
        "True",
        "'a'",
        "1e999",
        "lambda: 1",
        "(x := 1)",
        "[x]",
        "__import__('os').system('true')",
        "x; y",
        "x\ny",
        "(" * 300 + "x" + ")" * 300,
        "+".join(["x"] * 1000),
    ],
)
def test_anything_else_is_refused(expression: str) -> None:
    """Only arithmetic is an expression; nothing is ever executed."""
    with pytest.raises(ExpressionError):
        expression_names(expression)


def test_a_name_without_a_value_is_an_error() -> None:
    """A name that has no value is named, with the nearest one that has."""
    with pytest.raises(ExpressionError, match=r"found 'leg', .*did you mean 'legs'"):
        evaluate_expression("2 * leg", {"legs": 1.0})
