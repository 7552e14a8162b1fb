"""The sweep file: a task or several, what is the same in all plans, and what varies."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, PrivateAttr, Tag, ValidationError, model_validator

from fesd_robot.errors import TaskError
from fesd_robot.examples import find_sweep, find_task
from fesd_robot.task import Origins, validation_error
from fesd_robot.task.document import read_document
from fesd_robot.task.fields import Count, Positive, Section, conflict, is_number
from fesd_robot.task.printable_names import refuse_hidden

Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
"""Two numbers."""

_WAYS = ("range", "log_range", "uniform", "log_uniform", "normal", "choice")


class Spread(Section):
    """Values of a key that are not listed one by one: a range, or random draws."""

    range: Pair | None = Field(default=None, description="First and last value; `count` or `step` says how many.")
    log_range: Pair | None = Field(
        default=None, description="First and last value, both positive, of values whose ratio is the same."
    )
    uniform: Pair | None = Field(default=None, description="Bounds between which values are drawn.")
    log_uniform: Pair | None = Field(
        default=None, description="Positive bounds between whose logarithms the logarithms of values are drawn."
    )
    normal: Pair | None = Field(default=None, description="Mean and standard deviation of values that are drawn.")
    choice: list[Any] | None = Field(default=None, min_length=1, description="What is drawn from.")
    count: Count | None = Field(default=None, description="Number of values.")
    step: Positive | None = Field(default=None, description="From one value of `range` to the next.")

    @property
    def way(self) -> str:
        """Which of the ways it is."""
        return next(way for way in _WAYS if getattr(self, way) is not None)

    @model_validator(mode="after")
    def _one_way(self) -> Spread:
        given = [way for way in _WAYS if getattr(self, way) is not None]
        if len(given) != 1:
            found = " and ".join(given) or "none of them"
            raise conflict((), f"found {found}, expected one of {', '.join(_WAYS)}")
        way = given[0]
        if self.step is not None and (way != "range" or self.count is not None):
            raise conflict(("step",), "found a step, expected one beside 'range' only, and without 'count'")
        if self.step is None and self.count is None:
            also = " or step" if way == "range" else ""
            raise conflict((way,), f"found '{way}' alone, expected count{also} beside it")
        self._check(way)
        return self

    def _check(self, way: str) -> None:
        if way == "choice":
            return
        first, second = getattr(self, way)
        if not (math.isfinite(first) and math.isfinite(second)):
            raise conflict((way,), f"found [{first:g}, {second:g}], expected two finite numbers")
        if way == "normal":
            if not second > 0:
                raise conflict((way,), f"found the standard deviation {second:g}, expected one greater than 0")
        elif not first < second:
            raise conflict((way,), f"found the empty range [{first:g}, {second:g}], expected the smaller number first")
        if way.startswith("log") and not first > 0:
            raise conflict((way,), f"found [{first:g}, {second:g}], expected positive numbers")


def _kind_of_values(value: Any) -> str:
    return "spread" if isinstance(value, dict | Spread) else "list"


Values = Annotated[
    Annotated[list[Any], Field(min_length=1), Tag("list")] | Annotated[Spread, Tag("spread")],
    Discriminator(_kind_of_values),
]
"""Values of a key: a list, or a range or random draws."""


TASK, CASE = "task", "case"
"""Columns of the task and of the case, where these vary."""


class Sweep(Section):
    """Many plans of one task or of several, in which values of some keys differ."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")] | None = Field(
        default=None, description="Name of the sweep; default: that of its file."
    )
    task: Annotated[str, Field(min_length=1)] | None = Field(
        default=None,
        description="The task file, relative to this file, or the name of a task that comes with the program; several "
        "are listed under `vary`, or named by cases.",
    )
    set: dict[str, Any] = Field(
        default_factory=dict, description="Key of the task, as of --set -> its value in all plans."
    )
    vary: dict[str, Values] = Field(
        default_factory=dict,
        description="Key of the task, as of --set, or model.mass, model.length, model.effort or model.friction, a "
        "factor -> its values: a list, a range or random draws; task -> a list of tasks.",
    )
    cases: dict[Annotated[str, Field(min_length=1)], dict[str, Any]] = Field(
        default_factory=dict,
        description="Name of a case -> keys of the task, as of --set, with their values, and perhaps `task`: what is "
        "varied together under a name. Cases vary like the last key of `vary`.",
    )
    combine: Literal["product", "zip"] = Field(
        default="product",
        description="Whether every value of a key meets every value of all others, or the first ones make the first "
        "plan, the second ones the second.",
    )
    seed: Annotated[int, Field(strict=True, ge=0)] = Field(default=0, description="Seed of all random draws.")
    warm: Literal["none", "nearest"] = Field(
        default="none",
        description="What a plan begins from: its task alone, or the solved plan of the nearest row, whose sequence of "
        "contacts it keeps; where that leads to no motion, its task alone.",
    )

    _origins: Origins = PrivateAttr(default_factory=Origins)

    @property
    def origins(self) -> Origins:
        """Where each key came from."""
        return self._origins

    def file_of(self, task: str) -> Path:
        """Return the file of a task; one relative to the sweep file goes before one that comes with the program.

        Args:
            task: as it is written in the sweep.

        Raises:
            TaskError: there is none.
        """
        beside = self._origins.folder / task
        try:
            return beside if beside.is_file() else find_task(task)
        except TaskError as error:
            raise self._origins.error(self._place_of(task), str(error)) from error

    def _place_of(self, task: str) -> tuple[str, ...]:
        """Return the key that names a task."""
        cases = [name for name, case in self.cases.items() if case.get(TASK) == task]
        if self.task == task:
            return (TASK,)
        return ("cases", cases[0], TASK) if cases else ("vary", TASK)

    def error(self, path: tuple[str, ...], message: str) -> TaskError:
        """Return the error about a key, with file and line."""
        return self._origins.error(path, message)

    @model_validator(mode="after")
    def _distinct(self) -> Sweep:
        if not self.vary and not self.cases:
            raise conflict(("vary",), "found an empty mapping, expected at least one entry, or cases")
        for key in self.vary:
            if key in self.set:
                raise conflict(("set", key), "this key varies too, expected it in 'set' or in 'vary'")
            for name, case in self.cases.items():
                if key in case:
                    raise conflict(("cases", name, key), "this key varies too, expected it in a case or in 'vary'")
        return self

    @model_validator(mode="after")
    def _has_a_task(self) -> Sweep:
        varied, named = self.vary.get(TASK), [case.get(TASK) for case in self.cases.values()]
        if varied is not None and not (isinstance(varied, list) and all(isinstance(one, str) for one in varied)):
            raise conflict(
                ("vary", TASK), "expected a list of task files, or names of tasks that come with the program"
            )
        for name, task in zip(self.cases, named, strict=True):
            if task is not None and not isinstance(task, str):
                raise conflict(("cases", name, TASK), f"found {task!r}, expected a task file or the name of a task")
        if self.task is not None and varied is not None:
            raise conflict((TASK,), "the task varies too, expected it here or in 'vary'")
        if self.task is None and varied is None and (not named or None in named):
            raise conflict((TASK,), "found no task, expected one here, a list in 'vary', or one in every case")
        if TASK in self.set:
            raise conflict(("set", TASK), "found a task, expected it beside 'set'")
        return self


