"""The rows of a sweep: which values each has, made one at a time, so that a million of them need no memory."""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from fesd_robot.sweeps.schema import CASE, TASK, Spread, Sweep

_DIGITS = 12
"""Of values of a range: 0.42, not 0.42000000000000004."""

MOST_VALUES = 10_000_000
"""Of one key."""


class Rows:
    """The rows of a sweep, by number.

    Args:
        sweep: whose values are drawn here, the same ones every time.

    Raises:
        TaskError: values of keys that are combined one by one are not equally many, or there are too many.
    """

    def __init__(self, sweep: Sweep) -> None:
        self._sweep = sweep
        self._values = {key: _listed(sweep, key, values) for key, values in sweep.vary.items()}
        if sweep.cases:
            self._values[CASE] = list(sweep.cases)
        counts = {key: len(values) for key, values in self._values.items()}
        if sweep.combine == "zip" and len(set(counts.values())) > 1:
            first = next(iter(counts))
            other = next(key for key in counts if counts[key] != counts[first])
            raise sweep.error(
                ("cases",) if other == CASE else ("vary", other),
                f"found {counts[other]} values, and {counts[first]} of '{first}', expected equally many with combine: "
                "zip",
            )
        self._counts = counts

    def __len__(self) -> int:
        counts = list(self._counts.values())
        return counts[0] if self._sweep.combine == "zip" else math.prod(counts)

    @property
    def keys(self) -> list[str]:
        """The keys that vary, ``task`` and ``case`` among them where these do."""
        return list(self._values)

    def values(self, key: str) -> Sequence[Any]:
        """Return all values of a key."""
        return self._values[key]

    def inputs(self, number: int) -> dict[str, Any]:
        """Return key -> value of a row; the values of the last key change fastest."""
        if self._sweep.combine == "zip":
            return {key: values[number] for key, values in self._values.items()}
        chosen: dict[str, Any] = {}
        for key, values in reversed(self._values.items()):
            number, index = divmod(number, len(values))
            chosen[key] = values[index]
        return dict(reversed(chosen.items()))

    def task(self, number: int) -> str:
        """Return the task of a row, as it is written in the sweep."""
        inputs = self.inputs(number)
        named = inputs.get(TASK) or self._sweep.cases.get(inputs.get(CASE, ""), {}).get(TASK) or self._sweep.task
        assert named is not None, "a sweep has a task for every row"
        return str(named)

    def values_of_task(self, number: int) -> dict[str, Any]:
        """Return key of the task -> value of a row, those of its case among them."""
        inputs = self.inputs(number)
        case = self._sweep.cases.get(inputs.pop(CASE, ""), {})
        return {key: value for key, value in (case | inputs).items() if key != TASK}

    @cached_property
    def first_rows(self) -> dict[str, int]:
        """Every task with the number of its first row."""
        key = TASK if TASK in self._values else CASE
        if key not in self._values:
            return {self.task(0): 0}
        later = list(self._counts.values())[list(self._counts).index(key) + 1 :]
        stride = 1 if self._sweep.combine == "zip" else math.prod(later)
        found: dict[str, int] = {}
        for index in range(self._counts[key]):
            found.setdefault(self.task(index * stride), index * stride)
        return found

    @cached_property
    def places(self) -> np.ndarray:
        """Where rows lie to each other, (rows, keys): numbers from 0 to 1, of other values their index."""
        columns = [_scaled(values) for values in self._values.values()]
        if self._sweep.combine == "zip":
            return np.column_stack(columns).astype(np.float32)
        grids = np.meshgrid(*[np.asarray(column, dtype=np.float32) for column in columns], indexing="ij", copy=False)
        return np.column_stack([grid.ravel() for grid in grids])


def as_overrides(values: Mapping[str, Any]) -> tuple[str, ...]:
    """Return key -> value as overrides of a task, ``key=value`` each."""
    return tuple(f"{key}={json.dumps(value)}" for key, value in values.items())


def _listed(sweep: Sweep, key: str, values: list[Any] | Spread) -> Sequence[Any]:
    """Return all values of a key."""
    if isinstance(values, list):
        return values
    count, way = values.count or 0, values.way
    if values.step is not None:
        assert values.range
        count = math.floor((values.range[1] - values.range[0]) / values.step * (1 + 1e-12)) + 1
    if count > MOST_VALUES:
        raise sweep.error(("vary", key), f"found {count} values, expected at most {MOST_VALUES}")
    if way in ("range", "log_range"):
        return _spaced(values, count)
    draw = np.random.default_rng([sweep.seed, zlib.crc32(key.encode())])
    if way == "choice":
        assert values.choice
        return [values.choice[index] for index in draw.integers(len(values.choice), size=count)]
    first, second = getattr(values, way)
    if way == "normal":
        return _rounded(draw.normal(first, second, count))
    if way == "log_uniform":
        return _rounded(np.exp(draw.uniform(math.log(first), math.log(second), count)))
    return _rounded(draw.uniform(first, second, count))


def _spaced(values: Spread, count: int) -> list[float]:
    if values.log_range:
        return _rounded(np.geomspace(values.log_range[0], values.log_range[1], count))
    assert values.range
    if values.step is not None:
        return _rounded(values.range[0] + values.step * np.arange(count))
    return _rounded(np.linspace(values.range[0], values.range[1], count))


def _rounded(values: np.ndarray) -> list[float]:
    return [float(f"{value:.{_DIGITS}g}") for value in values]


def _scaled(values: Sequence[Any]) -> np.ndarray:
    """Return numbers between 0 and 1, of other values their index in the same way."""
    numeric = all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)
    entries = list(map(json.dumps, values))
    first = {entry: index for index, entry in reversed(list(enumerate(entries)))}
    numbers = np.array(values if numeric else [first[entry] for entry in entries], dtype=float)
    span = np.ptp(numbers)
    return (numbers - numbers.min()) / (span or 1.0)
