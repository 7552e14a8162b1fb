"""Steffensen and Ulbrich with a sine: exact complementarity away from the corner."""

from __future__ import annotations

import casadi as ca

from fesd_robot.mpcc.relaxations.relaxation import Relaxation


def rounded_corner(G: ca.SX, H: ca.SX, root: ca.SX) -> ca.SX:
    """Return G + H - |d| for d = G - H; where |d| < t, a sine replaces |d|.

    The sine is t (1 + 2/pi sin(pi/2 d/t + 3 pi/2)) with t = 2 sqrt(sigma) / (1 - 2/pi); both meet with two equal
    derivatives.

    Source: Steffensen and Ulbrich, SIAM J. Optim. 20 (2010).
    """
    width = 2 * root / (1 - 2 / ca.pi)
    difference = G - H
    sine = width * (1 + 2 / ca.pi * ca.sin(ca.pi / 2 * difference / width + 3 * ca.pi / 2))
    return G + H - ca.if_else(ca.fabs(difference) >= width, ca.fabs(difference), sine)


steffensen_ulbrich_sine = Relaxation("steffensen_ulbrich_sine", rounded_corner, power=2, vanishing=True)
"""G + H - |G - H| <= 0 with the corner rounded by a sine."""
