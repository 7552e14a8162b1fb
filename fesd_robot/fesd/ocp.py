"""An optimal control problem of a complementarity system on equal control intervals, before discretisation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd.constraints import TrajectoryConstraint


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
        constraints: path, boundary and coupling constraints, and costs that are not the same on every interval.
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
    constraints: Sequence[TrajectoryConstraint] = ()
