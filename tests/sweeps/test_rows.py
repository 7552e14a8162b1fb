"""Which rows a sweep has."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest

from fesd_robot.errors import TaskError
from fesd_robot.sweeps import Rows, load_sweep
from fesd_robot.sweeps.rows import as_overrides


def rows_of(**keys: object) -> Rows:
    return Rows(load_sweep({"task": "hopper_one_jump", **keys}))


def test_a_product_has_every_combination_once() -> None:
    """The last key changes fastest, as in nested loops."""
    rows = rows_of(vary={"a.b": [1, 2, 3], "c.d": ["x", "y"]})
    expected = [{"a.b": a, "c.d": c} for a, c in product([1, 2, 3], ["x", "y"])]
    assert len(rows) == 6
    assert [rows.inputs(number) for number in range(6)] == expected


def test_zip_takes_values_one_by_one() -> None:
    """Values at the same place make a row; lists of other lengths are refused by name."""
    rows = rows_of(vary={"a.b": [1, 2], "c.d": [[0, 1], [0, 2]]}, combine="zip")
    assert [rows.inputs(number) for number in range(len(rows))] == [
        {"a.b": 1, "c.d": [0, 1]},
        {"a.b": 2, "c.d": [0, 2]},
    ]
    with pytest.raises(TaskError, match=r"vary\.c\.d: found 3 values, and 2 of 'a\.b', expected equally many"):
        rows_of(vary={"a.b": [1, 2], "c.d": [1, 2, 3]}, combine="zip")


def test_tasks_and_cases_vary() -> None:
    """Tasks are a key like others, cases the last one; a case's keys are values of the task, its name is none."""
    cases = {"plain": {}, "other": {"c.d": 3, "e.f": "x"}}
    rows = rows_of(task=None, vary={"task": ["one", "two"], "a.b": [1, 2]}, cases=cases)
    assert len(rows) == 8 and rows.keys == ["task", "a.b", "case"]
    assert rows.inputs(5) == {"task": "two", "a.b": 1, "case": "other"}
    assert rows.task(5) == "two" and rows.values_of_task(5) == {"a.b": 1, "c.d": 3, "e.f": "x"}
    assert rows.values_of_task(4) == {"a.b": 1}
    assert rows.first_rows == {"one": 0, "two": 4}


def test_a_case_may_name_its_task() -> None:
    """Cases of several tasks need no other one."""
    rows = rows_of(task=None, cases={"first": {"task": "one", "a.b": 1}, "second": {"task": "two"}})
    assert [rows.task(number) for number in range(2)] == ["one", "two"]
    assert rows.values_of_task(0) == {"a.b": 1}
    assert rows.first_rows == {"one": 0, "two": 1}


def test_ranges() -> None:
    """A range has both ends; a step may end before; logarithms are spaced evenly; values are round."""
    assert rows_of(vary={"a.b": {"range": [0.3, 0.5], "count": 3}}).values("a.b") == [0.3, 0.4, 0.5]
    assert rows_of(vary={"a.b": {"range": [0.1, 0.45], "step": 0.1}}).values("a.b") == [0.1, 0.2, 0.3, 0.4]
    assert rows_of(vary={"a.b": {"range": [0.0, 0.3], "step": 0.1}}).values("a.b") == [0.0, 0.1, 0.2, 0.3]
    assert rows_of(vary={"a.b": {"log_range": [0.1, 10], "count": 3}}).values("a.b") == [0.1, 1.0, 10.0]


def test_draws_depend_on_seed_and_key_alone() -> None:
    """Another key beside it does not change what is drawn for a key; another seed does."""
    spread = {"uniform": [2.0, 3.0], "count": 50}
    alone = rows_of(vary={"a.b": spread}).values("a.b")
    beside = rows_of(vary={"c.d": {"normal": [0.0, 1.0], "count": 50}, "a.b": spread}, combine="zip")
    assert alone == beside.values("a.b")
    assert alone != beside.values("c.d")
    assert alone != rows_of(vary={"a.b": spread}, seed=1).values("a.b")
    assert min(alone) >= 2.0 and max(alone) <= 3.0 and len(set(alone)) == 50


def test_other_draws_are_of_their_kind() -> None:
    """Log-uniform draws have half of their values below the geometric mean; choices are among those given."""
    drawn = np.array(rows_of(vary={"a.b": {"log_uniform": [0.01, 100.0], "count": 4000}}).values("a.b"))
    assert abs((drawn < 1.0).mean() - 0.5) < 0.05
    normal = np.array(rows_of(vary={"a.b": {"normal": [5.0, 0.5], "count": 4000}}).values("a.b"))
    assert abs(normal.mean() - 5.0) < 0.05 and abs(normal.std() - 0.5) < 0.05
    chosen = rows_of(vary={"a.b": {"choice": ["p", "q"], "count": 40}}).values("a.b")
    assert set(chosen) == {"p", "q"}


def test_a_million_rows_are_not_made() -> None:
    """Rows are worked out one at a time, from the first to the last."""
    rows = rows_of(vary={f"a.k{index}": list(range(100)) for index in range(5)})
    assert len(rows) == 100**5
    assert rows.inputs(len(rows) - 1) == {f"a.k{index}": 99 for index in range(5)}


def test_places_are_distances_between_values() -> None:
    """Numbers lie between 0 and 1 as they do in their range, in the order of rows."""
    rows = rows_of(vary={"a.b": [0.0, 1.0, 4.0], "c.d": ["x", "y"]})
    assert rows.places.shape == (6, 2)
    assert rows.places[:, 0].tolist() == [0.0, 0.0, 0.25, 0.25, 1.0, 1.0]
    assert rows.places[:, 1].tolist() == [0.0, 1.0] * 3


def test_overrides_read_back_as_the_same_values() -> None:
    """What a task's loader reads of an override is the value itself."""
    from fesd_robot.task.document import override_keys

    values = {"a.b": 1e-05, "a.c": True, "a.d": "text: with # signs", "a.e": [None, 2.5], "a.f": {"g": 3}, "a.h": None}
    data: dict[str, dict[str, object]] = {}
    override_keys(data, {}, as_overrides(values))
    assert data["a"] == {key.partition(".")[2]: value for key, value in values.items()}
    assert not math.isnan(1.0)
