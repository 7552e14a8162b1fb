"""The base of all parts of a plan: frozen records, and arrays that are lists of numbers in JSON."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, PlainSerializer


def _to_array(value: Any) -> np.ndarray:
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError("expected a list of numbers") from error
    if array.ndim != 1:
        raise ValueError(f"expected a list of numbers, found an array of {array.ndim} dimensions")
    return array


def _to_arrays(value: Any) -> np.ndarray:
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError("expected lists of numbers of one length") from error


Array = Annotated[
    np.ndarray,
    BeforeValidator(_to_array),
    PlainSerializer(lambda array: array.tolist()),
]
"""A float array in Python, a list of numbers in JSON."""

Arrays = Annotated[
    np.ndarray,
    BeforeValidator(_to_arrays),
    PlainSerializer(lambda array: array.tolist()),
]
"""A float array of any dimensions in Python, lists of lists in JSON."""


class Record(BaseModel):
    """Base of all parts of a plan: frozen, closed against unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True, ser_json_inf_nan="strings")
