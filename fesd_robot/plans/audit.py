"""The audit: physics recomputed from the returned trajectory, trusting no solver."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from fesd_robot.instants import SAME_TIME
from fesd_robot.orientations import angles_of, orientations_of, quaternion_entries, roll_pitch_yaw, turn_entries
from fesd_robot.plans.audit_record import Audit, AuditScales
from fesd_robot.plans.findings import findings_of
from fesd_robot.plans.measured import Measured, Names, largest, largest_entry
from fesd_robot.plans.mode_forces import ModeForces
from fesd_robot.plans.stage_forces import StageForces
from fesd_robot.recovery import (
    NumericPhysics,
    PhysicalMotion,
    by_contact,
    normal_rows,
    split_contact_force,
    stacked_rows,
)
from fesd_robot.replay import impact, rebounds
from fesd_robot.robot import STANDARD_GRAVITY

Bounds = tuple[np.ndarray, np.ndarray]
"""Lower and upper."""


@dataclass(frozen=True)
class MotionLimits:
    """Limits with which a motion is compared.

    Attributes:
        position, velocity, control: bounds of configuration (n_q), velocity (n_v) and controls (n_u).
        entries: name of an entry of the audit -> limit in place of its default.
        angles: name of an angle of an orientation -> lower and upper, rad.
    """

    position: Bounds
    velocity: Bounds
    control: Bounds
    entries: Mapping[str, float] = field(default_factory=dict)
    angles: Mapping[str, tuple[float, float]] = field(default_factory=dict)


def audit(
    motion: PhysicalMotion,
    physics: NumericPhysics,
    *,
    names: Names,
    interval_ends: np.ndarray,
    limits: MotionLimits,
    others: Mapping[str, Measured] | None = None,
) -> Audit:
    """Audit a motion by Pinocchio's numeric algorithms, with a finding for every violated entry.

    At every stage the force of contacts and of the dry friction of joints is what M(q) a + h(q, v) - B u asks for, with
    the acceleration a taken from the trajectory; it is solved for in least squares, and everything that closed contacts
    and these joints cannot supply counts as an error of the dynamics. Only where the motion leaves open how they divide
    a force, the motion's own forces decide. At the ends of elements and between their stages it is what the planned
    modes ask for (`ModeForces`).

    Args:
        motion: the trajectory in physical time.
        names: of contacts, coordinates and controls, for the findings.
        interval_ends: kT/N, k = 1..N, s.
        limits: of the motion and of the audit itself.
        others: further entries: of the task's own requirements, from `requirements.requirements`, and of the motion's
            replay, from `replay_record.replay_entries`; those that are omitted are left unchecked.
    """
    energies = _Energies(motion, physics)
    states, modes, stages = motion.states, ModeForces(motion, physics, names), StageForces(motion, physics, names)
    measured = {
        **({"min_gap": _smallest_gap(motion, physics, names)} if names.contacts else {}),
        "max_gap_drift": _gap_drift(motion, physics, names),
        "max_clock_error": _clock_error(motion, interval_ends),
        "max_theta_sum_error": Measured(motion.theta_sum_error),
        "max_friction_cone_violation": largest([stages.cone(), modes.cone()]),
        "max_stick_slip_violation": stages.stick_slip(),
        "max_normal_force_violation": largest([stages.pulling(), modes.pulling()]),
        "max_dynamics_error": stages.dynamics(),
        "max_impact_law_error": largest(_impact_errors(motion, physics, names)),
        "max_position_limit_violation": largest(
            [
                _outside(states.configuration, limits.position, names.configuration, states.time, states.interval),
                _angles_outside(motion, names, limits.angles),
            ]
        ),
        "max_velocity_limit_violation": _outside(
            states.velocity, limits.velocity, names.velocity, states.time, states.interval
        ),
        "max_control_limit_violation": _outside(
            motion.control, limits.control, names.controls, motion.time, motion.interval
        ),
        "max_position_defect": largest(_position_defects(motion, physics, names)),
        "max_energy_error": largest(energies.errors),
        "max_improper_slide_time": modes.improper_slides(),
        "max_force_at_opening": modes.openings(),
        "max_joint_friction_violation": largest([stages.joint_friction(), modes.joint_friction()]),
        "max_joint_slide_violation": largest([stages.joint_slides(), modes.joint_slides()]),
        "max_compliant_force_error": _compliant_error(motion, physics, names),
        "max_quaternion_norm_error": _quaternion_norm_error(motion, names),
        "max_impact_energy_gain": _impact_gain(motion, physics, names),
        **(others or {}),
    }
    values = {name: one.value for name, one in measured.items()}
    scales = AuditScales(weight=physics.mass * STANDARD_GRAVITY, turnover=energies.turnover)
    found = Audit.of(values, scales, limits.entries)
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


def _angles_outside(motion: PhysicalMotion, names: Names, limits: Mapping[str, tuple[float, float]]) -> Measured:
    """Return the largest excess of an angle over its limits, rad; of roll and yaw the shorter way round."""
    states, found = motion.states, [Measured(0.0)]
    for joint, at in quaternion_entries(list(names.configuration)).items():
        values = roll_pitch_yaw(states.configuration[:, at])
        for name, angle in zip(angles_of(joint), values.T, strict=True):
            found.append(_angle_outside(motion, name, angle, limits))
    for joint, at in turn_entries(list(names.configuration)).items():
        cosine, sine = states.configuration[:, at].T
        found.append(_angle_outside(motion, joint, np.arctan2(sine, cosine), limits))
    return largest(found)


def _angle_outside(
    motion: PhysicalMotion, name: str, angle: np.ndarray, limits: Mapping[str, tuple[float, float]]
) -> Measured:
    states, (lower, upper) = motion.states, limits.get(name, (-np.inf, np.inf))
    if np.isfinite([lower, upper]).all():
        middle = (lower + upper) / 2
        angle = middle + np.remainder(angle - middle + np.pi, 2 * np.pi) - np.pi
    bounds = np.array([lower]), np.array([upper])
    return _outside(angle[:, None], bounds, {name: "rad"}, states.time, states.interval)


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


def _compliant_error(motion: PhysicalMotion, physics: NumericPhysics, names: Names) -> Measured:
    """Return the largest difference of the force of a compliant contact from that of its spring and damper, N."""
    if motion.compliance is None:
        return Measured(0.0)
    states = zip(motion.configuration, motion.velocity, strict=True)
    errors = np.abs(motion.compliance.force - np.array([physics.compliant_forces(q, v) for q, v in states]))
    return largest_entry(errors, motion.time, motion.interval, names.compliant)


def _quaternion_norm_error(motion: PhysicalMotion, names: Names) -> Measured:
    states, own = motion.states, quaternion_entries(list(names.configuration))
    lengths = np.array([np.linalg.norm(states.configuration[:, at], axis=1) for at in own.values()])
    return largest_entry(np.abs(lengths - 1.0).T, states.time, states.interval, list(own))


def _clock_error(motion: PhysicalMotion, interval_ends: np.ndarray) -> Measured:
    errors = np.abs(motion.clock - interval_ends)
    return largest_entry(errors[:, None], motion.clock, np.arange(len(errors)), ["the clock"])


def _impact_errors(motion: PhysicalMotion, physics: NumericPhysics, names: Names) -> Iterator[Measured]:
    for one in motion.impacts:
        place = float(motion.time[one.after]), int(motion.interval[one.after])
        q = motion.configuration[one.after]
        jacobian = physics.contact_jacobian(q)
        jump = physics.mass_matrix(q) @ (motion.velocity[one.after] - motion.velocity[one.before])
        hit = one.taking_part
        impulse, unexplained = split_contact_force(jump, jacobian, hit, physics.friction, one.impulse)
        normal, tangential = impulse[hit, 0], np.linalg.norm(impulse[hit, 1:], axis=1)
        before, after = (normal_rows(jacobian @ motion.velocity[k], physics.rows)[hit] for k in (one.before, one.after))
        excess = tangential - physics.friction[hit] * np.maximum(normal, 0.0)
        wanted = _parting(physics, q, motion.velocity[one.before], hit)
        parted = np.abs(after - wanted) if hit.sum() == 1 else np.maximum(wanted - after, 0.0)
        left = parted / np.maximum(np.abs(before), 1.0)
        for i, *errors in zip(np.flatnonzero(hit).tolist(), left, excess, -normal, strict=True):
            yield Measured(float(np.max(errors)), *place, names.contacts[i])
        yield Measured(float(np.abs(unexplained).max()), *place, ", ".join(np.array(names.contacts)[hit]))


def _parting(physics: NumericPhysics, q: np.ndarray, v: np.ndarray, hit: np.ndarray) -> np.ndarray:
    """Return the normal velocity with which every contact that takes part in an impact has to part, m/s.

    That is -e J_n v, less only where the restitution of the contact is spent before.

    Args:
        q, v: configuration and velocity before the impact.
        hit: contacts that take part, (n_c) of bool.
    """
    jacobian = physics.contact_jacobian(q)
    newton = rebounds(physics, jacobian @ v)[hit]
    if not newton.any():
        return newton
    reached = normal_rows(jacobian @ impact(physics, q, v, hit).velocity, physics.rows)[hit]
    return np.asarray(np.clip(reached, 0.0, newton))


def _impact_gain(motion: PhysicalMotion, physics: NumericPhysics, names: Names) -> Measured:
    """Return the largest rise of the kinetic energy in an impact, J, and where."""
    gains = [Measured(0.0)]
    for one in motion.impacts:
        mass = physics.mass_matrix(motion.configuration[one.after])
        before, after = (0.5 * v @ mass @ v for v in motion.velocity[[one.before, one.after]])
        place = float(motion.time[one.after]), int(motion.interval[one.after])
        hit = ", ".join(np.array(names.contacts)[one.taking_part])
        gains.append(Measured(max(float(after - before), 0.0), *place, hit))
    return largest(gains)


def _position_defects(motion: PhysicalMotion, physics: NumericPhysics, names: Names) -> Iterator[Measured]:
    """Yield the largest |change of configuration - integral of the velocity| of every control interval, m or rad.

    Of a robot with quaternions those of its elements add up: a change of an orientation is half a turn at most.
    """
    start, coordinates, turns = 0, list(names.velocity), bool(orientations_of(names.configuration))
    ends = motion.between.time[:, -1]
    for interval in np.unique(motion.interval):
        end = int(np.flatnonzero(motion.interval == interval)[-1])
        cuts = [
            k for k in range(start + 1, end) if turns and np.abs(ends - motion.time[k]).min(initial=np.inf) <= SAME_TIME
        ]
        defects = np.sum([_defect(motion, physics, *part) for part in pairwise([start, *cuts, end])], axis=0)
        worst = int(np.argmax(defects))
        yield Measured(float(defects[worst]), float(motion.time[end]), int(interval), coordinates[worst])
        start = end


def _defect(motion: PhysicalMotion, physics: NumericPhysics, start: int, end: int) -> np.ndarray:
    """Return |change of configuration - integral of the velocity| from one sample to another, m or rad, (n_v)."""
    inside, first = range(start + 1, end + 1), motion.configuration[start]
    displacements = [physics.difference(first, motion.configuration[k]) for k in inside]
    rates = [
        physics.displacement_rate(first, displacement, motion.velocity[k])
        for k, displacement in zip(inside, displacements, strict=True)
    ]
    return np.asarray(np.abs(displacements[-1] - motion.weight[start + 1 : end + 1] @ np.array(rates)))


class _Energies:
    """The balance of energy of a motion over its control intervals.

    Attributes:
        errors: |change of energy - work - losses of impacts| of every interval, J. Contacts only take energy: what they
            add, as where a foot is pushed along while it sticks, is no work here but an error.
        turnover: mean of what an interval turns over, J: the integral of |controls' power| by coordinate, |power| of
            every contact and damping, the change of potential energy from sample to sample, and losses of impacts.
    """

    def __init__(self, motion: PhysicalMotion, physics: NumericPhysics) -> None:
        self._motion, self._physics = motion, physics
        states = list(zip(motion.configuration, motion.velocity, strict=True))
        energy = np.array([physics.energy(q, v) for q, v in states])
        potential = np.array([physics.energy(q, np.zeros_like(v)) for q, v in states])
        jumps = {one.after: energy[one.after] - energy[one.before] for one in motion.impacts}
        balance, turned_over = 0.0, float(np.abs(np.diff(potential)).sum() + sum(map(abs, jumps.values())))
        self.errors: list[Measured] = []
        for k in range(1, len(energy)):
            balance += energy[k] - energy[k - 1] - jumps.get(k, 0.0)
            if motion.weight[k] > 0:
                work, of_contacts = (motion.weight[k] * powers for powers in self._powers(k))
                balance -= float(work.sum() + np.minimum(of_contacts.sum(axis=1), 0.0).sum())
                turned_over += float(np.abs(work).sum() + np.abs(of_contacts).sum())
            if k + 1 == len(energy) or motion.interval[k + 1] != motion.interval[k]:
                self.errors.append(Measured(abs(float(balance)), float(motion.time[k]), int(motion.interval[k])))
                balance = 0.0
        self.turnover = turned_over / max(len(self.errors), 1)

    def _powers(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the powers of controls, damping, dry friction and compliant contacts by coordinate, W.

        And those of rigid contacts, (n_c, rows), W.
        """
        motion, physics = self._motion, self._physics
        q, v = motion.configuration[k], motion.velocity[k]
        velocity = physics.contact_jacobian(q) @ v
        work = [
            physics.generalized_force(q, motion.control[k]) * v,
            -physics.damping * v**2,
            motion.dry_friction(k) * v,
            physics.compliant_push(q, v) * v,
        ]
        return np.concatenate(work), by_contact(stacked_rows(motion.force[k]) * velocity, physics.rows)
