"""A returned trajectory as both tools give it, finite element by finite element, and its cost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from fesd_robot.fesd import Element, Tableau


@dataclass(frozen=True)
class Samples:
    """Finite elements of a collocation scheme.

    Attributes:
        tableau: the scheme.
        steps: lengths h, numerical time, (n).
        points: states at the left boundary and at the stages, (n, 1 + n_s, n_x).
        controls: (n, n_u).
    """

    tableau: Tableau
    steps: np.ndarray
    points: np.ndarray
    controls: np.ndarray

    @classmethod
    def of(cls, elements: Sequence[Element], tableau: Tableau) -> Samples:
        """Return the trajectory of fesd-robot's elements."""
        return cls(
            tableau,
            np.array([element.step for element in elements]),
            np.array([np.vstack([element.x_left, element.x[: tableau.stages]]) for element in elements]),
            np.array([element.u for element in elements]),
        )

    def cost(self, state: ca.SX, control: ca.SX, running: ca.SX, terminal: ca.SX, clock: int | None = None) -> float:
        """Return int running dt + terminal along the collocation polynomials, by Gauss quadrature with five points.

        Args:
            state, control: symbols of the expressions `running` and `terminal`.
            clock: index of the state that is physical time t; dt is that of numerical time if omitted.
        """
        nodes, weights = (0.5 * part for part in np.polynomial.legendre.leggauss(5))
        nodes = nodes + 0.5
        integrand = ca.Function("running", [state, control], [running]).map(len(nodes))
        total = 0.0
        for h, points, u in zip(self.steps, self.points, self.controls, strict=True):
            values = self.tableau.interpolate(points, nodes)
            rates = np.full(len(nodes), h)
            if clock is not None:
                ends = [self.tableau.interpolate(points, nodes + shift)[:, clock] for shift in (-1e-4, 1e-4)]
                rates = (ends[1] - ends[0]) / 2e-4  # of a polynomial of low degree
            level = np.asarray(integrand(values.T, np.tile(u[:, None], len(nodes)))).ravel()
            total += float(np.sum(weights * rates * level))
        end = ca.Function("terminal", [state], [terminal])
        return total + float(end(self.points[-1, -1]))
