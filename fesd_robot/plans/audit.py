"""The audit: physics recomputed from the returned trajectory, trusting no solver."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from fesd_robot.plans.audit_record import Audit
from fesd_robot.plans.findings import findings_of
from fesd_robot.plans.measured import Measured, Names, largest, largest_entry
from fesd_robot.plans.mode_forces import ModeForces
from fesd_robot.plans.stage_forces import StageForces
from fesd_robot.recovery import PhysicalMotion
from fesd_robot.recovery.contact_rows import normal_rows, stacked_rows
from fesd_robot.recovery.physics import NumericPhysics, split_contact_force

STANDARD_GRAVITY = 9.81
"""m/s^2; used for the tolerance of the energy even where the robot moves on a level table."""


def audit(
    motion: PhysicalMotion,
    physics: NumericPhysics,
    *,
    names: Names,
    interval_ends: np.ndarray,
    position_limits: tuple[np.ndarray, np.ndarray],
    velocity_limits: tuple[np.ndarray, np.ndarray],
    control_limits: tuple[np.ndarray, np.ndarray],
    others: Mapping[str, Measured] | None = None,
) -> Audit:
    """Return what Pinocchio's numeric algorithms say about a motion, with a finding for every violated entry.

    At every stage the force of contacts and of the dry friction of joints is what M(q) a + h(q, v) - B u asks for, with
    the acceleration a taken from the trajectory; it is solved for in least squares, and everything that closed contacts
    and these joints cannot supply counts as an error of the dynamics. Only where the motion leaves open how they divide
    a force, the motion's own forces decide. At the ends of elements and between their stages it is what the planned
    modes ask for (`ModeForces`).

    Args:
        motion: the trajectory in physical time.
        names: of contacts, coordinates and controls, for the findings.
        interval_ends: kT/N, k = 1..N, s.
        position_limits, velocity_limits, control_limits: (lower, upper).
        others: further entries: of the task's own requirements, from `requirements.requirements`, and of the motion's
            replay, from `replay_record.replay_entries`; those that are omitted are left unchecked.
    """
    states, modes, stages = motion.states, ModeForces(motion, physics, names), StageForces(motion, physics, names)
    measured = {
        "min_gap": _smallest_gap(motion, physics, names),
        "max_gap_drift": _gap_drift(motion, physics, names),
        "max_clock_error": _clock_error(motion, interval_ends),
        "max_theta_sum_error": Measured(motion.theta_sum_error),
        "max_friction_cone_violation": largest([stages.cone(), modes.cone()]),
        "max_stick_slip_violation": stages.stick_slip(),
        "max_normal_force_violation": largest([stages.pulling(), modes.pulling()]),
        "max_dynamics_error": stages.dynamics(),
        "max_impact_law_error": largest(_impact_errors(motion, physics, names)),
        "max_position_limit_violation": _outside(
            states.configuration, position_limits, names.configuration, states.time, states.interval
        ),
        "max_velocity_limit_violation": _outside(
            states.velocity, velocity_limits, names.velocity, states.time, states.interval
        ),
        "max_control_limit_violation": _outside(
            motion.control, control_limits, names.controls, motion.time, motion.interval
        ),
        "max_position_defect": largest(_position_defects(motion, physics, names)),
        "max_energy_error": largest(_energy_errors(motion, physics)),
        "max_improper_slide_time": modes.improper_slides(),
        "max_force_at_opening": modes.openings(),
        "max_joint_friction_violation": largest([stages.joint_friction(), modes.joint_friction()]),
        "max_joint_slide_violation": largest([stages.joint_slides(), modes.joint_slides()]),
        **(others or {}),
    }
    values = {name: one.value for name, one in measured.items()}
    found = Audit.of(values, lifting=physics.mass * STANDARD_GRAVITY)
    return found.model_copy(update={"findings": findings_of(found, measured)})


def _outside(
    values: np.ndarray,
    limits: tuple[np.ndarray, np.ndarray],
    units: Mapping[str, str],
    time: np.ndarray,
    interval: np.ndarray,
) -> Measured:
    lower, upper = limits
    found = largest_entry(np.maximum(lower - values, values - upper), time, interval, list(units))
    return replace(found, unit=units.get(found.subject, ""))


def _smallest_gap(motion: PhysicalMotion, physics: NumericPhysics, names: Names) -> Measured:
    states = motion.states
    gaps = np.array([physics.gaps(q) for q in states.configuration])
    row, contact = np.unravel_index(int(np.argmin(gaps)), gaps.shape)  # argmin finds the first NaN
    place = float(states.time[row]), int(states.interval[row]), names.contacts[int(contact)]
    return Measured(float(gaps[row, contact]), *place)


def _gap_drift(motion: PhysicalMotion, physics: NumericPhysics, names: Names) -> Measured:
    if motion.gap_state.shape[1] == 0:
        return Measured(0.0)
    gaps = np.array([physics.gaps(q) for q in motion.configuration])
    return largest_entry(np.abs(gaps - motion.gap_state), motion.time, motion.interval, names.contacts)


def _clock_error(motion: PhysicalMotion, interval_ends: np.ndarray) -> Measured:
    errors = np.abs(motion.clock - interval_ends)
    return largest_entry(errors[:, None], motion.clock, np.arange(len(errors)), ["the clock"])


def _impact_errors(motion: PhysicalMotion, physics: NumericPhysics, names: Names) -> Iterator[Measured]:
    for impact in motion.impacts:
        place = float(motion.time[impact.after]), int(motion.interval[impact.after])
        q = motion.configuration[impact.after]
        jacobian = physics.contact_jacobian(q)
        jump = physics.mass_matrix(q) @ (motion.velocity[impact.after] - motion.velocity[impact.before])
        hit = impact.taking_part
        impulse, unexplained = split_contact_force(jump, jacobian, hit, physics.friction, impact.impulse)
        normal, tangential = impulse[hit].T
        before, after = (normal_rows(jacobian @ motion.velocity[k])[hit] for k in (impact.before, impact.after))
        excess = np.abs(tangential) - physics.friction[hit] * np.maximum(normal, 0.0)
        left = np.abs(after) / np.maximum(np.abs(before), 1.0)
        for i, *errors in zip(np.flatnonzero(hit).tolist(), left, excess, -normal, strict=True):
            yield Measured(float(np.max(errors)), *place, names.contacts[i])
        yield Measured(float(np.abs(unexplained).max()), *place, ", ".join(np.array(names.contacts)[hit]))


def _position_defects(motion: PhysicalMotion, physics: NumericPhysics, names: Names) -> Iterator[Measured]:
    """Yield the largest |change of configuration - integral of the velocity| of every control interval, m or rad."""
    start, coordinates = 0, list(names.velocity)
    for interval in np.unique(motion.interval):
        end = int(np.flatnonzero(motion.interval == interval)[-1])
        inside = slice(start + 1, end + 1)
        travelled = motion.weight[inside] @ motion.velocity[inside]
        defects = np.abs(physics.difference(motion.configuration[start], motion.configuration[end]) - travelled)
        worst = int(np.argmax(defects))
        yield Measured(float(defects[worst]), float(motion.time[end]), int(interval), coordinates[worst])
        start = end


def _energy_errors(motion: PhysicalMotion, physics: NumericPhysics) -> Iterator[Measured]:
    """Yield |change of energy - work - impact losses| of every control interval, J."""
    energy = np.array([physics.energy(q, v) for q, v in zip(motion.configuration, motion.velocity, strict=True)])
    jumps = {impact.after: energy[impact.after] - energy[impact.before] for impact in motion.impacts}
    balance = 0.0
    for k in range(1, len(energy)):
        balance += energy[k] - energy[k - 1] - jumps.get(k, 0.0)
        if motion.weight[k] > 0:
            q, v = motion.configuration[k], motion.velocity[k]
            force = physics.generalized_force(q, motion.control[k]) - physics.damping * v
            force = force + physics.contact_jacobian(q).T @ stacked_rows(motion.force[k]) + motion.dry_friction(k)
            balance -= motion.weight[k] * float(force @ v)
        if k + 1 == len(energy) or motion.interval[k + 1] != motion.interval[k]:
            yield Measured(abs(float(balance)), float(motion.time[k]), int(motion.interval[k]))
            balance = 0.0