def load_sweep(sweep: str | Path | Mapping[str, Any]) -> Sweep:
    """Load and check a sweep.

    Args:
        sweep: the YAML file, the name of a sweep that comes with the program, or its keys and values.

    Raises:
        TaskError: the file cannot be read or is no valid sweep; the error names file, line and key.
    """
    if isinstance(sweep, Mapping):
        data, origins, name = dict(sweep), Origins(), "sweep"
    else:
        file = find_sweep(sweep)
        data, origins = read_document(file, [], "sweep")
        name = file.stem
    refuse_hidden(data, origins)
    try:
        loaded = Sweep.model_validate(data)
    except ValidationError as error:
        raise validation_error(error, origins, Sweep) from error
    loaded = loaded.model_copy(update={"name": loaded.name or name})
    loaded._origins = origins
    for where, value in _written(loaded):
        if not is_plain(value):
            raise loaded.error(where, f"found {value!r}, expected a finite number, a text or a list of them")
    return loaded


def _written(loaded: Sweep) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Yield every value that is written in a sweep, with its key."""
    for key, value in loaded.set.items():
        yield ("set", key), value
    for name, case in loaded.cases.items():
        for key, value in case.items():
            yield ("cases", name, key), value
    for key, values in loaded.vary.items():
        for value in values if isinstance(values, list) else values.choice or []:
            yield ("vary", key), value


def is_plain(value: Any) -> bool:
    """Return whether a value can be written into a task."""
    if isinstance(value, dict):
        return all(isinstance(key, str) and is_plain(each) for key, each in value.items())
    if isinstance(value, list | tuple):
        return all(map(is_plain, value))
    if isinstance(value, float | int) and not isinstance(value, bool):
        return is_number(value) and math.isfinite(value)
    return value is None or isinstance(value, bool | str)
