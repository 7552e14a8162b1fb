"""Fischer and Burmeister: the smoothed norm of the pair against its sum."""

from __future__ import annotations

import casadi as ca

from fesd_robot.mpcc.relaxations.relaxation import Relaxation


def norm_against_sum(a: ca.SX, b: ca.SX, sigma: ca.SX) -> ca.SX:
    """Return a + b - sqrt(a² + b² + 2 sigma), which has the sign of a b - sigma where a + b > 0.

    Source: Fischer, Optimization 24 (1992); smoothed by Kanzow, SIAM J. Matrix Anal. Appl. 17 (1996).
    """
    return a + b - ca.sqrt(a**2 + b**2 + 2 * sigma)


fischer_burmeister = Relaxation("fischer_burmeister", norm_against_sum, vanishing=True)
"""a + b <= sqrt(a² + b² + 2 sigma)."""

fischer_burmeister_equality = Relaxation("fischer_burmeister_equality", norm_against_sum, equality=True)
"""a + b = sqrt(a² + b² + 2 sigma)."""
