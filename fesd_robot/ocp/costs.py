"""The terms of a task's cost as integrands, terms of the final state, and costs of several states.

Every key of `costs` has one function in one of the tables `INTEGRANDS`, `FINAL_TERMS` and `TRAJECTORY_COSTS`; what is
said about it elsewhere is in `fesd_robot.task.costs`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial

import casadi as ca

from fesd_robot.fesd import RelaxedCost, TrajectoryConstraint
from fesd_robot.ocp.constants import GOAL_CONFIGURATION, GOAL_VELOCITY
from fesd_robot.ocp.parts import ProblemParts
from fesd_robot.ocp.points import AXES
from fesd_robot.orientations import deviation_names
from fesd_robot.robot import deviation
from fesd_robot.task import KeyPath

Terms = dict[str, ca.SX]
"""Name of a term -> expression."""


SMOOTHED_SPEED = 0.1
"""m/s; slower slipping costs less than its work while pairs are relaxed by more than this, where it may not be
negative."""

FULL_WEIGHT_SIGMA = 0.03
"""Sigma of the velocity level above which the weight of friction's work falls as 1 / sigma."""


def running_costs(parts: ProblemParts) -> Terms:
    """Return name -> integrand in numerical time.

    Squares are multiplied by the clock's rate theta_ODE s, so that they count per second of physical time and frozen
    phases cost nothing.
    """
    return _united(term(parts) for term in INTEGRANDS.values())


def relaxed_costs(parts: ProblemParts) -> dict[str, RelaxedCost]:
    """Return name -> replacement of a running cost while the velocity level is relaxed."""
    if not parts.task.costs.used("slipping"):
        return {}
    return {"slipping": RelaxedCost(partial(_weighed_slipping, parts), partial(_opposed_slipping, parts))}


def terminal_costs(parts: ProblemParts) -> Terms:
    """Return name -> cost of the state at the end."""
    return _united(term(parts) for term in FINAL_TERMS.values())


def trajectory_costs(parts: ProblemParts) -> list[TrajectoryConstraint]:
    """Return the costs of the states or controls of several intervals, as constraints without rows."""
    return [term(parts) for key, term in TRAJECTORY_COSTS.items() if parts.task.costs.used(key)]


def _configuration(parts: ProblemParts) -> Terms:
    """Return the rate times sum_i w_i d_i^2, d the deviation from the reference: q_i - q_ref,i or log(R_ref^T R)."""
    names = parts.dynamics.configuration_names
    from_reference = deviation(names, parts.dynamics.configuration, parts.reference_configuration)
    square = _square(parts, "configuration", from_reference, deviation_names(names))
    return {"configuration": _rate(parts) * square}


def _velocity(parts: ProblemParts) -> Terms:
    """Return the rate times sum_i w_i v_i^2."""
    dynamics = parts.dynamics
    return {"velocity": _rate(parts) * _square(parts, "velocity", dynamics.velocity, dynamics.velocity_names)}


def _control(parts: ProblemParts) -> Terms:
    """Return the rate times sum_i w_i u_i^2."""
    dynamics = parts.dynamics
    return {"control": _rate(parts) * _square(parts, "control", dynamics.control, dynamics.control_names)}


def _control_sum(parts: ProblemParts) -> Terms:
    """Return the rate times the sum of w_g (sum_{c in A} u_c)^2 over the sets A of controls of groups g."""
    if not parts.task.costs.used("control_sum"):
        return {}
    names, u, total = list(parts.dynamics.control_names), parts.dynamics.control, ca.SX(0)
    for group, sets in parts.dynamics.one_at_a_time.items():
        if parts.task.costs.control_sum.get(group):
            squares = sum((ca.sum1(u[[names.index(one) for one in own]]) ** 2 for own in sets.values()), ca.SX(0))
            total += parts.constants["costs", "control_sum", group] * squares
    return {"control sum": _rate(parts) * total}


def _force(parts: ProblemParts) -> Terms:
    """Return the sum of w_c a_n (theta_+ + theta_-) over the contacts.

    A contact's normal force F_n is a_n (theta_+ + theta_-) / rate while the clock runs and an impulse while it stands
    still; the integral of a_n (theta_+ + theta_-) over numerical time holds both, integral of F_n dt plus all impulses.
    (A square of the force would count an impulse infinitely.) A compliant contact counts with the rate times its force.
    """
    weights = parts.task.costs.force
    if not parts.task.costs.used("force"):
        return {}
    total = ca.SX(0)
    for contact, own in zip(parts.contacts, parts.contact_system.theta_auxiliary, strict=True):
        if weights.get(contact.name):
            total = total + parts.constants["costs", "force", contact.name] * parts.auxiliary_force * own.normal
    for compliant, force in zip(parts.compliant, parts.contact_system.compliant_forces, strict=True):
        if weights.get(compliant.name):
            total = total + parts.constants["costs", "force", compliant.name] * _rate(parts) * force
    return {"force": total}


