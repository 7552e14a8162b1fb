"""The polynomials of a motion's finite elements as functions of the clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import KroghInterpolator

from fesd_robot.fesd import make_tableau
from fesd_robot.fesd.schemes import Scheme
from fesd_robot.instants import SAME_TIME

_HALVINGS = 60
"""Bisections that find a point of an element to the last bit."""


@dataclass(frozen=True)
class PolynomialValues:
    """Values of the polynomials at m times.

    Attributes:
        element: number of the element of every time, (m,).
        state: (m, n_x).
        rate: derivative of the state by the clock, (m, n_x).
        carried: (m, n_k).
    """

    element: np.ndarray
    state: np.ndarray
    rate: np.ndarray
    carried: np.ndarray


class ElementPolynomials:
    """The collocation polynomials of E elements in which the clock runs, as functions of the clock.

    In an element with the fraction theta of its numerical time the scheme has one polynomial of degree n_s for every
    state, the clock t(theta) among them. It is inverted, so that at a time t

        x(t) = x(theta),   dx/dt = x'(theta) / t'(theta),   t(theta) = t

    and the derivative is the one that obeys the equations of motion at the stages. Quantities that have values at the
    stages only, as forces, have the polynomial of degree n_s - 1 through these.

    Args:
        scheme, stages: of the elements.
        nodes: states at the left end and the stages, (E, n_s + 1, n_x).
        carried: other quantities at the stages, (E, n_s, n_k).
        clock: column of the clock among the states.
    """

    def __init__(self, scheme: Scheme, stages: int, nodes: np.ndarray, carried: np.ndarray, clock: int) -> None:
        tableau = make_tableau(scheme, stages)
        self._states = [KroghInterpolator(tableau.nodes, each) for each in nodes]
        self._clocks = [KroghInterpolator(tableau.nodes, each[:, clock]) for each in nodes]
        self._carried = [KroghInterpolator(tableau.c, each) for each in carried]
        self._clock, self._n_k = clock, carried.shape[-1]
        self.start = nodes[:, 0, clock]
        self.end = np.array([float(each(1.0)) for each in self._clocks])

    def elements_at(self, time: np.ndarray, side: Sequence[bool] | np.ndarray) -> np.ndarray:
        """Return the element of every time, (m,); where two elements meet the later one if `side`, else the earlier.

        Args:
            time: s, (m,), within the motion.
            side: whether the later element is meant, (m,) of bool.
        """
        earlier = np.searchsorted(self.end, time - SAME_TIME, side="left")
        later = np.searchsorted(self.start, time + SAME_TIME, side="right") - 1
        return np.clip(np.where(side, later, earlier), 0, len(self.end) - 1)

    def __call__(self, time: np.ndarray, side: Sequence[bool] | np.ndarray) -> PolynomialValues:
        """Return the values at times, as in `elements_at`."""
        element = self.elements_at(time, side)
        n_x = self._states[0](0.0).shape[-1]
        state, rate = np.empty((len(time), n_x)), np.empty((len(time), n_x))
        carried = np.empty((len(time), self._n_k))
        for number in np.unique(element):
            where = np.flatnonzero(element == number)
            theta = self._fractions(int(number), time[where])
            slope = self._states[number].derivative(theta)
            state[where] = self._states[number](theta)
            rate[where] = slope / slope[:, self._clock, None]
            carried[where] = self._carried[number](theta)
        return PolynomialValues(element, state, rate, carried)

    def _fractions(self, number: int, time: np.ndarray) -> np.ndarray:
        """Return where in an element the clock shows a time, (m,); the clock never runs back."""
        low, high = np.zeros(len(time)), np.ones(len(time))
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            early = self._clocks[number](middle) < time
            low, high = np.where(early, middle, low), np.where(early, high, middle)
        low[time <= self.start[number]], high[time >= self.end[number]] = 0.0, 1.0
        low[time >= self.end[number]], high[time <= self.start[number]] = 1.0, 0.0
        return 0.5 * (low + high)
