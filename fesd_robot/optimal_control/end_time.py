"""A free end time: the system in stretched time, with the end time as a further state that does not change."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.errors import ModelError
from fesd_robot.fesd import OptimalControlProblem, RelaxedCost, TrajectoryConstraint

END_TIME = "end time"
"""Name of the state."""


@checked
@dataclass(frozen=True)
class EndTime:
    """That the end time of a problem is free; its `duration` is the guess.

    Args:
        shortest, longest: bounds of the end time.
        cost: what a unit of time costs; 1 for the shortest time, 0 where other costs decide.

    Raises:
        ModelError: bounds that are not positive or not in order.
    """

    shortest: float
    longest: float
    cost: float = 1.0

    def __post_init__(self) -> None:
        if not 0 < self.shortest < self.longest < np.inf:
            raise ModelError(
                f"end time: need 0 < shortest < longest, both finite, found {self.shortest:g} and {self.longest:g}"
            )


def with_end_time(problem: OptimalControlProblem, end: EndTime) -> OptimalControlProblem:
    """Return the problem in which the end time T is free: x' = (T / duration) f over the same numerical horizon.

    The end time is the last state; running costs are stretched with the dynamics.

    Args:
        problem: with a fixed duration, which is the guess of T.
        end: bounds and cost of T.

    Raises:
        ModelError: a guess outside the bounds.
    """
    if not end.shortest <= problem.duration <= end.longest:
        raise ModelError(
            f"end time: the problem's duration {problem.duration:g} is its guess, and must lie between "
            f"{end.shortest:g} and {end.longest:g}"
        )
    time = ca.SX.sym(END_TIME)
    stretch = time / problem.duration

    def extended(values: np.ndarray, last: float) -> np.ndarray:
        return np.append(values, last)

    def stretched(cost: Callable[[ca.SX], ca.SX]) -> Callable[[ca.SX], ca.SX]:
        return lambda sigma: stretch * cost(sigma)

    guess = problem.state_guess
    costs = {name: stretch * cost for name, cost in problem.running_cost.items()}
    relaxed = {
        name: RelaxedCost(stretched(cost.always), stretched(cost.if_exploited))
        for name, cost in problem.relaxed_costs.items()
    }
    bounds: dict[str, Any] = {
        f"{what}_{side}": extended(getattr(problem, f"{what}_{side}"), limit)
        for what in ("initial", "state", "terminal")
        for side, limit in (("lower", end.shortest), ("upper", end.longest))
    }
    return replace(
        problem,
        system=_stretched_system(problem.system, time, stretch),
        **bounds,
        last_state_upper=extended(problem.last_state_upper, np.inf),
        state_guess=lambda at: extended(guess(at), problem.duration),
        running_cost=costs,
        relaxed_costs=relaxed,
        terminal_cost={**problem.terminal_cost, **({END_TIME: end.cost * time} if end.cost else {})},
        constraints=[_with_time(constraint, problem.system) for constraint in problem.constraints],
    )


def _stretched_system(system: ComplementaritySystem, time: ca.SX, stretch: ca.SX) -> ComplementaritySystem:
    guess = system.guess
    return replace(
        system,
        state=ca.vertcat(system.state, time),
        mass_matrix=ca.diagcat(system.mass_matrix, 1),
        right_hand_side=ca.vertcat(stretch * system.right_hand_side, 0),
        state_names=[*system.state_names, END_TIME],
        quadratures={name: stretch * integrand for name, integrand in system.quadratures.items()},
        guess=lambda x, u, p: guess(x[:-1], u, p),
    )


def _with_time(constraint: TrajectoryConstraint, system: ComplementaritySystem) -> TrajectoryConstraint:
    """Return a constraint whose points have one state more, which it does not mention."""
    n_x, n_u = system.state.numel(), system.control.numel()
    sizes = {
        "path": [n_x],
        "interval_end": [n_x],
        "interval": [n_x, n_x],
        "coupling": [n_x, n_u + n_x],
        "boundary": [n_x, n_x],
    }[constraint.kind]
    parts, at = [], 0
    for number, size in enumerate(sizes):
        parts += [constraint.variables[at : at + size], ca.SX.sym(f"{END_TIME} {number}")]
        at += size
    return replace(constraint, variables=ca.vertcat(*parts, constraint.variables[at:]))
