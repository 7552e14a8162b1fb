"""The reference as a smooth function of the clock, for a control grid whose nodes move along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.interpolate import CubicHermiteSpline

from fesd_robot.ocp.reference_motion import DIFFERENCE_STEP, ReferenceMotion
from fesd_robot.orientations import quaternion_entries, unit_entries
from fesd_robot.robot import continuous_quaternions

WINDOW = 16
"""Pieces of the spline that an interval knows. Where there are more, those around the time at which it is when a solve
begins; times that leave them are seen, and it is solved again."""

FAR_AWAY = 1.0
"""s; length of the pieces that fill the window of a reference with fewer, behind its end, where nothing moves."""


@dataclass(frozen=True)
class ReferenceSpline:
    """The cubic spline of a reference by its values and slopes at its knots, before and after which it holds still.

        q(t) = q_0 + sum_k P_k(min(max(0, t - t_k), t_{k+1} - t_k)),   P_k(0) = 0

    A sum of pieces keeps its digits, and its slope has no jump where a time crosses a knot: a kink of the reference
    there would keep an interior-point method from converging. Orientations are unit quaternions.

    Attributes:
        names: of the coordinates of q, (n_q).
        knots: times between its pieces, s, (m + 1) with m >= WINDOW.
        starts: q where every piece begins, (m, n_q).
        coefficients: of the pieces, of s, s^2 and s^3, (m, 3, n_q).
    """

    names: Sequence[str]
    knots: np.ndarray
    starts: np.ndarray
    coefficients: np.ndarray

    @classmethod
    def of(cls, reference: ReferenceMotion, names: Sequence[str]) -> ReferenceSpline:
        """Return the spline of a reference."""
        knots = np.asarray(reference.knots, dtype=float)
        step = DIFFERENCE_STEP * knots[-1]
        times = np.clip(np.add.outer(knots, (-step, 0.0, step)), 0.0, knots[-1])
        near = np.array([[reference.configuration(float(at)) for at in around] for around in times])
        for at in quaternion_entries(names).values():
            rows = near[..., at]
            near[..., at] = continuous_quaternions(rows.reshape(-1, 4)).reshape(rows.shape)
        values = near[:, 1]
        slopes = (near[:, 2] - near[:, 0]) / (times[:, 2] - times[:, 0])[:, None]
        pieces = np.moveaxis(CubicHermiteSpline(knots, values, slopes).c[2::-1], 0, 1)
        return cls.of_pieces(names, knots, values[:-1], pieces, values[-1])

    @classmethod
    def of_pieces(
        cls, names: Sequence[str], knots: np.ndarray, starts: np.ndarray, coefficients: np.ndarray, end: np.ndarray
    ) -> ReferenceSpline:
        """Return the spline of any number of pieces, which stands still behind them.

        Args:
            names, knots, starts, coefficients: as of the spline.
            end: q at the last knot, (n_q).
        """
        missing = max(WINDOW - len(coefficients), 0)
        return cls(
            names,
            np.append(knots, knots[-1] + FAR_AWAY * np.arange(1, missing + 1)),
            np.vstack([starts, np.tile(end, (missing, 1))]),
            np.concatenate([coefficients, np.zeros((missing, *coefficients.shape[1:]))]),
        )

    def window(self, time: float) -> int:
        """Return the number of the first piece of the window around a time, s."""
        middle = int(np.searchsorted(self.knots, time)) - 1
        return int(np.clip(middle - WINDOW // 2, 0, len(self.starts) - WINDOW))

    def covers(self, around: float, time: float) -> bool:
        """Return whether the window around a time has the reference at another time, s."""
        first = self.window(around)
        begins, ends = first == 0, first + WINDOW == len(self.starts)
        return (begins or time >= self.knots[first]) and (ends or time <= self.knots[first + WINDOW])

    def parameters(self, time: float) -> np.ndarray:
        """Return the window around a time as parameters, (`window_size`): knots, q at the first of them, pieces."""
        first = self.window(time)
        own = self.coefficients[first : first + WINDOW]
        return np.concatenate([self.knots[first : first + WINDOW + 1], self.starts[first], own.ravel()])

    def expression(self, parameters: ca.SX, time: ca.SX) -> ca.SX:
        """Return q(t) of a window.

        Args:
            parameters: SX symbols of a window.
            time: t, s, SX scalar.

        Returns:
            SX (n_q).
        """
        n_q = len(self.names)
        knots, q, pieces = ca.vertsplit(parameters, [0, WINDOW + 1, WINDOW + 1 + n_q, parameters.numel()])
        q, pieces = ca.SX(q), ca.reshape(pieces, n_q, 3 * WINDOW)
        for k in range(WINDOW):
            s = ca.fmin(ca.fmax(0, time - knots[k]), knots[k + 1] - knots[k])
            slope, square, cubic = (pieces[:, 3 * k + power] for power in range(3))
            q += s * (slope + s * (square + s * cubic))
        for at in unit_entries(self.names):
            q[at] = q[at] / ca.norm_2(q[at])
        return q


def window_size(coordinates: int) -> int:
    """Return the number of parameters of a window, given that of the coordinates."""
    return WINDOW + 1 + coordinates * (1 + 3 * WINDOW)
