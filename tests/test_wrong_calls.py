"""Public functions that are called wrongly say what they expect, by an exception of this package."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

import fesd_robot
from fesd_robot import dcs, fesd, mpcc, optimal_control
from fesd_robot.arguments import checked
from fesd_robot.errors import FesdRobotError, OptionError
from tests.wrong_calls import WRONG, Public, public, wrong_calls

ROOMS = (fesd_robot, dcs, fesd, mpcc, optimal_control)

MADE_BY_PROGRAM = {
    "AddedRows", "Attempted", "Block", "BlockEquations", "BoundBetween", "BranchBounds", "BranchNlp", "BranchPoint",
    "BranchSolver", "Certificate", "Clock", "ComplementaritySystem", "Conflict", "CrossComplementarity", "Demand",
    "Element", "Form", "Impulse", "Jump", "LeastViolation", "MpccSolution", "NlpReport", "NlpStatus", "Note",
    "OptimalControlSolution", "PairPolisher", "PathBetween", "Phase", "Plan", "Polisher", "PolishingReport",
    "RelaxedCost", "RelaxedNlp", "Residuals", "Scheme", "Sensitivity", "Simulation", "StartReport",
    "StepEquilibration", "StepReport", "SweepTable", "Tableau", "Task", "Trial",
}  # fmt: skip
"""Values that functions return or take from each other, types, and those that pydantic checks."""

OF_SOLUTIONS = {"Replanner", "at_stages", "begun", "conflict_at", "continue_on_branch", "with_stages"}
"""Functions of values that only a solve makes."""


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Public]:
    """All public functions and values by name."""
    return {one.name: one for one in public(tmp_path_factory.mktemp("written"))}


def test_every_public_name_is_called(everything: dict[str, Public]) -> None:
    """What `__all__` of the package and of its library without robots offers is called below, or listed above."""
    for room in ROOMS:
        for name in room.__all__:
            value = getattr(room, name)
            is_error = isinstance(value, type) and issubclass(value, Exception)
            if callable(value) and not is_error and name not in MADE_BY_PROGRAM | OF_SOLUTIONS:
                assert f"{room.__name__}.{name}" in everything


@pytest.mark.slow
def test_wrong_calls_say_what_is_expected(
    everything: dict[str, Public], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every argument is replaced by two dozen values: the call is done, or refused by an exception of this package."""
    monkeypatch.chdir(tmp_path)
    refused = 0
    for one in everything.values():
        one.function(**one.fitting)
        for what, arguments in wrong_calls(one):
            try:
                one.function(**arguments)
            except FesdRobotError as error:
                refused += 1
                assert ("\n" not in str(error) and "expected" in str(error)) or "must" in str(error) or str(error)
            except Exception as error:
                raise AssertionError(f"{one.name}: {what}: {type(error).__name__}: {error}") from error
    assert refused > 5000


def test_an_object_fits_nowhere(everything: dict[str, Public]) -> None:
    """An argument of no known type is refused by its name, of every parameter that is not open to all."""
    for one in everything.values():
        for name in one.parameters:
            if inspect.signature(one.function).parameters[name].annotation in ("Side | Sequence[Side]", "Any"):
                continue
            with pytest.raises(FesdRobotError, match=name):
                one.function(**{**one.fitting, name: WRONG["object"]})


@partial(checked, exact=True)
def _sums(counts: list[int], weight: float = 1.0, *, kind: Literal["plain", "square"] = "plain") -> float:
    return weight * sum(counts if kind == "plain" else [each**2 for each in counts])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (partial(_sums), "_sums: missing a required argument: 'counts', expected counts, weight, kind"),
        (partial(_sums, [1], times=2), "_sums: got an unexpected keyword argument 'times', expected counts"),
        (partial(_sums, "12"), "_sums: counts: found the text '12', expected a list, each entry a whole number"),
        (partial(_sums, [1, None]), "_sums: counts: found [1, None], expected a list, each entry a whole number"),
        (partial(_sums, [1], float("nan")), "_sums: weight: found nan, expected a number"),
        (partial(_sums, [1], True), "_sums: weight: found True, expected a number"),
        (partial(_sums, [1], kind="cubic"), "_sums: kind: found the text 'cubic', expected 'plain' or 'square'"),
        (partial(_sums, np.ones((2, 2))), "_sums: counts: found an array of float64 of shape (2, 2), expected a list"),
    ],
)
def test_messages_name_argument_and_what_is_expected(call: Callable[[], Any], message: str) -> None:
    """The function, the parameter, what was found and what its annotation allows."""
    with pytest.raises(OptionError) as caught:
        call()
    assert str(caught.value).startswith(message)


def test_what_fits_is_handed_on_as_it_is() -> None:
    """Numbers of NumPy are numbers, arrays of them lists, and nothing is converted; a value stays a dataclass."""
    assert _sums([1, 2]) == 3 and _sums((1, 2), np.float64(2)) == 6 and _sums(np.array([1, 2]), np.int64(2)) == 6
    end = optimal_control.EndTime(1, longest=2.0)
    assert dataclasses.replace(end, shortest=0.5) == optimal_control.EndTime(0.5, 2.0) and end.shortest == 1
    assert inspect.signature(_sums).parameters["weight"].default == 1.0 and _sums.__name__ == "_sums"
