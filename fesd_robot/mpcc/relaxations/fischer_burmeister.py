"""Fischer and Burmeister: the smoothed norm of the pair against its sum."""

from __future__ import annotations

import casadi as ca

from fesd_robot.mpcc.relaxations.relaxation import Relaxation


def norm_against_sum(G: ca.SX, H: ca.SX, sigma: ca.SX) -> ca.SX:
    """Return G + H - sqrt(G² + H² + 2 sigma), which has the sign of G H - sigma where G + H > 0.

    Source: Fischer, Optimization 24 (1992); smoothed by Kanzow, SIAM J. Matrix Anal. Appl. 17 (1996).
    """
    return G + H - ca.sqrt(G**2 + H**2 + 2 * sigma)


fischer_burmeister = Relaxation("fischer_burmeister", norm_against_sum, vanishing=True)
"""G + H <= sqrt(G² + H² + 2 sigma)."""

fischer_burmeister_equality = Relaxation("fischer_burmeister_equality", norm_against_sum, equality=True)
"""G + H = sqrt(G² + H² + 2 sigma)."""
