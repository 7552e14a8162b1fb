"""Solved finite elements, and the trajectory they make."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from fesd_robot.fesd.layout import IntervalLayout
from fesd_robot.fesd.tableau import Tableau


@dataclass(frozen=True)
class Element:
    """A solved finite element.

    Attributes:
        interval: control interval, or simulation step, it belongs to.
        start, step: numerical time of its left end and its length.
        x_left, z_left: state and algebraic variables at the left boundary (continuous from the element before, but for
            states that jump there).
        x: states at the stages, and at the right end if it is not a stage, (points, n_x).
        z: algebraic variables at the stages, and at the right end if it has its own, (points, n_z).
        u: control, (n_u).
        slopes: dx/dt at the stages, (n_s, n_x); zero in the integral form if the step is.
        jump: y of the jump at the left boundary, (n_y); empty where the state is continuous.
        before_jump: state before it, (n_x); None where the state is continuous.
    """

    interval: int
    start: float
    step: float
    x_left: np.ndarray
    z_left: np.ndarray
    x: np.ndarray
    z: np.ndarray
    u: np.ndarray
    slopes: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    jump: np.ndarray = field(default_factory=lambda: np.zeros(0))
    before_jump: np.ndarray | None = None

    @property
    def x_before(self) -> np.ndarray:
        """State that the element before ends with, (n_x)."""
        return self.x_left if self.before_jump is None else self.before_jump

    @property
    def end(self) -> float:
        """Numerical time of its right end."""
        return self.start + self.step

    def at(self, tableau: Tableau, times: np.ndarray) -> np.ndarray:
        """Return the states at times inside the element by the scheme's dense output, (m, n_x).

        The collocation polynomial, or ``X_0 + h sum_j b_j(tau) K_j``.
        """
        fractions = (np.asarray(times, dtype=float) - self.start) / self.step if self.step > 0 else np.ones(len(times))
        if tableau.collocation:
            return tableau.interpolate(np.vstack([self.x_left, self.x[: tableau.stages]]), fractions)
        return np.asarray(self.x_left + self.step * tableau.continuous_weights(fractions) @ self.slopes)


def interval_elements(
    layout: IntervalLayout, states: ca.Function, own: np.ndarray, left: np.ndarray, *, interval: int, start: float
) -> list[Element]:
    """Return the elements of a solved interval.

    Args:
        layout: order of the interval's variables.
        states: from `states_function`.
        own: the interval's own variables.
        left: (x, z) the interval starts from.
        interval, start: number of the interval and time of its left end.
    """
    n_x, elements = layout.n_x, []
    values, slopes = (np.asarray(part).T for part in states(left[:n_x], own))
    points = len(values) // layout.elements
    for n in range(layout.elements):
        step, x_left, before = float(own[layout.step(n)]), left[:n_x], None
        if layout.jump_size:
            before, x_left = x_left, x_left.copy()
            x_left[list(layout.jump_states)] = own[layout.jumped(n)]
        scale = 1.0 if layout.slopes else (1.0 / step if step > 0 else 0.0)  # the integral form gives h K_j
        elements.append(
            Element(
                interval=interval,
                start=start,
                step=step,
                x_left=x_left,
                z_left=left[n_x:],
                x=values[n * points : (n + 1) * points],
                z=np.array([own[layout.algebraic(n, j)] for j in range(layout.stages + layout.end_algebraic)]),
                u=own[: layout.n_u],
                slopes=slopes[n * layout.stages : (n + 1) * layout.stages] * scale,
                jump=own[layout.jump(n)],
                before_jump=before,
            )
        )
        start += step
        left = own[layout.end(n)]
    return elements


def element_integrals(
    function: ca.Function, tableau: Tableau, elements: Sequence[Element], p: np.ndarray
) -> np.ndarray:
    """Return the integrals over elements of a function of (x, u, z, p), by the scheme's own quadrature."""
    total = np.zeros(function.size1_out(0))
    if total.size:
        for element in elements:
            for weight, x, z in zip(tableau.b, element.x, element.z, strict=False):
                total += element.step * weight * np.asarray(function(x, element.u, z, p)).ravel()
    return total
