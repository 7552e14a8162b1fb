"""Where along a motion something else would happen most easily: where a contact is slow, light, or near."""

from __future__ import annotations

from collections.abc import Sequence as ListOf
from dataclasses import dataclass

import casadi as ca
import numpy as np

from fesd_robot.fesd.neighbours import KnownTrajectory
from fesd_robot.ocp import MotionProblem, gap_function

SLOW = 0.02
"""Part of the largest speed of a contact below which it is slow."""


@dataclass(frozen=True)
class ContactProfile:
    """What contacts do at the stages of a motion, (n,) of them.

    Attributes:
        time: s, (n).
        speed: of every contact along its surface, m/s, (n, n_c).
        force: normal forces, in units of a_n, of rigid and behind them of compliant contacts, (n, n_c + n_s).
        used: part of the friction cone that is used, (n, n_c).
        gap: of the same as the forces, m, (n, n_c + n_s).
    """

    time: np.ndarray
    speed: np.ndarray
    force: np.ndarray
    used: np.ndarray
    gap: np.ndarray

    @classmethod
    def of(cls, motion: MotionProblem, known: KnownTrajectory) -> ContactProfile:
        """Return the profile of a motion of a task."""
        dynamics, contacts = motion.dynamics, motion.contacts
        speeds = [ca.norm_2(ca.vertcat(*one.tangential_velocities(dynamics.velocity))) for one in contacts]
        kinematics = ca.Function("speeds", [dynamics.configuration, dynamics.velocity], [ca.vertcat(*speeds)])
        shares = motion.contact_system.theta_auxiliary
        used = [ca.norm_2(ca.vertcat(*own.tangential)) / (own.normal + _NOTHING) for own in shares]
        forces = ca.Function(
            "forces",
            [motion.ocp.system.algebraic],
            [
                ca.vertcat(
                    *[own.normal for own in shares],
                    *[one / motion.auxiliary_force for one in motion.contact_system.compliant_forces],
                ),
                ca.vertcat(*used),
            ],
        )
        every = [*contacts, *(one.contact for one in motion.compliant)]
        gaps, n_q = gap_function(dynamics, every), len(motion.robot.configuration_names)
        n_v, clock = len(motion.robot.velocity_names), known.clock
        states = np.vstack([element.x[: len(element.z)] for element in known.running])
        algebraic = np.vstack([element.z for element in known.running])
        q, v = states[:, :n_q].T, states[:, n_q : n_q + n_v].T
        normal, share = (np.asarray(part.full()).T for part in forces.map(len(states))(algebraic.T))
        return cls(
            states[:, clock],
            np.asarray(kinematics.map(len(states))(q, v).full()).T,
            normal,
            share,
            np.asarray(gaps.map(len(states))(q).full()).T,
        )

    def slow(self, group: ListOf[int], begin: float, end: float) -> tuple[float, float]:
        """Return a span in which contacts are slow, around the time at which they are slowest, between two times, s."""
        speed = self.speed[:, list(group)].max(axis=1)
        inside = np.flatnonzero((self.time >= begin) & (self.time <= end))
        if not len(inside):
            return (begin + end) / 2, (begin + end) / 2
        at = inside[int(np.argmin(speed[inside]))]
        first = last = at
        limit = max(SLOW * float(speed.max()), float(speed[at]))
        while first - 1 in inside and speed[first - 1] <= limit:
            first -= 1
        while last + 1 in inside and speed[last + 1] <= limit:
            last += 1
        return float(self.time[first]), float(self.time[last])

    def least(self, values: np.ndarray, group: ListOf[int], begin: float, end: float) -> tuple[float, float]:
        """Return the time, twice, at which values of contacts, (n, n_c), are least between two times, s."""
        inside = np.flatnonzero((self.time >= begin) & (self.time <= end))
        if not len(inside):
            return (begin + end) / 2, (begin + end) / 2
        at = float(self.time[inside[int(np.argmin(values[inside][:, list(group)].sum(axis=1)))]])
        return at, at


_NOTHING = 1e-12
"""Added to a force that is divided by."""
