"""The audit: physics recomputed from the returned trajectory, trusting no solver."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fesd_robot.plans.audit_record import Audit, largest_violation
from fesd_robot.recovery import PhysicalMotion
from fesd_robot.recovery.contact_rows import normal_rows, stacked_rows, tangential_rows
from fesd_robot.recovery.physics import NumericPhysics, split_contact_force

STANDARD_GRAVITY = 9.81
"""m/s^2; used for the tolerance of the energy even where the robot moves on a level table."""


def audit(
    motion: PhysicalMotion,
    physics: NumericPhysics,
    *,
    interval_ends: np.ndarray,
    position_limits: tuple[np.ndarray, np.ndarray],
    velocity_limits: tuple[np.ndarray, np.ndarray],
    control_limits: tuple[np.ndarray, np.ndarray],
    requirements: Mapping[str, float] | None = None,
    replay: Mapping[str, float] | None = None,
) -> Audit:
    """Return what Pinocchio's numeric algorithms say about a motion.

    At every stage the contact force is what M(q) a + h(q, v) - B u asks for, with the acceleration a taken from the
    trajectory; it is solved for in least squares, and everything the closed contacts cannot supply counts as an error
    of the dynamics. Only where the motion leaves open how contacts divide a force, the motion's own forces decide.

    Args:
        motion: the trajectory in physical time.
        interval_ends: kT/N, k = 1..N, s.
        position_limits, velocity_limits, control_limits: (lower, upper).
        requirements: entries of the task's own requirements, from `requirements.requirements`; left unchecked if
            omitted.
        replay: entries of the motion's replay, from `replay_record.replay_entries`; left unchecked if omitted.
    """
    values = {
        "min_gap": float(np.min([physics.gaps(q) for q in motion.configuration])),
        "max_gap_drift": _gap_drift(motion, physics),
        "max_clock_error": float(np.abs(motion.clock - interval_ends).max()),
        "max_theta_sum_error": motion.theta_sum_error,
        **_forces(motion, physics),
        "max_impact_law_error": _impact_error(motion, physics),
        "max_position_limit_violation": _outside(motion.configuration, position_limits),
        "max_velocity_limit_violation": _outside(motion.velocity, velocity_limits),
        "max_control_limit_violation": _outside(motion.control, control_limits),
        "max_position_defect": _position_defect(motion, physics),
        "max_energy_error": _energy_error(motion, physics),
        **(requirements or {}),
        **(replay or {}),
    }
    return Audit.of(values, lifting=physics.mass * STANDARD_GRAVITY)


def _outside(values: np.ndarray, limits: tuple[np.ndarray, np.ndarray]) -> float:
    lower, upper = limits
    return largest_violation(np.maximum(lower - values, values - upper).ravel().tolist())


def _gap_drift(motion: PhysicalMotion, physics: NumericPhysics) -> float:
    if motion.gap_state.shape[1] == 0:
        return 0.0
    gaps = np.array([physics.gaps(q) for q in motion.configuration])
    return float(np.abs(gaps - motion.gap_state).max())


def _forces(motion: PhysicalMotion, physics: NumericPhysics) -> dict[str, float]:
    cone: list[float] = []
    pull: list[float] = []
    slip: list[float] = []
    dynamics: list[float] = []
    for k in np.flatnonzero(motion.weight > 0):
        q, v = motion.configuration[k], motion.velocity[k]
        jacobian = physics.contact_jacobian(q)
        required = physics.required_force(q, v, motion.acceleration[k], motion.control[k])
        closed = np.array([mode in ("stick", "slip") for mode in motion.mode[k]]) | (motion.force[k, :, 0] > 0)
        force, unexplained = split_contact_force(required, jacobian, closed, physics.friction, motion.force[k])
        scale = 1.0 + np.abs(required).max() + np.abs(physics.generalized_force(q, motion.control[k])).max()
        dynamics.append(np.abs(unexplained).max() / scale)
        normal, tangential = force[closed].T
        tangential_velocity = tangential_rows(jacobian @ v)[closed]
        unused = physics.friction[closed] * np.maximum(normal, 0.0) - np.abs(tangential)
        pull += list(-normal)
        cone += list(-unused)
        slip += [*np.minimum(np.abs(tangential_velocity), np.abs(unused)), *(tangential_velocity * tangential)]
    return {
        "max_friction_cone_violation": largest_violation(cone),
        "max_stick_slip_violation": largest_violation(slip),
        "max_normal_force_violation": largest_violation(pull),
        "max_dynamics_error": largest_violation(dynamics),
    }


def _impact_error(motion: PhysicalMotion, physics: NumericPhysics) -> float:
    errors: list[float] = []
    for impact in motion.impacts:
        q = motion.configuration[impact.after]
        jacobian = physics.contact_jacobian(q)
        jump = physics.mass_matrix(q) @ (motion.velocity[impact.after] - motion.velocity[impact.before])
        hit = impact.taking_part
        impulse, unexplained = split_contact_force(jump, jacobian, hit, physics.friction, impact.impulse)
        normal, tangential = impulse[hit].T
        before, after = (normal_rows(jacobian @ motion.velocity[k])[hit] for k in (impact.before, impact.after))
        excess = np.abs(tangential) - physics.friction[hit] * np.maximum(normal, 0.0)
        errors += [*np.abs(after) / np.maximum(np.abs(before), 1.0), *np.abs(unexplained), *excess, *-normal]
    return largest_violation(errors)


def _position_defect(motion: PhysicalMotion, physics: NumericPhysics) -> float:
    """Largest |change of configuration - integral of the velocity| of a control interval, m or rad."""
    defects: list[float] = []
    start = 0
    for interval in np.unique(motion.interval):
        end = int(np.flatnonzero(motion.interval == interval)[-1])
        inside = slice(start + 1, end + 1)
        travelled = motion.weight[inside] @ motion.velocity[inside]
        moved = physics.difference(motion.configuration[start], motion.configuration[end])
        defects.append(np.abs(moved - travelled).max())
        start = end
    return largest_violation(defects)


def _energy_error(motion: PhysicalMotion, physics: NumericPhysics) -> float:
    """Largest |change of energy - work - impact losses| of a control interval, J."""
    energy = np.array([physics.energy(q, v) for q, v in zip(motion.configuration, motion.velocity, strict=True)])
    jumps = {impact.after: energy[impact.after] - energy[impact.before] for impact in motion.impacts}
    errors: list[float] = []
    balance = 0.0
    for k in range(1, len(energy)):
        balance += energy[k] - energy[k - 1] - jumps.get(k, 0.0)
        if motion.weight[k] > 0:
            q, v = motion.configuration[k], motion.velocity[k]
            force = physics.generalized_force(q, motion.control[k]) - physics.damping * v
            force = force + physics.contact_jacobian(q).T @ stacked_rows(motion.force[k])
            balance -= motion.weight[k] * float(force @ v)
        if k + 1 == len(energy) or motion.interval[k + 1] != motion.interval[k]:
            errors.append(abs(balance))
            balance = 0.0
    return largest_violation(errors)
