"""Algebraic variables of a contact system with given contact forces: where a solve begins."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.ocp import MotionProblem

INSIDE = 0.7
"""Part of the friction that a tangential force may use up."""

LEAST_RATE = 0.05
"""Of the clock in numerical time."""

NEWTON_STEPS = 10
"""For the algebraic variables that follow from the forces: products of a few factors."""


@dataclass(frozen=True)
class ForceVariables:
    """Algebraic variables and speed of time of a motion whose contact forces are known.

    Attributes:
        motion: the formulated task, with the logic in multipliers.
    """

    motion: MotionProblem

    def of(self, forces: np.ndarray, control: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return algebraic variables with given forces, (n_c, 1 + n_t), and the control with the speed of time.

        With theta_ODE s = 1 a force is a_n beta, and 1 / theta_ODE the speed of time.

        Args:
            forces: normal and tangential, N.
            control: of the interval, (n_u), whose speed of time is replaced.
        """
        ocp = self.motion.ocp
        z = self.at(forces, control)
        rate = float(self._free_flow(z))
        speed = np.append(control[:-1], 1 / max(rate, LEAST_RATE))
        return z, np.clip(speed, ocp.control_lower, ocp.control_upper)

    def at(self, forces: np.ndarray, control: np.ndarray) -> np.ndarray:
        """Return algebraic variables with given forces while the clock runs at rate 1: beta = f_n / a_n.

        Args:
            forces, control: as in `of`.
        """
        ocp = self.motion.ocp
        system = ocp.system
        z, given = np.zeros(system.algebraic.numel()), set[int]()
        multipliers = self.motion.contact_system.theta_auxiliary
        for own, one, force in zip(multipliers, self.motion.contacts, forces, strict=True):
            beta, limit = force[0] / self.motion.auxiliary_force, one.usable_friction * force[0]
            along = np.clip(force[1:] / limit, -INSIDE, INSIDE) if limit > 0 else np.ones(len(own.sides))
            for sides, share in zip(own.sides, along, strict=True):
                for side, sign in zip(sides, (-1, 1) if limit > 0 else (1, -1), strict=True):
                    for at in self._variable(side):
                        z[at] = beta * (1 + sign * share) / 2
                        given.add(at)
        open_ones = np.array(sorted(set(range(len(z))) - given), dtype=int)
        for _ in range(NEWTON_STEPS):
            residual, slope = (np.asarray(ca.DM(part).full()) for part in self._residual(z, control))
            z[open_ones] -= np.linalg.lstsq(slope[:, open_ones], residual.ravel(), rcond=None)[0]
        return np.clip(z, system.algebraic_lower, system.algebraic_upper)

    def _variable(self, side: ca.SX) -> list[int]:
        """Return the index of the algebraic variable that a multiplier is; nothing if it is none."""
        return list(ca.jacobian_sparsity(side, self.motion.ocp.system.algebraic).get_triplet()[1])

    @cached_property
    def _residual(self) -> ca.Function:
        system = self.motion.ocp.system
        z = system.algebraic
        symbols = [z, system.control]
        x = ca.DM(self.motion.ocp.state_guess(0.0))
        residual = ca.substitute(system.residual, system.state, ca.SX(x))
        return ca.Function("residual", symbols, [residual, ca.jacobian(residual, z)], {"allow_free": True})

    @cached_property
    def _free_flow(self) -> ca.Function:
        return ca.Function("rate", [self.motion.ocp.system.algebraic], [self.motion.contact_system.theta_ode])
