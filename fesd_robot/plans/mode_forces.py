"""Forces of the planned contact modes along the elements of a motion: at their ends and between their stages."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from fesd_robot.contact import ContactMode, Modes
from fesd_robot.exactness import NO_VELOCITY
from fesd_robot.instants import SAME_TIME
from fesd_robot.plans.measured import Measured, Names, cone_excess, largest
from fesd_robot.recovery import (
    SLIP_VELOCITY,
    NumericPhysics,
    PhysicalMotion,
    split_contact_force,
    stacked_rows,
    tangential_rows,
)
from fesd_robot.replay import (
    ContactDynamics,
    contact_dynamics,
    is_proper,
    motion_in_modes,
    slip_headings,
)

EVERY = 2
"""Of the points of an element every second one is looked at: the left end, the middle, the right end among them."""


@dataclass(frozen=True)
class ModeForces:
    """Forces of contacts in the modes that a plan has chosen, by Newton's and Coulomb's laws alone.

        M a + h + D v = B u + J^T f,   J_n a + (dJ_n/dt) v = 0 of closed contacts,   J_t a + (dJ_t/dt) v = 0 of sticking
        ones,   f_t = -mu s f_n of sliding ones,   a_i = 0 of sticking joints and tau_f = -F s of sliding ones

    is solved at states of every element, its left end included, where a control jumps and no stage is. The planner's
    own multipliers and accelerations take no part in it.

    Args:
        motion: in physical time.
        physics: of its robot and contacts.
        names: of its contacts.
    """

    motion: PhysicalMotion
    physics: NumericPhysics
    names: Names

    def pulling(self) -> Measured:
        """Return the largest pulling (negative) normal force, N."""
        return largest(
            self._at(point, i, -float(point.force[i, 0])) for point in self._points for i in point.closed_contacts
        )

    def cone(self) -> Measured:
        """Return the largest excess of a tangential force over mu times the normal force, N."""
        return largest(self._cone())

    def improper_slides(self) -> Measured:
        """Return the time of planned slides in modes that are not proper, s, and where that begins.

        In such a mode, W_nn - mu s W_nt < 0 for a single contact (Painleve), a larger normal force presses the contact
        into the ground: the force of the mode is not one that the approach of two bodies builds up. Slower slides than
        `SLIP_VELOCITY` are not looked at. The time is the trapezoidal sum over the points of every element.

        Source: Genot and Brogliato, New results on Painleve paradoxes, European Journal of Mechanics A 18 (1999).
        """
        total, first = 0.0, None
        for left, right in pairwise(self._points):
            if left.element == right.element:
                total += 0.5 * (right.time - left.time) * (float(left.improper) + float(right.improper))
                first = first or (left if left.improper else right if right.improper else None)
        if first is None:
            return Measured(total)
        sliding = next(i for i, mode in enumerate(first.modes) if mode.direction)
        return self._at(first, sliding, total)

    def openings(self) -> Measured:
        """Return the largest normal force, N, that a contact carries in its closed mode at the moment it opens.

        Inside a control interval neither state nor control jumps, so that the force of a contact that opens has fallen
        to zero by itself. Where several contacts share a force in more than one way, the division nearest to the forces
        after the opening counts. An opening directly after an impact, or where two control intervals meet, may begin
        with any force before it and is left out.
        """
        return largest(self._openings())

    def joint_friction(self) -> Measured:
        """Return the largest excess of the friction that a sticking joint needs over its limit, N or N m."""
        rubbing = self.physics.rubbing
        return largest(
            self._at_joint(point, unit[0], -rubbing.unused(unit, point.joint_force))
            for point in self._points
            for unit in rubbing.units
            if point.joint_modes[unit[0]] is ContactMode.STICK
        )

    def joint_slides(self) -> Measured:
        """Return the largest power, W, that dry friction adds where a joint moves against the slide of its mode."""
        rubbing = self.physics.rubbing
        return largest(
            self._at_joint(point, unit[0], float(point.joint_force[unit] @ point.joint_velocity[unit]))
            for point in self._points
            for unit in rubbing.units
            if point.joint_modes[unit[0]].direction
        )

    def _at_joint(self, point: _Point, joint: int, value: float) -> Measured:
        name = list(self.names.velocity)[self.physics.friction_coordinates[joint]]
        return Measured(value, point.time, int(self.motion.between.interval[point.element]), name)

    def _cone(self) -> Iterator[Measured]:
        for point in self._points:
            for i in point.closed_contacts:
                yield self._at(point, i, *cone_excess(point.force[i], float(self.physics.friction[i])))

    def _openings(self) -> Iterator[Measured]:
        dense = self.motion.between
        impacts = np.array([self.motion.time[impact.after] for impact in self.motion.impacts])
        for e in range(1, len(dense.time)):
            before, after = (self._modes(k) for k in (e - 1, e))
            opens = [i for i, (old, new) in enumerate(zip(before, after, strict=True)) if _opens(old, new)]
            time = float(dense.time[e, 0])
            if not opens or dense.interval[e] != dense.interval[e - 1]:
                continue
            if impacts.size and np.abs(impacts - time).min() < SAME_TIME:
                continue
            last, next_one = self._point(e - 1, -1), self._point(e, 0)
            force = self._nearest_division(last, next_one)
            for i in opens:
                yield self._at(last, i, float(force[i, 0]))

    def _nearest_division(self, point: _Point, following: _Point) -> np.ndarray:
        """Return forces with the effect of those at a point that are nearest to those that follow, N, (n_c, rows)."""
        if point.dynamics is None or following.dynamics is None:
            return np.full_like(point.force, np.nan)
        jacobian = point.dynamics.jacobian
        closed = np.array([mode is not ContactMode.FLIGHT for mode in point.modes], dtype=bool)
        effect = jacobian.T @ stacked_rows(point.force)
        return split_contact_force(effect, jacobian, closed, self.physics.friction, following.force)[0]

    def _at(self, point: _Point, contact: int, value: float, detail: str = "") -> Measured:
        return Measured(
            value,
            point.time,
            int(self.motion.between.interval[point.element]),
            self.names.contacts[contact],
            detail=detail,
        )

    @cached_property
    def _points(self) -> list[_Point]:
        """Points of all elements in which a contact is closed or a joint has dry friction, in time order."""
        dense = self.motion.between
        touching = [
            e
            for e in range(len(dense.time))
            if self.physics.friction_coordinates.size or any(mode is not ContactMode.FLIGHT for mode in self._modes(e))
        ]
        return [self._point(e, j) for e in touching for j in range(0, dense.time.shape[1], EVERY)]

    @cached_property
    def _headings(self) -> list[np.ndarray]:
        """Directions of slides in the middle of every element, (n_c, n_t) each: at its ends there may be none."""
        dense, middle = self.motion.between, self.motion.between.time.shape[1] // 2
        return [
            slip_headings(tangential_rows(self.physics.contact_jacobian(q) @ v, self.physics.rows))
            for q, v in zip(dense.configuration[:, middle], dense.velocity[:, middle], strict=True)
        ]

    @cached_property
    def _joint_headings(self) -> list[np.ndarray]:
        """The same of what rubs on a limit surface, (n_f) each."""
        dense, middle, rubbing = self.motion.between, self.motion.between.time.shape[1] // 2, self.physics.rubbing
        speeds = dense.velocity[:, middle, rubbing.coordinates]
        return [rubbing.headings(own, slow=NO_VELOCITY) for own in speeds]

    def _modes(self, element: int) -> Modes:
        return tuple(self.motion.between.mode[element])

    def _point(self, element: int, j: int) -> _Point:
        dense, modes = self.motion.between, self._modes(element)
        q, v, u = dense.configuration[element, j], dense.velocity[element, j], dense.control[element]
        time = float(dense.time[element, j])
        joints = tuple(dense.joint_mode[element])
        if not all(np.isfinite(part).all() for part in (q, v, u)):
            nowhere = np.full(len(joints), np.nan)
            return _Point(
                element, time, modes, np.full((len(modes), self.physics.rows), np.nan), None, joints, nowhere, nowhere
            )
        headings = self._headings[element], self._joint_headings[element]
        dynamics = contact_dynamics(self.physics, q, v, u, *headings).in_joint_modes(joints)
        force = motion_in_modes(dynamics, modes)[1]
        rubs, speeds = dynamics.joint_force(stacked_rows(force)), v[self.physics.friction_coordinates]
        return _Point(element, time, modes, force, dynamics, joints, rubs, speeds)


@dataclass(frozen=True)
class _Point:
    """Forces, (n_c, rows), of the planned modes at one point of an element, and dry friction of joints and their
    velocities, (n_f); without dynamics the state is no number."""

    element: int
    time: float
    modes: Modes
    force: np.ndarray
    dynamics: ContactDynamics | None
    joint_modes: Modes
    joint_force: np.ndarray
    joint_velocity: np.ndarray

    @property
    def closed_contacts(self) -> list[int]:
        return [i for i, mode in enumerate(self.modes) if mode is not ContactMode.FLIGHT]

    @cached_property
    def improper(self) -> bool:
        """Whether a contact slides and the modes are not proper."""
        if self.dynamics is None or is_proper(self.dynamics, self.modes):
            return False
        speeds = np.linalg.norm(tangential_rows(self.dynamics.velocity, self.dynamics.rows), axis=1)
        slides = speeds > SLIP_VELOCITY
        return any(mode.direction and slides[i] for i, mode in enumerate(self.modes))


def _opens(before: ContactMode, after: ContactMode) -> bool:
    return before is not ContactMode.FLIGHT and after is ContactMode.FLIGHT
