"""The times of events inside a step of the integrator."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from scipy.optimize import brentq

BEYOND_GAP = 1e-11
"""How far below zero a gap is at its event, m, as `watched` counts it."""

Values = Callable[[float], np.ndarray]
"""Time, s -> values."""


def first_root(
    start: float, watched: Values, crossing: Mapping[int, float], parting: Values, contacts: int
) -> tuple[float, int]:
    """Return time, s, and number of the value, of those that become negative in a step, that is first.

    The gap of a contact that lands is zero at its event, if it was above the ground: what it falls further would add up
    from bounce to bounce, and where two contacts throw each other up it keeps hops alive that would come to an end.

    Args:
        start: of the step, s.
        watched: what must stay positive: gaps and `BEYOND_GAP` first, (n_c) of them.
        crossing: number of a value -> time at which it is negative, s.
        parting: normal velocities of the contacts, m/s, (n_c).
        contacts: how many there are.
    """
    roots: dict[int, float] = {}
    for k, negative in crossing.items():
        roots[k] = crossing_time(watched, k, start, negative)
        if k < contacts:
            roots[k] = _touchdown(start, watched, roots[k], parting, k)
    first = min(roots, key=lambda k: roots[k])
    return roots[first], first


def _touchdown(start: float, watched: Values, below: float, parting: Values, k: int) -> float:
    """Return when a gap is zero, s, given a time at which it is `BEYOND_GAP` below; that time if it was never more."""
    above = start
    if parting(start)[k] > 0 > parting(below)[k]:
        above = crossing_time(parting, k, start, below)

    def gap(time: float) -> float:
        return float(watched(time)[k]) - BEYOND_GAP

    if not gap(above) > 0 > gap(below):
        return below
    return float(brentq(gap, above, below, xtol=1e-15, rtol=1e-14))


def crossing_time(values: Values, k: int, start: float, end: float) -> float:
    """Return when value k changes its sign between two times, s.

    That is an end where it has one sign: a slide that has turned since the value was positive may have made it
    negative at the start, and a step's polynomial keeps it positive at the end by a round-off.
    """

    def value(time: float) -> float:
        return float(values(time)[k])

    at_start, at_end = value(start), value(end)
    if (at_start < 0) == (at_end < 0):
        return start if at_start < 0 else end
    return float(brentq(value, start, end, xtol=1e-15, rtol=1e-14))
