"""How stiff contacts are: one solref for contacts that do not bounce, one for each that does."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

TIME_STEP = 1e-4
"""s."""

BOUNCING_TIME_STEP = 5e-6
"""s; where a contact bounces, whose spring is pressed and released within a fraction of a millisecond."""

STEPS = 2.0
"""Time constant of contacts and of dry friction, in time steps; the least that MuJoCo takes."""

SLIDING_STEPS = 10.0
"""The same of the friction of contacts that slide nearly all of the time: MuJoCo's cones are convex, and a contact that
slides is pushed apart, the more the faster its friction builds up."""

DAMPING_RATIO = 50.0
"""Of contacts that do not bounce: one of 1 parts with exp(-2) of the velocity with which it hits, this one stops in a
time step."""

_SPRING = 0.05
"""rad a time step, of the spring of contacts that bounce."""


MOST_DAMPING = 9.8
"""Ratio of contacts that bounce; with 10 a single time step takes all of the velocity."""


def stiff(time_step: float) -> list[float]:
    """Return the solref of contacts without restitution: time constant, s, and damping ratio."""
    return [STEPS * time_step, DAMPING_RATIO]


def rubbing(time_step: float, *, slides: bool = False) -> list[float]:
    """Return the solref of friction: time constant, s, and damping ratio.

    Args:
        time_step: s.
        slides: whether the contact slides nearly all of the time that it touches.
    """
    return [(SLIDING_STEPS if slides else STEPS) * time_step, 1.0]


def bouncing(restitution: float, time_step: float) -> list[float]:
    """Return the solref of contacts with restitution: stiffness, 1/s², and damping, 1/s, both negative.

    A mass that presses a spring of frequency w and damping ratio z, which push only, parts with

        e = exp(-2 z acos(z) / sqrt(1 - z^2))

    of the velocity with which it comes. For MuJoCo's steps z is the one with which the mean of e over all moments of a
    time step is the restitution.

    Args:
        restitution: e, greater than 0, at most 1.
        time_step: s.
    """
    ratio = brentq(lambda z: _mean_restitution(z) - restitution, 0.0, MOST_DAMPING) if restitution < 1 else 0.0
    frequency = _SPRING / time_step
    return [-(frequency**2), -2 * ratio * frequency]


def spread(restitution: float) -> float:
    """Return by how much the restitution of single impacts differs from the mean, at most."""
    ratio = -bouncing(restitution, 1.0)[1] / (2 * _SPRING)
    return float(max(abs(_restitution(ratio, share) - restitution) for share in _SHARES))


_SHARES = np.linspace(0.05, 0.95, 10)
"""Of a time step, at which a mass may hit."""


def _mean_restitution(ratio: float) -> float:
    return float(np.mean([_restitution(ratio, share) for share in _SHARES]))


def _restitution(ratio: float, share: float) -> float:
    """Return the velocity with which a mass parts that hits with 1, by semi-implicit steps of length 1."""
    pressed, velocity = share, 1.0
    while True:
        push = _SPRING**2 * pressed + 2 * ratio * _SPRING * velocity
        if push <= 0 or pressed <= 0:
            return -velocity
        velocity -= push
        pressed += velocity
        if not math.isfinite(velocity):
            return math.nan
