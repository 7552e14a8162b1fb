"""Exact solution of the sliding-mode problem for given controls: q' = v - sign(phi(q)), v' = gain u.

Both switching functions are crossed, followed or left on their own, so that an arc has one mode of each: 1 or -1, the
side it runs on, or 0 while it slides along phi_i = 0. Controls are constant on an interval, so every arc is polynomial
in time, and it ends at the first sign change of another polynomial: phi_i outside, 1 - s_i or 1 + s_i while sliding,
where s_i is the value of -1 <= sign(0) <= 1 that keeps phi_i at zero. Nothing here knows of finite elements.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
from numpy.polynomial import Polynomial
from scipy.optimize import brentq

CURVATURES = (0.15, 0.05)
"""phi_1 = q1 + 0.15 q2^2, phi_2 = q2 - 0.05 q1^3."""
ZERO = 1e-10
"""A Taylor coefficient this small counts as zero where it decides in which mode an arc goes on."""
MOST_ARCS = 50
"""More arcs in one control interval would be chattering, which this system does not do."""

Mode = tuple[int, int]
Pair = tuple[Polynomial, Polynomial]


@dataclass(frozen=True)
class Arc:
    """The motion in one mode as polynomials in the time since it began.

    Attributes:
        mode: of phi_1 and phi_2.
        q: positions.
        margins: nonnegative as long as the mode lasts.
        ends: index of the switching function that each margin belongs to.
    """

    mode: Mode
    q: Pair
    margins: list[Polynomial]
    ends: list[int]

    @property
    def lasts(self) -> bool:
        """Whether the mode is right just after the arc's begin."""
        return all(_leading(margin) >= 0 for margin in self.margins)

    def end(self, longest: float) -> tuple[float, int | None]:
        """Return when the arc ends, and the index of the switching function that ends it, if any does."""
        events = [(_first_negative(margin, longest), i) for margin, i in zip(self.margins, self.ends, strict=True)]
        time, index = min(events, key=lambda event: event[0])
        return (time, index) if time < longest else (longest, None)


@dataclass(frozen=True)
class Replay:
    """What given controls do.

    Attributes:
        end: q(T), (2).
        times: switch times.
        modes: mode of every arc, one more than switch times.
    """

    end: np.ndarray
    times: list[float]
    modes: list[Mode]


def replay(position: np.ndarray, controls: np.ndarray, duration: float, gain: float) -> Replay:
    """Return the Filippov solution from rest.

    Args:
        position: q(0), (2).
        controls: u, constant on equal intervals, (2, N).
        duration: T.
        gain: of the controls.

    Raises:
        ArithmeticError: no mode goes on from a point, both functions vanish off the origin, or an interval has too
            many arcs.
    """
    length = duration / controls.shape[1]
    q, v, zero = np.array(position, dtype=float), np.zeros(2), (False, False)
    times, modes = list[float](), list[Mode]()
    for k, u in enumerate(controls.T):
        elapsed = 0.0
        for _ in range(MOST_ARCS):
            velocity = (Polynomial([v[0], gain * u[0]]), Polynomial([v[1], gain * u[1]]))
            arc = _next_arc(q, velocity, zero)
            if modes and modes[-1] != arc.mode:
                times.append(k * length + elapsed)
            if not modes or modes[-1] != arc.mode:
                modes.append(arc.mode)
            span, ended = arc.end(length - elapsed)
            q, v = (np.array([part(span) for part in parts]) for parts in (arc.q, velocity))
            zero = (arc.mode[0] == 0 or ended == 0, arc.mode[1] == 0 or ended == 1)
            elapsed += span
            if ended is None:
                break
        else:
            raise ArithmeticError(f"more than {MOST_ARCS} arcs in control interval {k}")
    return Replay(q, times, modes)


def _next_arc(q: np.ndarray, velocity: Pair, zero: tuple[bool, bool]) -> Arc:
    """Return the arc that goes on from q; `zero` says which switching functions vanish there.

    d(phi)/dt falls with s, its Jacobian is a P-matrix near the origin, so exactly one mode lasts. A mode at whose limit
    the next one begins lasts as well if nothing changes in between: sliding comes first.
    """
    values = _switching((Polynomial([q[0]]), Polynomial([q[1]])))
    choices = [(0, 1, -1) if at else (int(np.sign(value(0.0))),) for at, value in zip(zero, values, strict=True)]
    for first, second in product(*choices):
        arc = _arc(q, velocity, (first, second), zero)
        if arc.lasts:
            return arc
    raise ArithmeticError(f"no mode goes on from q = {q}, velocity {velocity[0](0.0)}, {velocity[1](0.0)}")


def _arc(q: np.ndarray, velocity: Pair, mode: Mode, zero: tuple[bool, bool]) -> Arc:
    """Return the motion from q in a mode."""
    (a, b), (v1, v2) = CURVATURES, velocity
    free = [Polynomial([q[i]]) + (velocity[i] - mode[i]).integ() for i in (0, 1)]
    s = [Polynomial([float(mode[0])]), Polynomial([float(mode[1])])]
    if mode == (0, 0):
        if np.abs(q).max() > 1e-6:
            raise ArithmeticError(f"both switching functions vanish at q = {q}, expected at the origin only")
        path, s = (Polynomial([0.0]), Polynomial([0.0])), [v1, v2]
    elif mode[1] == 0:
        path = (free[0], b * free[0] ** 3)
        s[1] = v2 - 3 * b * path[0] ** 2 * (v1 - s[0])
    elif mode[0] == 0:
        path = (-a * free[1] ** 2, free[1])
        s[0] = v1 + 2 * a * path[1] * (v2 - s[1])
    else:
        path = (free[0], free[1])
    margins, ends = [], []
    for i, phi in enumerate(_switching(path)):
        if mode[i] == 0:
            margins += [1 - s[i], 1 + s[i]]
            ends += [i, i]
        else:
            margins.append(mode[i] * (phi - phi(0.0) if zero[i] else phi))
            ends.append(i)
    return Arc(mode, path, margins, ends)


def _switching(q: Pair) -> Pair:
    """phi along a path."""
    return q[0] + CURVATURES[0] * q[1] ** 2, q[1] - CURVATURES[1] * q[0] ** 3


def _leading(margin: Polynomial) -> float:
    """Return the first Taylor coefficient that is not zero."""
    large = margin.coef[np.abs(margin.coef) > ZERO]
    return float(large[0]) if large.size else 0.0


def _first_negative(margin: Polynomial, longest: float) -> float:
    """Return where a polynomial that begins nonnegative becomes negative, `longest` if it does not before.

    Between its extrema it is monotone, so that no sign change is overlooked.
    """
    large = np.flatnonzero(np.abs(margin.coef) > ZERO)
    if not large.size:
        return longest
    rest = Polynomial(margin.coef[large[0] :])
    extrema = [float(root.real) for root in rest.deriv().roots() if abs(root.imag) < 1e-6 and 0 < root.real < longest]
    for before, after in pairwise([0.0, *sorted(extrema), longest]):
        if rest(after) < 0:
            return float(brentq(rest, before, after, xtol=1e-15))
    return longest
