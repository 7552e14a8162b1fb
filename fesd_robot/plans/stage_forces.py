"""Contact forces at the stages of a motion, from its accelerations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fesd_robot.plans.measured import Measured, Names, cone_excess, largest
from fesd_robot.recovery import NumericPhysics, PhysicalMotion, split_forces, tangential_rows


class StageForces:
    """Forces at the stages, from the accelerations there: M a + h + D v - B u = J^T f + tau in least squares.

    tau is the dry friction of joints.

    Args:
        motion: in physical time.
        physics: of its robot and contacts.
        names: of its contacts.
    """

    def __init__(self, motion: PhysicalMotion, physics: NumericPhysics, names: Names) -> None:
        self._cone: list[Measured] = []
        self._pulling: list[Measured] = []
        self._slip: list[Measured] = []
        self._dynamics: list[Measured] = []
        self._joint_friction: list[Measured] = []
        self._joint_slides: list[Measured] = []
        self._joints = [list(names.velocity)[row] for row in physics.friction_coordinates]
        for k in np.flatnonzero(motion.weight > 0):
            self._look(motion, physics, int(k), names.contacts)

    def cone(self) -> Measured:
        """Return the largest excess of a tangential force over mu times the normal force, N."""
        return largest(self._cone)

    def pulling(self) -> Measured:
        """Return the largest pulling normal force, N."""
        return largest(self._pulling)

    def stick_slip(self) -> Measured:
        """Return the largest min(tangential speed, unused friction), and power that friction adds, m/s, N or W."""
        return largest(self._slip)

    def dynamics(self) -> Measured:
        """Return the largest part of the required force that closed contacts cannot supply, relative."""
        return largest(self._dynamics)

    def joint_friction(self) -> Measured:
        """Return the largest excess of a joint's dry friction over its limit, N or N m."""
        return largest(self._joint_friction)

    def joint_slides(self) -> Measured:
        """Return the largest min(speed, unused friction) of a joint, and power that its dry friction adds."""
        return largest(self._joint_slides)

    def _look(self, motion: PhysicalMotion, physics: NumericPhysics, k: int, contacts: Sequence[str]) -> None:
        q, v, place = motion.configuration[k], motion.velocity[k], (float(motion.time[k]), int(motion.interval[k]))
        jacobian = physics.contact_jacobian(q)
        required = physics.required_force(q, v, motion.acceleration[k], motion.control[k])
        closed = np.array([mode.closed for mode in motion.mode[k]], dtype=bool) | (motion.force[k, :, 0] > 0)
        friction_coordinates = physics.friction_coordinates
        planned = motion.dry_friction(k)[friction_coordinates]
        force, rubs, unexplained = split_forces(
            required, jacobian, closed, friction_coordinates, physics.friction, motion.force[k], planned
        )
        scale = 1.0 + np.abs(required).max() + np.abs(physics.generalized_force(q, motion.control[k])).max()
        self._dynamics.append(Measured(float(np.abs(unexplained).max() / scale), *place))
        rubbing, speeds = physics.rubbing, v[friction_coordinates]
        for unit in rubbing.units:
            name, unused = self._joints[unit[0]], rubbing.unused(unit, rubs)
            speed, scaled = rubbing.scaled(unit, speeds), rubs[unit] / rubbing.limit[unit] * rubbing.limit[unit[0]]
            self._joint_friction.append(Measured(-unused, *place, name))
            slide = max(min(float(np.linalg.norm(speed)), abs(unused)), _power(scaled, speed))
            self._joint_slides.append(Measured(float(slide), *place, name))
        velocities = tangential_rows(jacobian @ v, physics.rows)
        for i in np.flatnonzero(closed).tolist():
            excess, needed = cone_excess(force[i], float(physics.friction[i]))
            slip = max(min(float(np.linalg.norm(velocities[i])), abs(excess)), _power(force[i, 1:], velocities[i]))
            self._pulling.append(Measured(float(-force[i, 0]), *place, contacts[i]))
            self._cone.append(Measured(excess, *place, contacts[i], detail=needed))
            self._slip.append(Measured(float(slip), *place, contacts[i]))


def _power(friction: np.ndarray, velocity: np.ndarray) -> float:
    """Return by how much friction falls short of the power -|f_t| |v_t| that it has along the slide, W; in the plane,
    where it cannot be askew, twice the power that it adds."""
    along = float(friction @ velocity)
    if len(velocity) == 1:
        return along
    return along + float(np.linalg.norm(friction) * np.linalg.norm(velocity))
