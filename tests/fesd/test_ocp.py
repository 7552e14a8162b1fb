"""An optimal control problem fills in what is left out, and refuses what does not fit."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from fesd_robot.errors import DimensionError, ModelError
from fesd_robot.fesd import FesdOptions, OptimalControlProblem, Transcription, initial_value_problem

from .systems import driven, scalar


def test_what_is_left_out_is_unbounded_and_guessed() -> None:
    """Bounds are infinite, nothing costs, guesses are zero, of the right shapes."""
    problem = OptimalControlProblem(driven(), 2.0, 3, parameters=np.zeros((1, 3)))
    for what, n in (("initial", 2), ("state", 2), ("terminal", 2), ("control", 1)):
        assert getattr(problem, f"{what}_lower").tolist() == [-np.inf] * n
        assert getattr(problem, f"{what}_upper").tolist() == [np.inf] * n
    assert problem.control_guess.tolist() == [[0.0, 0.0, 0.0]]
    assert problem.state_guess(1.0).tolist() == [0.0, 0.0]
    assert not problem.running_cost and not problem.terminal_cost and not problem.constraints
    assert OptimalControlProblem(scalar("crossing"), 1.0).parameters.shape == (0, 1)


def test_guesses_lie_within_the_bounds() -> None:
    """The state guess is the middle of finite bounds of x(0), else nearest to zero; the control is nearest to zero."""
    problem = OptimalControlProblem(
        driven(), 2.0, 2, parameters=np.zeros((1, 2)), initial_lower=np.array([1.0, 2.0]),
        initial_upper=np.array([4.0, np.inf]), control_lower=np.array([0.5]), control_upper=np.array([3.0]),
    )  # fmt: skip
    assert problem.state_guess(0.0).tolist() == problem.state_guess(2.0).tolist() == [2.5, 2.0]
    assert problem.control_guess.tolist() == [[0.5, 0.5]]


def test_lists_become_arrays() -> None:
    """Numbers of any kind are arrays afterwards, also in a copy with another part."""
    problem = OptimalControlProblem(scalar("crossing"), 2.0, initial_lower=[-1], initial_upper=[0])  # type: ignore[arg-type]
    assert problem.initial_lower.dtype == float and problem.initial_lower.tolist() == [-1.0]
    assert replace(problem, state_upper=[3]).state_upper.tolist() == [3.0]  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"parameters": None}, "parameters has shape (0, 3), expected (1, 3)"),
        ({"parameters": np.zeros((1, 2))}, "parameters has shape (1, 2), expected (1, 3)"),
        ({"initial_lower": np.zeros(3)}, "initial_lower has shape (3,), expected (2,)"),
        ({"state_upper": np.zeros((2, 1))}, "state_upper has shape (2, 1), expected (2,)"),
        ({"terminal_lower": 0.0}, "terminal_lower has shape (), expected (2,)"),
        ({"control_upper": np.zeros(0)}, "control_upper has shape (0,), expected (1,)"),
        ({"control_guess": np.zeros((3, 1))}, "control_guess has shape (3, 1), expected (1, 3)"),
        ({"state_guess": lambda time: np.zeros(1)}, "state_guess(0) has shape (1,), expected (2,)"),
        ({"interval_end": ca.SX(1, 2)}, "interval_end has shape (1, 2), expected (2, 1)"),
        ({"interval_end_names": ("meet",)}, "interval_end_names has shape (1,), expected (0,)"),
        ({"running_cost": {"work": ca.SX(2, 1)}}, "running_cost['work'] has shape (2, 1), expected (1, 1)"),
        ({"terminal_cost": {"goal": ca.SX(2, 1)}}, "terminal_cost['goal'] has shape (2, 1), expected (1, 1)"),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_what_does_not_fit_is_refused(parts: dict[str, Any], message: str) -> None:
    """The part is named with its shape and the expected one."""
    with pytest.raises(DimensionError) as caught:
        OptimalControlProblem(driven(), 1.0, 3, **{"parameters": np.zeros((1, 3)), **parts})
    assert str(caught.value) == f"optimal control problem: {message}"


@pytest.mark.parametrize("horizon", [(0.0, 1), (-1.0, 1), (np.inf, 1), (1.0, 0)])
def test_an_empty_horizon_is_refused(horizon: tuple[float, int]) -> None:
    """There is at least one interval, and a finite duration that is positive."""
    with pytest.raises(ModelError, match=r"empty horizon: .* need at least one interval and a positive duration"):
        OptimalControlProblem(scalar("crossing"), *horizon)


def test_an_initial_value_problem_has_nothing_to_choose() -> None:
    """Start and control are fixed at what is given, which is also the guess; the states are free."""
    problem = initial_value_problem(driven(), [1.0, -2.0], 0.5, intervals=2, control=[3.0], parameters=[0.1])
    assert problem.initial_lower.tolist() == problem.initial_upper.tolist() == [1.0, -2.0]
    assert problem.control_lower.tolist() == problem.control_upper.tolist() == [3.0]
    assert problem.control_guess.tolist() == [[3.0, 3.0]] and problem.parameters.tolist() == [[0.1, 0.1]]
    assert problem.state_guess(0.25).tolist() == [1.0, -2.0]
    assert np.isinf(problem.state_lower).all() and np.isinf(problem.terminal_upper).all()
    start = Transcription(problem, FesdOptions(elements=2)).problem.start
    assert start[:2].tolist() == [1.0, -2.0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"initial": [1.0]}, "initial has shape (1,), expected (2,)"),
        ({"control": ()}, "control has shape (0,), expected (1,)"),
        ({"parameters": [1.0, 2.0]}, "parameters has shape (2,), expected (1,)"),
    ],
)
def test_wrong_starts_are_refused(arguments: dict[str, Any], message: str) -> None:
    """State, control and parameters of the wrong length are named."""
    fitting: dict[str, Any] = {"initial": [1.0, 2.0], "duration": 1.0, "control": [0.0], "parameters": [0.0]}
    with pytest.raises(DimensionError) as caught:
        initial_value_problem(driven(), **{**fitting, **arguments})
    assert str(caught.value) == f"optimal control problem: {message}"
