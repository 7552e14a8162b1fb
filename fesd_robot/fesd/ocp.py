"""An optimal control problem of a complementarity system on equal control intervals, before discretisation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import casadi as ca
import numpy as np

from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.errors import DimensionError

Place = Literal["stages", "ends", "intervals", "neighbours", "period"]
"""Which points of a trajectory a condition is about, see `Condition`."""


@dataclass(frozen=True)
class Condition:
    """lower <= rows(y, p) <= upper and a cost, once for every place of a kind.

    The places, and what y is there:

    - ``stages``: every stage, and the right end of every element that has a state of its own: y = (x, u, z);
    - ``ends``: the end of every interval: y = x;
    - ``intervals``: every interval: y = (x at its start, x at its end);
    - ``neighbours``: every interval but the last of all: y = (x at its end, u, x at the next one's end, next u);
    - ``period``: the whole motion: y = (x at the start, x at the end).

    Args:
        name: what it is, for messages.
        place: the kind of places.
        variables: y, SX symbols.
        intervals: numbers of the intervals it holds in; without meaning for ``period``.
        rows, lower, upper, row_names: SX (m) in y and p, its bounds and names, (m).
        cost: name -> SX in y and p, added once a place.
        parameters: p, SX symbols (n_p).
        values: p for each of `intervals`, (n_p, len(intervals)).

    Raises:
        DimensionError: rows, bounds and names, or parameters and values, of different lengths.
    """

    name: str
    place: Place
    variables: ca.SX
    intervals: Sequence[int] = (0,)
    rows: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    lower: np.ndarray = field(default_factory=lambda: np.zeros(0))
    upper: np.ndarray = field(default_factory=lambda: np.zeros(0))
    row_names: Sequence[str] = ()
    cost: Mapping[str, ca.SX] = field(default_factory=dict)
    parameters: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    values: np.ndarray | None = None

    def __post_init__(self) -> None:
        n = self.rows.numel()
        for what, found, expected in (
            ("lower", self.lower.shape, (n,)),
            ("upper", self.upper.shape, (n,)),
            ("row_names", (len(self.row_names),), (n,)),
            ("values", self.parameter_values.shape, (self.parameters.numel(), len(self.intervals))),
        ):
            if found != expected:
                raise DimensionError(f"condition '{self.name}': {what} has shape {found}, expected {expected}")

    @property
    def parameter_values(self) -> np.ndarray:
        """p for each of the intervals, (n_p, len(intervals))."""
        return np.zeros((0, len(self.intervals))) if self.values is None else self.values


@dataclass(frozen=True)
class OptimalControlProblem:
    """min integral of the running cost + terminal cost over trajectories of a complementarity system.

    Args:
        system: the dynamics.
        duration: numerical time horizon, sum of all steps.
        intervals: number N of control intervals; controls are constant on each.
        running_cost: name -> integrand in (x, u, z, p).
        terminal_cost: name -> SX in x.
        parameters: values of the system's parameters on each interval, (n_p, N).
        initial_lower, initial_upper: bounds of x(0), (n_x).
        state_lower, state_upper: bounds of x at every stage, (n_x).
        terminal_lower, terminal_upper: bounds of x at the end, (n_x).
        control_lower, control_upper: bounds of u, (n_u).
        interval_end: SX in (x, p) that is zero at the end of every interval.
        interval_end_names: one name per row of `interval_end`.
        state_guess: time -> x, start of the solver, (n_x).
        control_guess: start of the controls, (n_u, N).
        conditions: rows and costs that are not the same on every interval, or are about several points.
    """

    system: ComplementaritySystem
    duration: float
    intervals: int
    parameters: np.ndarray
    initial_lower: np.ndarray
    initial_upper: np.ndarray
    state_lower: np.ndarray
    state_upper: np.ndarray
    terminal_lower: np.ndarray
    terminal_upper: np.ndarray
    control_lower: np.ndarray
    control_upper: np.ndarray
    state_guess: Callable[[float], np.ndarray]
    control_guess: np.ndarray
    running_cost: Mapping[str, ca.SX] = field(default_factory=dict)
    terminal_cost: Mapping[str, ca.SX] = field(default_factory=dict)
    interval_end: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    interval_end_names: tuple[str, ...] = ()
    conditions: Sequence[Condition] = ()
