"""An optimal control problem of a complementarity system on equal control intervals, before discretisation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple
from weakref import WeakValueDictionary

import casadi as ca
import numpy as np

from fesd_robot.arguments import checked
from fesd_robot.dcs import OMITTED, ComplementaritySystem
from fesd_robot.dcs.checks import as_expression
from fesd_robot.errors import DimensionError, ModelError
from fesd_robot.fesd.constraints import TrajectoryConstraint
from fesd_robot.fesd.grid import Span
from fesd_robot.running import Identity


class RelaxedCost(NamedTuple):
    """Replacement of a running cost while the velocity level is relaxed by sigma.

    Both are functions sigma -> integrand, SX in (x, u, z, p, sigma), that tend to the cost with sigma where
    complementarity holds.

    Attributes:
        always: in every homotopy.
        if_exploited: where the first relaxed NLP ends with a negative cost all the same; never negative.
    """

    always: Callable[[ca.SX], ca.SX]
    if_exploited: Callable[[ca.SX], ca.SX]


class Clock(NamedTuple):
    """Data of a control grid that moves.

    Attributes:
        state: index of the state that is the physical time.
        parameters: time in the middle of an interval, s of the nominal duration -> the parameters there, (n_p).
    """

    state: int
    parameters: Callable[[float], np.ndarray]


@dataclass(frozen=True, eq=False)
class OcpEquations:
    """Equations of problems that differ in their numbers only; it is equal to itself alone.

    The attributes are those of the problem; `moving` says whether its grid does.
    """

    system: ComplementaritySystem
    duration: float
    intervals: int
    state_lower: np.ndarray
    state_upper: np.ndarray
    running_cost: Mapping[str, ca.SX]
    relaxed_costs: Mapping[str, RelaxedCost]
    terminal_cost: Mapping[str, ca.SX]
    interval_end: ca.SX
    interval_end_names: tuple[str, ...]
    moving: bool


_KNOWN: WeakValueDictionary[object, OcpEquations] = WeakValueDictionary()
"""Equations that some problem has."""


@checked
@dataclass(frozen=True, eq=False)
class OptimalControlProblem:
    """min integral of the running cost + terminal cost over trajectories of a complementarity system.

    What is left out is unbounded, costs nothing, or is guessed; the attributes are complete: arrays of these shapes.

    Another start or end, other parameters or another guess are the same equations with other numbers: `replace` keeps
    the equations, and no function of them is made again.

    Args:
        system: the dynamics.
        duration: numerical time horizon, sum of all steps.
        intervals: number N of control intervals; controls are constant on each.
        parameters: values of the system's parameters on each interval, (n_p, N); only a system without any may do
            without, or one whose grid moves: its clock has them.
        initial_lower, initial_upper: bounds of x(0), (n_x).
        state_lower, state_upper: bounds of x at every stage, (n_x).
        last_state_upper: tighter upper bounds of x at every stage of the last interval, (n_x).
        terminal_lower, terminal_upper: bounds of x at the end, (n_x).
        control_lower, control_upper: bounds of u, (n_u).
        state_guess: time -> x, start of the solver, (n_x); if omitted the middle of the bounds of x(0), or what is
            nearest to zero where one of them is infinite, at all times.
        control_guess: start of the controls, (n_u, N); if omitted what is nearest to zero.
        running_cost: name -> integrand in (x, u, z, p).
        relaxed_costs: name of a running cost that only complementarity keeps from falling without limit -> what stands
            in its place while a homotopy relaxes the velocity level.
        terminal_cost: name -> SX in x and p, the parameters of the last interval.
        interval_end: SX in (x, p) that is zero at the end of every interval.
        interval_end_names: one name per row of `interval_end`; numbers if omitted.
        clock: of a problem whose control grid moves (`ControlGrid`): the lengths of its intervals are variables, their
            number is that of the grid, and the last control is the pace of the clock, the same in all of them; None
            where the grid is uniform.
        constraints: path, boundary and coupling constraints, and costs that are not the same on every interval.

    Raises:
        DimensionError: an array, guess, cost or list of names of the wrong shape.
        ModelError: no interval, or a duration that is not positive.
    """

    system: ComplementaritySystem
    duration: float
    intervals: int = 1
    parameters: np.ndarray = OMITTED
    initial_lower: np.ndarray = OMITTED
    initial_upper: np.ndarray = OMITTED
    state_lower: np.ndarray = OMITTED
    state_upper: np.ndarray = OMITTED
    last_state_upper: np.ndarray = OMITTED
    terminal_lower: np.ndarray = OMITTED
    terminal_upper: np.ndarray = OMITTED
    control_lower: np.ndarray = OMITTED
    control_upper: np.ndarray = OMITTED
    state_guess: Callable[[float], np.ndarray] = OMITTED
    control_guess: np.ndarray = OMITTED
    running_cost: Mapping[str, ca.SX] = field(default_factory=dict)
    relaxed_costs: Mapping[str, RelaxedCost] = field(default_factory=dict)
    terminal_cost: Mapping[str, ca.SX] = field(default_factory=dict)
    interval_end: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    interval_end_names: tuple[str, ...] = ()
    clock: Clock | None = None
    constraints: Sequence[TrajectoryConstraint] = ()

    def __post_init__(self) -> None:
        if self.intervals < 1 or not 0 < self.duration < np.inf:
            raise ModelError(
                f"empty horizon: {self.intervals} intervals over a duration of {self.duration:g}, need at least one "
                "interval and a positive duration"
            )
        n_x, n_u, n_p = (part.numel() for part in (self.system.state, self.system.control, self.system.parameters))
        own = (n_p if self.clock is None else 0, self.intervals)
        self._set("parameters", np.zeros((0, self.intervals)), own)
        for what, n in (("initial", n_x), ("state", n_x), ("terminal", n_x), ("control", n_u)):
            for side, infinite in (("lower", -np.inf), ("upper", np.inf)):
                self._set(f"{what}_{side}", np.full(n, infinite), (n,))
        self._set("last_state_upper", np.full(n_x, np.inf), (n_x,))
        near_zero = np.clip(np.zeros(n_u), self.control_lower, self.control_upper)
        self._set("control_guess", np.tile(near_zero[:, None], self.intervals), (n_u, self.intervals))
        if self.state_guess is None:
            start = _middle(self.initial_lower, self.initial_upper)
            object.__setattr__(self, "state_guess", lambda time: start)
        _check("state_guess(0)", np.shape(self.state_guess(0.0)), (n_x,))
        object.__setattr__(self, "interval_end", as_expression("interval_end", self.interval_end))
        n_end = self.interval_end.numel()
        _check("interval_end", self.interval_end.shape, (n_end, 1))
        _check("interval_end_names", (len(self.interval_end_names),), (n_end if self.interval_end_names else 0,))
        if unknown := sorted(set(self.relaxed_costs) - set(self.running_cost)):
            raise ModelError(f"relaxed_costs: there is no running cost '{unknown[0]}'")
        for kind, terms in (("running_cost", self.running_cost), ("terminal_cost", self.terminal_cost)):
            for name, term in terms.items():
                _check(f"{kind}['{name}']", as_expression(f"{kind}['{name}']", term).shape, (1, 1))

    @cached_property
    def equations(self) -> OcpEquations:
        """What it has in common with problems of other numbers."""
        parts = (self.system, self.running_cost, self.relaxed_costs, self.terminal_cost, self.interval_end)
        bounds = (self.state_lower.tobytes(), self.state_upper.tobytes())
        names, moving = self.interval_end_names, self.clock is not None
        key = (Identity(*parts), self.duration, self.intervals, bounds, names, moving)
        if (known := _KNOWN.get(key)) is not None:
            return known
        own = OcpEquations(
            self.system,
            self.duration,
            self.intervals,
            self.state_lower,
            self.state_upper,
            self.running_cost,
            self.relaxed_costs,
            self.terminal_cost,
            self.interval_end,
            names,
            moving,
        )
        return _KNOWN.setdefault(key, own)

    @property
    def knots(self) -> tuple[float, ...]:
        """Times inside the horizon at which a moving grid has nodes: the ends of spans of constraints, s."""
        spans = [one.intervals for one in self.constraints if isinstance(one.intervals, Span)]
        inside = {time for span in spans for time in (span.begin, span.end) if 0 < time < self.duration}
        return tuple(sorted(inside))

    def _set(self, name: str, default: np.ndarray, shape: tuple[int, ...]) -> None:
        """Fill in an array that was omitted, and check its shape."""
        given = getattr(self, name)
        value = default if given is None else np.asarray(given, dtype=float)
        _check(name, value.shape, shape)
        object.__setattr__(self, name, value)


@checked
def initial_value_problem(
    system: ComplementaritySystem,
    initial: np.ndarray | Sequence[float],
    duration: float,
    *,
    intervals: int = 1,
    control: np.ndarray | Sequence[float] = (),
    parameters: np.ndarray | Sequence[float] = (),
) -> OptimalControlProblem:
    """Return the problem of following a system from a fixed state, in which there is nothing to choose.

    Args:
        system: the dynamics.
        initial: x(0), (n_x); also the guess of x at all times.
        duration: numerical time horizon.
        intervals: number N of control intervals.
        control: u of all intervals, (n_u).
        parameters: p of all intervals, (n_p).

    Raises:
        DimensionError: an argument of the wrong shape.
        ModelError: no interval, or a duration that is not positive.
    """
    x, u, p = (np.asarray(value, dtype=float) for value in (initial, control, parameters))
    for name, value, symbols in (
        ("initial", x, system.state),
        ("control", u, system.control),
        ("parameters", p, system.parameters),
    ):
        _check(name, value.shape, (symbols.numel(),))
    return OptimalControlProblem(
        system=system,
        duration=duration,
        intervals=intervals,
        parameters=np.tile(p[:, None], max(intervals, 1)),
        initial_lower=x,
        initial_upper=x,
        control_lower=u,
        control_upper=u,
    )


def _check(name: str, shape: tuple[int, ...], expected: tuple[int, ...]) -> None:
    if tuple(shape) != expected:
        raise DimensionError(f"optimal control problem: {name} has shape {tuple(shape)}, expected {expected}")


def _middle(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return the middle of bounds, or the value nearest to zero where one of them is infinite."""
    bounded = np.isfinite(lower) & np.isfinite(upper)
    middle = np.clip(np.zeros(len(lower)), lower, upper)
    middle[bounded] = (lower[bounded] + upper[bounded]) / 2
    return middle
