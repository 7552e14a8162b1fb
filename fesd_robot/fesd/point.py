"""One point of a trajectory by itself: both sides of the pairs, and algebraic variables that fit a mode."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import casadi as ca
import numpy as np

from fesd_robot.dcs import ComplementaritySystem
from fesd_robot.fesd.element import rate_function

COMBINED_PAIRS = 10
"""Pairs among which modes are combined; more would be 2^n candidates."""


def subsets(pool: np.ndarray) -> list[np.ndarray]:
    """Return all non-empty subsets of a pool of pairs as booleans, smallest first.

    Of a pool with more than `COMBINED_PAIRS` the first ones are in every subset.
    """
    where = np.flatnonzero(pool)
    certain, where = where[:-COMBINED_PAIRS], where[-COMBINED_PAIRS:]
    modes = []
    for size in range(0 if certain.size else 1, where.size + 1):
        for chosen in combinations(where.tolist(), size):
            mode = np.zeros(len(pool), dtype=bool)
            mode[certain] = True
            mode[list(chosen)] = True
            modes.append(mode)
    return modes


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
        """Return what is not zero at a point in a mode, g, e and for every pair G_i or H_i, and its derivative by z."""
        rows, jacobian = (np.asarray(part.full()) for part in self._rows(x, u, z, p))
        fixed = len(rows) - 2 * len(mode)
        chosen = np.concatenate([np.arange(fixed), fixed + np.arange(len(mode)) + np.where(mode, 0, len(mode))])
        return rows.ravel()[chosen], jacobian[chosen]

    def fit(self, x: np.ndarray, u: np.ndarray, z: np.ndarray, p: np.ndarray, mode: np.ndarray) -> np.ndarray:
        """Return the z nearest to a given one that fit a mode at a state, as well as one point can tell."""
        for _ in range(2):
            value, jacobian = self.misfit(x, u, z, p, mode)
            z = z - np.linalg.lstsq(jacobian, value, rcond=1e-10)[0]
        return z

    def modes(self, x: np.ndarray, u: np.ndarray, z: np.ndarray, p: np.ndarray) -> list[np.ndarray]:
        """Return the modes that fit G at a point, fewest active pairs first."""
        fitting = []
        for mode in subsets(np.asarray(self.sides(z)[0]).ravel() <= 1e-9):
            fitted = self.fit(x, u, z, p, mode)
            if np.abs(self.misfit(x, u, fitted, p, mode)[0]).max() <= 1e-6 * (1.0 + np.abs(fitted).max()):
                fitting.append(mode)
        return fitting
