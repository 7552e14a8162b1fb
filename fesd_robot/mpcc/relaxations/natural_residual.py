"""Natural residual: a smoothed minimum of the pair."""

from __future__ import annotations

import casadi as ca

from fesd_robot.mpcc.relaxations.relaxation import Relaxation


def smoothed_minimum(a: ca.SX, b: ca.SX, sigma: ca.SX) -> ca.SX:
    """Return (a + b - sqrt((a - b)² + 4 sigma)) / 2, which has the sign of a b - sigma where a + b > 0.

    Source: Chen and Harker, SIAM J. Matrix Anal. Appl. 14 (1993); Kanzow, ibid. 17 (1996).
    """
    return 0.5 * (a + b - ca.sqrt((a - b) ** 2 + 4 * sigma))


natural_residual = Relaxation("natural_residual", smoothed_minimum, vanishing=True)
"""(a + b - sqrt((a - b)² + 4 sigma)) / 2 <= 0."""

natural_residual_equality = Relaxation("natural_residual_equality", smoothed_minimum, equality=True)
"""(a + b - sqrt((a - b)² + 4 sigma)) / 2 = 0."""
