"""The optimal control problem of a task, put together from its parts."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypedDict

import casadi as ca
import numpy as np

from fesd_robot.fesd import Clock, OptimalControlProblem, TrajectoryConstraint
from fesd_robot.ocp.angle_limits import angle_limits
from fesd_robot.ocp.constraints import path_constraints
from fesd_robot.ocp.costs import relaxed_costs, running_costs, terminal_costs, trajectory_costs
from fesd_robot.ocp.determinacy import determinacy_constraints
from fesd_robot.ocp.parts import ProblemParts
from fesd_robot.ocp.targets import target_constraints
from fesd_robot.ocp.vectors import mirrored, vector

START_DRIFT = 1e-6
"""m; how far apart the true and the integrated gap of a contact may be at the start of a motion that repeats."""


PERIOD = "period"
"""Name of the constraint that lets the end be the start, one stride further."""


class OcpNumbers(TypedDict):
    """The numbers of an optimal control problem, see there."""

    parameters: np.ndarray
    initial_lower: np.ndarray
    initial_upper: np.ndarray
    state_lower: np.ndarray
    state_upper: np.ndarray
    last_state_upper: np.ndarray
    terminal_lower: np.ndarray
    terminal_upper: np.ndarray
    control_lower: np.ndarray
    control_upper: np.ndarray
    state_guess: Callable[[float], np.ndarray]
    control_guess: np.ndarray
    clock: Clock | None


def optimal_control_problem(parts: ProblemParts) -> OptimalControlProblem:
    """Return the optimal control problem.

    Every interval ends when the clock says kT/N; where it never stops its speed is 1 instead. Of a free duration T
    only the bounds are known: the clock at the end lies between them, and the intervals are equal,
    ``t_k = k / (k + 1) t_{k+1}``.

    On a moving grid the clock holds the lengths of the intervals (`fesd.grid_rows`). Numerical time goes as fast as
    physical time then; of a free duration T the speed is T over the nominal one, the same everywhere.
    """
    grid, contact_system = parts.grid, parts.contact_system
    on_grid = grid.free or not contact_system.clock_stops or grid.moving
    n_q = parts.dynamics.configuration.numel()
    return OptimalControlProblem(
        system=contact_system.system,
        duration=grid.nominal,
        intervals=grid.intervals,
        running_cost=running_costs(parts),
        relaxed_costs=relaxed_costs(parts),
        terminal_cost=terminal_costs(parts),
        interval_end=ca.SX(0, 1) if on_grid else parts.clock - parts.compared[n_q],
        interval_end_names=() if on_grid else ("clock",),
        constraints=_constraints(parts),
        **ocp_numbers(parts),
    )


def ocp_numbers(parts: ProblemParts) -> OcpNumbers:
    """Return the numbers of the optimal control problem: bounds, parameters and the guess."""
    grid, limits, actuation = parts.grid, parts.limits, parts.actuation
    contact_system, reference, spline, values = (
        parts.contact_system,
        parts.reference,
        parts.reference_spline,
        parts.values,
    )

    def guess(time: float) -> np.ndarray:
        velocity = np.clip(parts.guess.velocity(time), limits.lower_velocity, limits.upper_velocity)
        return parts.state(parts.guess.configuration(time), velocity, time)

    def parameters_at(time: float) -> np.ndarray:
        return np.concatenate([spline.parameters(time), values])

    initial_lower, initial_upper = _initial_box(parts)
    goal_lower, goal_upper = _goal_box(parts)
    last_clock = (grid.lower, grid.upper) if grid.free else (-np.inf, np.inf)
    speed = parts.task.limits.speed_of_time
    free_gaps, slip_limits = np.full(parts.gap_states, np.inf), parts.slip_limits
    free_slip = np.full_like(slip_limits, np.inf)
    pace = (speed.lower, speed.upper) if contact_system.clock_stops or grid.free else (1.0, 1.0)
    if grid.moving:
        pace = (grid.lower / grid.nominal, grid.upper / grid.nominal)
    idle = np.clip(0.0, actuation.planned_lower, actuation.planned_upper)
    compared = np.vstack([np.array([reference.configuration(end) for end in grid.ends]).T, grid.ends])
    parameters = np.vstack([compared, np.tile(values[:, None], grid.intervals)])
    return OcpNumbers(
        parameters=parameters[:0] if grid.moving else parameters,
        initial_lower=initial_lower,
        initial_upper=initial_upper,
        state_lower=parts.bounds(
            limits.lower_position, limits.lower_velocity, -np.inf, contact_system.gap_lower, -free_slip
        ),
        state_upper=parts.bounds(limits.upper_position, limits.upper_velocity, np.inf, np.inf, free_slip),
        last_state_upper=parts.bounds(
            limits.upper_position, limits.upper_velocity, np.inf, _last_gaps(parts), free_slip
        ),
        terminal_lower=np.concatenate([goal_lower, [last_clock[0]], -free_gaps, -free_slip]),
        terminal_upper=np.concatenate([goal_upper, [last_clock[1]], free_gaps, slip_limits]),
        control_lower=np.append(actuation.planned_lower, pace[0]),
        control_upper=np.append(actuation.planned_upper, pace[1]),
        state_guess=guess,
        control_guess=np.tile(np.append(idle, 1.0), (grid.intervals, 1)).T,
        clock=Clock(parts.clock_index, parameters_at) if grid.moving else None,
    )


def _constraints(parts: ProblemParts) -> list[TrajectoryConstraint]:
    grid = parts.grid
    return [
        *target_constraints(parts),
        *trajectory_costs(parts),
        *path_constraints(parts),
        *angle_limits(parts),
        *determinacy_constraints(parts),
        *([_equal_intervals(parts)] if grid.free and grid.intervals > 1 and not grid.moving else []),
        *([_period(parts)] if parts.task.goal.periodic is not None else []),
    ]


def _equal_intervals(parts: ProblemParts) -> TrajectoryConstraint:
    """Return the rows t_k = k / (k + 1) t_{k+1}: all intervals of a free duration are equal."""
    system, grid = parts.contact_system.system, parts.grid
    following, u = ca.SX.sym("next_x", system.state.numel()), ca.SX.sym("next_u", system.control.numel())
    fraction, k = ca.SX.sym("fraction"), np.arange(1.0, grid.intervals + 1)
    return TrajectoryConstraint(
        "equal intervals",
        "coupling",
        ca.vertcat(system.state, system.control, following, u),
        range(grid.intervals),
        parts.clock - fraction * following[parts.clock_index],
        np.zeros(1),
        np.zeros(1),
        ["clock"],
        parameters=fraction,
        values=(k / (k + 1)).reshape(1, -1),
    )


def _period(parts: ProblemParts) -> TrajectoryConstraint:
    """Let the end be the start, perhaps mirrored, plus one stride; a free start's integrated gaps are true ones.

    Which contacts touch at the end is not said: their gaps are functions of the configuration. A contact that stands at
    the start and, as itself or its mirror image, at the end has true gaps there that are equal, and one integrated gap
    that is zero; between them is the drift of the integration, which nothing else can undo. So the gaps at the start
    agree to `START_DRIFT` only: exactly they would be one equation more than there are unknowns.
    """
    assert parts.task.goal.periodic is not None
    system, n, n_q = parts.contact_system.system, parts.clock_index, parts.dynamics.configuration.numel()
    start, end = system.state, ca.SX.sym("end", system.state.numel())
    stride = np.zeros(n)
    stride[:n_q] = vector(parts.dynamics.configuration_names, parts.task.goal.periodic.stride, 0.0)
    after_gaps = n + 1 + parts.gap_states
    gaps = start[n + 1 : after_gaps] - parts.gap(start[:n_q]) if parts.gap_states else ca.SX(0, 1)
    names = [f"period of {name}" for name in system.state_names[:n]]
    q_names, v_names = parts.dynamics.configuration_names, parts.dynamics.velocity_names
    image = ca.vertcat(mirrored(parts.task, q_names, start[:n_q]), mirrored(parts.task, v_names, start[n_q:n]))
    rows = ca.vertcat(end[:n] - image - ca.DM(stride), gaps)
    width = np.concatenate([np.zeros(n), np.full(rows.numel() - n, START_DRIFT)])
    return TrajectoryConstraint(
        PERIOD,
        "boundary",
        ca.vertcat(start, end),
        (0,),
        rows,
        -width,
        width,
        [*names, *(f"start of {name}" for name in system.state_names[n + 1 : after_gaps])],
    )


def _last_gaps(parts: ProblemParts) -> np.ndarray:
    """Return the largest integrated gaps in the last interval, (n_p): zero where the robot is at rest on a contact.

    Velocities alone would be zero at the apex of a hop, too.
    """
    closed = [contact.name in parts.task.goal.rests_on for contact in parts.contacts]
    return np.where(closed, 0.0, np.inf) if parts.gap_states else np.zeros(0)


def _initial_box(parts: ProblemParts) -> tuple[np.ndarray, np.ndarray]:
    """Return the bounds of the initial state: fixed, or free within its limits if the motion repeats."""
    endpoints, limits, periodic = parts.endpoints, parts.limits, parts.task.goal.periodic
    initial = parts.state(endpoints.initial_configuration, endpoints.initial_velocity, 0.0)
    if periodic is None:
        return initial, initial
    unslipped = np.zeros_like(parts.slip_limits)
    lower = parts.bounds(limits.lower_position, limits.lower_velocity, 0.0, parts.contact_system.gap_lower, unslipped)
    upper = parts.bounds(limits.upper_position, limits.upper_velocity, 0.0, np.inf, unslipped)
    for i, name in enumerate(parts.dynamics.configuration_names):
        if name in periodic.stride:
            lower[i] = upper[i] = initial[i]
    return lower, upper


def _goal_box(parts: ProblemParts) -> tuple[np.ndarray, np.ndarray]:
    tolerance, dynamics, endpoints = parts.task.goal.tolerance, parts.dynamics, parts.endpoints
    width = np.concatenate(
        [
            vector(dynamics.configuration_names, tolerance.configuration, np.inf),
            vector(dynamics.velocity_names, tolerance.velocity, np.inf),
        ]
    )
    goal = np.concatenate([endpoints.goal_configuration, endpoints.goal_velocity])
    return goal - width, goal + width
