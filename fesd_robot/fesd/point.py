"""One point of a trajectory by itself: both sides of the pairs, and algebraic variables that fit a mode."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.exactness import SINGULAR
from fesd_robot.fesd.element import rate_function


@dataclass(frozen=True)
class PointFunctions:
    """A complementarity system evaluated at single points."""

    system: ComplementaritySystem

    @cached_property
    def sides(self) -> ca.Function:
        """Z -> (G, H)."""
        return ca.Function("sides", [self.system.algebraic], [self.system.G, self.system.H])

    @cached_property
    def rate(self) -> ca.Function:
        """(x, u, z, p) -> dx/dt."""
        return rate_function(self.system)

    @cached_property
    def _rows(self) -> ca.Function:
        system = self.system
        rows = ca.vertcat(system.residual, system.equations, system.G, system.H)
        return ca.Function("point", system.arguments, [rows, ca.jacobian(rows, system.algebraic)])

    def misfit(
        self, x: np.ndarray, u: np.ndarray, z: np.ndarray, p: np.ndarray, mode: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the residuals of a mode at a point, g, e and for every pair G_i or H_i, and their derivative by z."""
        rows, jacobian = (np.asarray(part.full()) for part in self._rows(x, u, z, p))
        fixed = len(rows) - 2 * len(mode)
        chosen = np.concatenate([np.arange(fixed), fixed + np.arange(len(mode)) + np.where(mode, 0, len(mode))])
        return rows.ravel()[chosen], jacobian[chosen]

    def fit(self, x: np.ndarray, u: np.ndarray, z: np.ndarray, p: np.ndarray, mode: np.ndarray) -> np.ndarray:
        """Return the z nearest to a given one that fit a mode at a state, as well as one point can tell."""
        for _ in range(2):
            value, jacobian = self.misfit(x, u, z, p, mode)
            z = z - np.linalg.lstsq(jacobian, value, rcond=SINGULAR)[0]
        return z
