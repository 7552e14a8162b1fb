"""The costs of a task as integrands, terminal terms and conditions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from fesd_robot.contact import ContactSystem, MultibodyDynamics
from fesd_robot.fesd import TrajectoryConstraint
from fesd_robot.ocp.points import AXES, Points
from fesd_robot.ocp.timing import TimeGrid
from fesd_robot.ocp.vectors import Endpoints, vector
from fesd_robot.task import Task


def running_costs(
    task: Task,
    dynamics: MultibodyDynamics,
    contact_system: ContactSystem,
    points: Points,
    strength: float,
    reference: ca.SX,
) -> dict[str, ca.SX]:
    """Return name -> integrand in numerical time.

    Squares are weighed by the clock's rate theta_ODE s, so that they count per second of physical time and frozen
    phases cost nothing. A contact's normal force F_n is a_n (theta_+ + theta_-) / rate while the clock runs and an
    impulse while it stands still; the integral of a_n (theta_+ + theta_-) over numerical time holds both, integral of
    F_n dt plus all impulses. (A square of the force would weigh an impulse infinitely.)

    Args:
        strength: a_n, N.
        reference: q of the reference motion, SX symbols (n_q).
    """
    costs, rate = task.costs, contact_system.clock_rate
    deviation = dynamics.configuration - reference
    found = {
        "configuration": rate * square(deviation, dynamics.configuration_names, costs.configuration, 1.0),
        "velocity": rate * square(dynamics.velocity, dynamics.velocity_names, costs.velocity, 0.1),
        "control": rate * square(dynamics.control, dynamics.control_names, costs.control, 1e-3),
    }
    for i, name in enumerate(task.contacts):
        if costs.force.get(name):
            plus, minus = contact_system.theta_auxiliary[i]
            force = costs.force[name] * strength * (plus + minus)
            found["force"] = found.get("force", ca.SX(0)) + force
    if any(costs.center_of_mass.values()):
        position, _ = points.center_of_mass(("costs", "center_of_mass"))
        found["center of mass"] = rate * _tracking(position, points.q, reference, costs.center_of_mass)
    for frame, weights in costs.frames.items():
        if any(weights.values()):
            position, _ = points.frame(frame)
            found[f"frame {frame}"] = rate * _tracking(position, points.q, reference, weights)
    return found


def terminal_costs(task: Task, dynamics: MultibodyDynamics, endpoints: Endpoints, clock: ca.SX) -> dict[str, ca.SX]:
    """Return name -> cost of the state at the end; a periodic motion has no goal to be weighed."""
    costs, found = task.costs, dict[str, ca.SX]()
    if task.goal.periodic is None:
        names, weights = dynamics.configuration_names, costs.terminal_configuration
        if weights is None and task.goal.has_points:
            weights = dict.fromkeys(task.goal.configuration, 100.0)
        to_goal = dynamics.configuration - endpoints.goal_configuration
        velocity_to_goal = dynamics.velocity - endpoints.goal_velocity
        found["terminal configuration"] = square(to_goal, names, weights, 100.0)
        found["terminal velocity"] = square(velocity_to_goal, dynamics.velocity_names, costs.terminal_velocity, 10.0)
    if costs.time:
        found["time"] = costs.time * clock
    return found


def smoothness_constraints(
    task: Task, dynamics: MultibodyDynamics, state: ca.SX, control: ca.SX, grid: TimeGrid
) -> list[TrajectoryConstraint]:
    """Return the costs of changes between control intervals and of the mean acceleration over them.

    sum_k w (u_{k+1} - u_k)^2, and sum_k w ((v_{k+1} - v_k) / h)^2 h with h = T/N, where v_k are the velocities at the
    ends of the intervals.

    Args:
        state, control: symbols x and (u, s).
    """
    costs, found = task.costs, []
    if any(costs.control_change.values()):
        x, u = ca.SX.sym("next_x", state.numel()), ca.SX.sym("next_u", control.numel())
        change = (u - control)[: len(dynamics.control_names)]
        cost = square(change, dynamics.control_names, costs.control_change, 0.0)
        variables = ca.vertcat(state, control, x, u)
        found.append(
            TrajectoryConstraint(
                "control change", "coupling", variables, range(grid.intervals), cost={"control change": cost}
            )
        )
    if any(costs.acceleration.values()):
        x = ca.SX.sym("next_x", state.numel())
        first, length = dynamics.configuration.numel(), grid.nominal / grid.intervals
        change = (x - state)[first : first + dynamics.velocity.numel()]
        cost = square(change, dynamics.velocity_names, costs.acceleration, 0.0) / length
        variables = ca.vertcat(state, x)
        found.append(
            TrajectoryConstraint(
                "acceleration", "interval", variables, range(grid.intervals), cost={"acceleration": cost}
            )
        )
    return found


def square(x: ca.SX, keys: Sequence[str], weights: Mapping[str, float] | None, default: float) -> ca.SX:
    """Return sum_i w_i x_i^2; without a map every weight is the default, with one those not listed are zero."""
    values = vector(keys, weights or {}, default if weights is None else 0.0)
    return ca.dot(ca.SX(ca.DM(values)), x**2)


def _tracking(position: ca.SX, q: ca.SX, reference: ca.SX, weights: Mapping[str, float]) -> ca.SX:
    """Return sum_i w_i (p_i(q) - p_i(q_ref))^2."""
    wanted = ca.substitute(position, q, reference)
    values = ca.DM(np.array([weights.get(axis, 0.0) for axis in AXES]))
    return ca.dot(ca.SX(values), (position - wanted) ** 2)