def _slipping(parts: ProblemParts) -> Terms:
    """Return the sum of w_c a_n mu (theta_+ - theta_-) J_t v over the contacts.

    Friction takes the power mu F_n |J_t v| while the clock runs; the integral over numerical time also holds what it
    takes during impacts. The sign of J_t v is that of theta_+ - theta_- wherever it is not zero. A contact that bounces
    counts with 1 - beta^2 times that, which is 0 in impacts: Coulomb's law holds there for the impulse as a whole, and
    the way to it is open.
    """
    return _friction_work(parts, lambda plus, minus, speed: (plus - minus) * speed)


def _weighed_slipping(parts: ProblemParts, sigma: ca.SX) -> ca.SX:
    """Return the weighted work of slipping times min(1, `FULL_WEIGHT_SIGMA` / sigma).

    While friction need not oppose slipping, the work that it takes may be negative: products of force and velocity may
    be as large as sigma. So they gain no more than they would at that sigma.
    """
    return _relaxed_weight(sigma) * _slipping(parts)["slipping"]


def _opposed_slipping(parts: ProblemParts, sigma: ca.SX) -> ca.SX:
    """Return a work that is never negative: psi(J_t v) and -psi(-J_t v) for J_t v beside theta_+ and theta_-.

        psi(s) = max(s, 0)^3 / (s^2 + epsilon^2),   epsilon = min(sigma, `SMOOTHED_SPEED`)

    Where friction opposes slipping, psi(s) tends to max(s, 0) and the sum to its work.
    """
    square = ca.fmin(sigma, SMOOTHED_SPEED) ** 2

    def psi(speed: ca.SX) -> ca.SX:
        return ca.fmax(speed, 0) ** 3 / (speed**2 + square)

    work = _friction_work(parts, lambda plus, minus, speed: plus * psi(speed) + minus * psi(-speed))
    return _relaxed_weight(sigma) * work["slipping"]


def _relaxed_weight(sigma: ca.SX) -> ca.SX:
    return FULL_WEIGHT_SIGMA / ca.fmax(sigma, FULL_WEIGHT_SIGMA)


def _friction_work(parts: ProblemParts, paid: Callable[[ca.SX, ca.SX, ca.SX], ca.SX]) -> Terms:
    """Return the sum of w_c a_n mu paid(theta_+, theta_-, J_t v) over contacts and directions, if it has a weight."""
    weights = parts.task.costs.slipping or {}
    if not parts.task.costs.used("slipping"):
        return {}
    total = ca.SX(0)
    for contact, own in zip(parts.contacts, parts.contact_system.theta_auxiliary, strict=True):
        if weights.get(contact.name):
            speeds = contact.tangential_velocities(parts.dynamics.velocity)
            works = [paid(plus, minus, speed) for (plus, minus), speed in zip(own.sides, speeds, strict=True)]
            power = contact.usable_friction * sum(works[1:], works[0])
            if contact.restitution > 0 and not contact.in_space:
                power *= 1 - own.normal**2
            total = total + parts.constants["costs", "slipping", contact.name] * parts.auxiliary_force * power
    return {"slipping": total}


def _center_of_mass(parts: ProblemParts) -> Terms:
    """Return the rate times sum_i w_i (c_i(q) - c_i(q_ref))^2."""
    if not parts.task.costs.used("center_of_mass"):
        return {}
    position, _ = parts.points.center_of_mass(("costs", "center_of_mass"))
    return {"center of mass": _rate(parts) * _tracking(parts, position, ("center_of_mass",))}


def _frames(parts: ProblemParts) -> Terms:
    """Return the rate times sum_i w_i (p_i(q) - p_i(q_ref))^2 of every frame."""
    terms = {}
    for frame, weights in parts.task.costs.frames.items():
        if any(weights.values()):
            position, _ = parts.points.frame(frame)
            terms[f"frame {frame}"] = _rate(parts) * _tracking(parts, position, ("frames", frame))
    return terms


