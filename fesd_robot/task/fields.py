"""Value types shared by all parts of a task file: strict finite numbers, names, bounds."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, PlainSerializer, WithJsonSchema
from pydantic_core import PydanticCustomError


class Section(BaseModel):
    """Base of all parts of a task: frozen, closed against unknown keys, no conversion of text to numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


def expected(what: str) -> PydanticCustomError:
    """Return the error "found ..., expected `what`"; the value found is added where the error is reported."""
    return PydanticCustomError("expected", "expected {what}", {"what": what})


def conflict(at: tuple[str, ...], sentence: str) -> PydanticCustomError:
    """Return an error about keys that contradict each other; `at` is the key to blame, below the validated model."""
    return PydanticCustomError("conflict", "{sentence}", {"sentence": sentence, "at": at})


def is_number(value: Any) -> bool:
    """Return whether `value` is an int or float (not a bool) that is no NaN and fits a float."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return not math.isnan(float(value))
    except OverflowError:
        return False


def kind_of(default: str) -> Callable[[Any], str]:
    """Return the discriminator of a tagged union whose key `type` may be left out, which means `default`."""

    def kind(value: Any) -> str:
        # What is no mapping at all is reported by the default's own model.
        return str(value.get("type", default)) if isinstance(value, dict) else getattr(value, "type", default)

    return kind


_BOUNDS = "two numbers [lower, upper] with lower < upper (null for no limit on that side)"


def _read_bounds(value: Any) -> tuple[float, float]:
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise expected(_BOUNDS)
    lower = -math.inf if value[0] is None else value[0]
    upper = math.inf if value[1] is None else value[1]
    if not (is_number(lower) and is_number(upper) and lower < upper):
        raise expected(_BOUNDS)
    return float(lower), float(upper)


def _read_symmetric_bounds(value: Any) -> tuple[float, float]:
    if isinstance(value, list | tuple):
        return _read_bounds(value)
    if not is_number(value) or value <= 0:
        raise expected(f"a number greater than 0, meaning plus or minus that number, or {_BOUNDS}")
    return -float(value), float(value)


def _write_bounds(bounds: tuple[float, float]) -> list[float | None]:
    return [None if math.isinf(bound) else bound for bound in bounds]


_BOUNDS_SCHEMA: dict[str, Any] = {
    "type": "array",
    "prefixItems": [{"type": ["number", "null"]}, {"type": ["number", "null"]}],
    "minItems": 2,
    "maxItems": 2,
}

NameKind = Literal[
    "configuration coordinate",
    "velocity coordinate",
    "joint",
    "frame",
    "control",
    "group of controls",
    "contact",
    "posture",
    "axis",
]
"""Kinds of things that a name in a task stands for."""

Name = Annotated[str, Field(min_length=1)]
"""Name of a joint, coordinate, frame, contact or control."""


def _check_plain(name: str) -> str:
    if not all(part.isalnum() or part == "_" for part in name) or not name[:1].isalpha():
        raise expected("a name of letters, digits and '_' that begins with a letter")
    return name


PlainName = Annotated[
    str, AfterValidator(_check_plain), WithJsonSchema({"type": "string", "pattern": "^[A-Za-z][A-Za-z0-9_]*$"})
]
"""A name that is made up in the task, as a part of others."""


def _read_distinct(names: list[str]) -> list[str]:
    if len(set(names)) < len(names):
        raise expected("every name once")
    return names


Names = Annotated[list[Name], Field(min_length=1), AfterValidator(_read_distinct)]
"""At least one name, none twice."""

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
"""A finite number; text and booleans are refused."""


def _read_place(value: Any) -> tuple[float, float, float]:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise expected("three numbers [x, y, z]")
    if not all(is_number(part) and math.isfinite(part) for part in value):
        raise expected("three finite numbers [x, y, z]")
    x, y, z = map(float, value)
    return x, y, z


Offset = Annotated[
    tuple[float, float, float],
    BeforeValidator(_read_place),
    WithJsonSchema({"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}),
]
"""A place in the axes of a frame or of the world, m."""

Acceleration = Annotated[
    tuple[float, float, float],
    BeforeValidator(_read_place),
    WithJsonSchema({"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}),
]
"""An acceleration along the axes of the world, m/s2."""

NonNegative = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0)]
"""A finite number, at least zero."""

Positive = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0)]
"""A finite number greater than zero."""


def _read_ratio(value: Any) -> float:
    if not is_number(value) or not 0 <= value <= 1:
        raise expected("a number from 0 to 1")
    return float(value)


Ratio = Annotated[
    float,
    BeforeValidator(_read_ratio),
    WithJsonSchema({"type": "number", "minimum": 0, "maximum": 1}),
]
"""A number from zero to one."""


def _read_reserve(value: Any) -> float:
    if not is_number(value) or not 0 <= value < 1:
        raise expected("a number from 0 to less than 1, the part that is left unused")
    return float(value)


Reserved = Annotated[
    float,
    BeforeValidator(_read_reserve),
    WithJsonSchema({"type": "number", "minimum": 0, "exclusiveMaximum": 1}),
]
"""The part of what there is that a plan leaves unused, from zero to less than one."""

Count = Annotated[int, Field(strict=True, ge=1)]
"""A whole number, at least one."""

Bounds = Annotated[
    tuple[float, float],
    BeforeValidator(_read_bounds),
    PlainSerializer(_write_bounds, when_used="json"),
    WithJsonSchema(_BOUNDS_SCHEMA),
]
"""``[lower, upper]``; null (in Python an infinity) stands for no limit on that side."""

SymmetricBounds = Annotated[
    tuple[float, float],
    BeforeValidator(_read_symmetric_bounds),
    PlainSerializer(_write_bounds, when_used="json"),
    WithJsonSchema({"anyOf": [{"type": "number", "exclusiveMinimum": 0}, _BOUNDS_SCHEMA]}),
]
"""`Bounds`, or one positive number b for ``[-b, b]``."""

AXES = ("x", "y", "z")
_POINT = "[x, y, z] or a mapping of x, y and z, null or left out where an axis does not matter"


def _read_point(value: Any) -> tuple[float | None, float | None, float | None]:
    if isinstance(value, dict) and set(value) <= set(AXES):
        value = [value.get(axis) for axis in AXES]
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise expected(_POINT)
    if any(part is not None and not (is_number(part) and math.isfinite(part)) for part in value):
        raise expected(_POINT)
    if all(part is None for part in value):
        raise expected(f"{_POINT}, with at least one number")
    x, y, z = (None if part is None else float(part) for part in value)
    return x, y, z


def _read_axis_weights(value: Any) -> dict[str, float]:
    weights = dict.fromkeys(AXES, value) if is_number(value) else value
    if not isinstance(weights, dict) or not set(weights) <= set(AXES):
        raise expected("a number of at least 0, or a mapping of x, y and z to such numbers")
    if any(not is_number(weight) or math.isinf(weight) or weight < 0 for weight in weights.values()):
        raise expected("a number of at least 0, or a mapping of x, y and z to such numbers")
    return {axis: float(weight) for axis, weight in weights.items()}


_AXIS_SCHEMA: dict[str, Any] = {"type": ["number", "null"]}
_BY_AXIS: dict[str, Any] = {
    "type": "object",
    "properties": {axis: {"description": f"The {axis} axis.", **_AXIS_SCHEMA} for axis in AXES},
    "additionalProperties": False,
}

Point = Annotated[
    tuple[float | None, float | None, float | None],
    BeforeValidator(_read_point),
    WithJsonSchema(
        {"anyOf": [{"type": "array", "items": _AXIS_SCHEMA, "minItems": 3, "maxItems": 3}, _BY_AXIS]},
    ),
]
"""Coordinates along the world's axes; None where an axis does not matter."""

AxisWeights = Annotated[
    dict[str, float],
    BeforeValidator(_read_axis_weights),
    WithJsonSchema({"anyOf": [{"type": "number", "minimum": 0}, _BY_AXIS]}),
]
"""Axis -> weight of a square; one number stands for all three axes."""

Values = dict[Name, Number]
"""Name of a coordinate -> value in its own unit."""

Weights = dict[Name, NonNegative]
"""Name of a coordinate or control -> weight of its square."""
