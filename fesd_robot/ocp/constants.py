"""Numbers of a task that its equations know as parameters: the goal, and weights of costs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.ocp.vectors import Endpoints
from fesd_robot.task import AXES, COST_TERMS, Goal, KeyPath, PointTarget, Task, Waypoint

GOAL_CONFIGURATION, GOAL_VELOCITY = "goal configuration", "goal velocity"
"""First words of the keys of the whole goal, whose entries have numbers."""


@dataclass(frozen=True, eq=False)
class Constants:
    """Symbols for the numbers of a task, so that another goal or weight is the same equations with other parameters.

    Attributes:
        numbers: key of each number -> its number among the symbols.
        symbols: SX (n).
    """

    numbers: Mapping[KeyPath, int]
    symbols: ca.SX

    @classmethod
    def of(cls, values: Mapping[KeyPath, float]) -> Constants:
        """Return a symbol for every number of a task."""
        return cls({key: i for i, key in enumerate(values)}, ca.SX.sym("constant", len(values)))

    def __getitem__(self, key: KeyPath) -> ca.SX:
        """Return the symbol of a number."""
        return self.symbols[self.numbers[key]]

    def weights(self, key: KeyPath, names: Iterable[str]) -> ca.SX:
        """Return the weights of names under a key of `costs`, SX (n); those of other names are zero."""
        keys = [("costs", *key, name) for name in names]
        return ca.vertcat(ca.SX(0, 1), *[self[one] if one in self.numbers else ca.SX(1, 1) for one in keys])

    def goal(self, what: str, count: int) -> ca.SX:
        """Return the whole goal configuration or velocity, SX (n)."""
        return ca.vertcat(*[self[what, str(i)] for i in range(count)])

    def used_in(self, *expressions: ca.SX) -> ca.SX:
        """Return the symbols that expressions depend on, SX (m), in their order."""
        found = {self._number(symbol) for one in expressions for symbol in ca.symvar(one)}
        return self.symbols[sorted(number for number in found if number is not None)]

    def read(self, symbols: ca.SX, values: np.ndarray) -> np.ndarray | None:
        """Return the values of some of the symbols, (m), from those of all, (n); None if one is no constant."""
        numbers = [self._number(symbols[i]) for i in range(symbols.numel())]
        return None if None in numbers else values[np.array(numbers, dtype=int)]

    def _number(self, symbol: ca.SX) -> int | None:
        return self._places.get(symbol.element_hash())

    @cached_property
    def _places(self) -> dict[int, int]:
        return {self.symbols[i].element_hash(): i for i in range(self.symbols.numel())}


def constant_values(task: Task, endpoints: Endpoints) -> dict[KeyPath, float]:
    """Return the numbers of a completed task that its equations know as parameters, by key.

    Args:
        task: with the whole configuration of its goal, and all weights.
        endpoints: whole configurations and velocities of start and goal.
    """
    values: dict[KeyPath, float] = {}
    for what, entries in (
        (GOAL_CONFIGURATION, endpoints.goal_configuration),
        (GOAL_VELOCITY, endpoints.goal_velocity),
    ):
        values |= {(what, str(i)): float(value) for i, value in enumerate(entries)}
    values |= _of_points(("goal",), task.goal)
    for i, waypoint in enumerate(task.waypoints):
        where = ("waypoints", str(i))
        values |= {(*where, "configuration", name): value for name, value in waypoint.configuration.items()}
        values |= {(*where, "velocity", name): value for name, value in waypoint.velocity.items()}
        values |= _of_points(where, waypoint)
    for key in COST_TERMS:
        values |= _of_weights(("costs", key), getattr(task.costs, key))
    return values


def _of_points(key: KeyPath, target: Goal | Waypoint) -> dict[KeyPath, float]:
    """Return the wanted positions and velocities of frames and of the centre of mass, by axis."""
    points: dict[KeyPath, PointTarget] = {("frames", name): point for name, point in target.frames.items()}
    if target.center_of_mass is not None:
        points[("center_of_mass",)] = target.center_of_mass
    return {
        (*key, *name, what, axis): float(value)
        for name, point in points.items()
        for what, wanted in (("position", point.position), ("velocity", point.velocity))
        for axis, value in zip(AXES, wanted or (None,) * len(AXES), strict=True)
        if value is not None
    }


def _of_weights(key: KeyPath, weights: object) -> dict[KeyPath, float]:
    """Return the weights that are not zero; which these are is a matter of the equations."""
    if isinstance(weights, Mapping):
        return {one: value for name, own in weights.items() for one, value in _of_weights((*key, name), own).items()}
    return {key: float(weights)} if isinstance(weights, int | float) and weights else {}
