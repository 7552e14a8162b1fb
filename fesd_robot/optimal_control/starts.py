"""Initial guesses of an optimal control problem."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fesd_robot.fesd import OptimalControlProblem

UNBOUNDED = 1.0
"""Half the range of random controls without bounds, around the guess."""


def start_of(problem: OptimalControlProblem, number: int, seed: int) -> OptimalControlProblem:
    """Return the problem with another guess.

    Number 0 is the problem's own guess; 1 a straight line from the middle of the bounds at the start to that of the
    bounds at the end, as far as these are finite; all others the same line with random controls within their bounds.

    Args:
        problem: the problem.
        number: of the start, from 0.
        seed: of the random controls.
    """
    if number == 0:
        return problem
    states = _line(problem)
    if number == 1:
        return replace(problem, state_guess=states)
    random = np.random.default_rng([seed, number])
    guess = problem.control_guess
    lower = np.where(np.isfinite(problem.control_lower), problem.control_lower, guess.T - UNBOUNDED).T
    upper = np.where(np.isfinite(problem.control_upper), problem.control_upper, guess.T + UNBOUNDED).T
    return replace(problem, state_guess=states, control_guess=random.uniform(lower, upper))


def _line(problem: OptimalControlProblem) -> Callable[[float], np.ndarray]:
    begin, own_end = problem.state_guess(0.0), problem.state_guess(problem.duration)
    begin = np.clip(begin, problem.initial_lower, problem.initial_upper)
    bounds = problem.terminal_lower, problem.terminal_upper
    bounded = np.isfinite(bounds[0]) & np.isfinite(bounds[1])
    end = np.clip(own_end, *bounds)
    end[bounded] = (bounds[0][bounded] + bounds[1][bounded]) / 2
    return lambda time: begin + (end - begin) * time / problem.duration