def _terminal_configuration(parts: ProblemParts) -> Terms:
    """Return sum_i w_i d_i^2 with the deviation d from the goal, q_i - q_goal,i or log(R_goal^T R)."""
    if parts.task.goal.periodic is not None:
        return {}
    names = parts.dynamics.configuration_names
    goal = parts.constants.goal(GOAL_CONFIGURATION, len(names))
    distance = deviation(names, parts.dynamics.configuration, goal)
    square = _square(parts, "terminal_configuration", distance, deviation_names(names))
    return {"terminal configuration": square}


def _terminal_velocity(parts: ProblemParts) -> Terms:
    """Return sum_i w_i (v_i - v_goal,i)^2."""
    dynamics = parts.dynamics
    if parts.task.goal.periodic is not None:
        return {}
    distance = dynamics.velocity - parts.constants.goal(GOAL_VELOCITY, len(dynamics.velocity_names))
    return {"terminal velocity": _square(parts, "terminal_velocity", distance, dynamics.velocity_names)}


def _time(parts: ProblemParts) -> Terms:
    """Return w t at the end."""
    return {"time": parts.constants["costs", "time"] * parts.clock} if parts.task.costs.time else {}


def _control_change(parts: ProblemParts) -> TrajectoryConstraint:
    """Return sum_k w (u_{k+1} - u_k)^2."""
    system, names = parts.contact_system.system, parts.dynamics.control_names
    x, u = ca.SX.sym("next_x", system.state.numel()), ca.SX.sym("next_u", system.control.numel())
    change = (u - system.control)[: len(names)]
    cost = _square(parts, "control_change", change, names)
    parameters = parts.constants.used_in(cost)
    return TrajectoryConstraint(
        "control change",
        "coupling",
        ca.vertcat(system.state, system.control, x, u),
        parts.grid.everywhere,
        cost={"control change": cost},
        parameters=parameters,
        values=parts.values_of(parameters),
    )


def _acceleration(parts: ProblemParts) -> TrajectoryConstraint:
    """Return sum_k w ((v_{k+1} - v_k) / h)^2 h, h the lengths of intervals and v_k the velocities at their ends."""
    state, dynamics, grid = parts.contact_system.system.state, parts.dynamics, parts.grid
    x = ca.SX.sym("next_x", state.numel())
    first = dynamics.configuration.numel()
    change = (x - state)[first : first + dynamics.velocity.numel()]
    length = (x - state)[parts.clock_index] if grid.moving else grid.nominal / grid.intervals
    cost = _square(parts, "acceleration", change, dynamics.velocity_names) / length
    parameters = parts.constants.used_in(cost)
    return TrajectoryConstraint(
        "acceleration",
        "interval",
        ca.vertcat(state, x),
        grid.everywhere,
        cost={"acceleration": cost},
        parameters=parameters,
        values=parts.values_of(parameters),
    )


INTEGRANDS: Mapping[str, Callable[[ProblemParts], Terms]] = {
    "configuration": _configuration,
    "velocity": _velocity,
    "control": _control,
    "control_sum": _control_sum,
    "force": _force,
    "slipping": _slipping,
    "center_of_mass": _center_of_mass,
    "frames": _frames,
}
"""Key of `costs` -> its terms under the integral over numerical time."""

FINAL_TERMS: Mapping[str, Callable[[ProblemParts], Terms]] = {
    "terminal_configuration": _terminal_configuration,
    "terminal_velocity": _terminal_velocity,
    "time": _time,
}
"""Key of `costs` -> its terms of the state at the end."""

TRAJECTORY_COSTS: Mapping[str, Callable[[ProblemParts], TrajectoryConstraint]] = {
    "control_change": _control_change,
    "acceleration": _acceleration,
}
"""Key of `costs` -> its cost of the states or controls of several intervals; called where a weight is given."""


def _square(parts: ProblemParts, key: str, x: ca.SX, names: Sequence[str]) -> ca.SX:
    """Return sum_i w_i x_i^2 with the weights of a key of `costs`; names not listed have none."""
    return ca.dot(parts.constants.weights((key,), names), x**2)


def _rate(parts: ProblemParts) -> ca.SX:
    return parts.contact_system.clock_rate


def _tracking(parts: ProblemParts, position: ca.SX, key: KeyPath) -> ca.SX:
    """Return sum_i w_i (p_i(q) - p_i(q_ref))^2 with the weights of the axes under a key of `costs`."""
    wanted = ca.substitute(position, parts.points.q, parts.reference_configuration)
    return ca.dot(parts.constants.weights(key, AXES), (position - wanted) ** 2)


def _united(terms: Iterable[Terms]) -> Terms:
    return {name: expression for each in terms for name, expression in each.items()}
