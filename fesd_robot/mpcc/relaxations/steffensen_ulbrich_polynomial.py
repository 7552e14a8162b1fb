"""Steffensen and Ulbrich with a polynomial: exact complementarity away from the corner."""

from __future__ import annotations

import casadi as ca

from fesd_robot.mpcc.relaxations.relaxation import Relaxation


def rounded_corner(G: ca.SX, H: ca.SX, root: ca.SX) -> ca.SX:
    """Return G + H - |d| for d = G - H; where |d| < t, a polynomial replaces |d|.

    The polynomial is t (3 + 6 (d/t)² - (d/t)⁴) / 8 with t = 16/3 sqrt(sigma); both meet with two equal derivatives.

    Source: Steffensen and Ulbrich, SIAM J. Optim. 20 (2010).
    """
    width = 16 / 3 * root
    difference = G - H
    ratio = difference / width
    polynomial = width * (3 + 6 * ratio**2 - ratio**4) / 8
    return G + H - ca.if_else(ca.fabs(difference) >= width, ca.fabs(difference), polynomial)


steffensen_ulbrich_polynomial = Relaxation("steffensen_ulbrich_polynomial", rounded_corner, power=2, vanishing=True)
"""G + H - |G - H| <= 0 with the corner rounded by a polynomial."""
