"""Kanzow and Schwartz: the smaller side is at most sqrt(sigma)."""

from __future__ import annotations

import casadi as ca

from fesd_robot.mpcc.relaxations.relaxation import Relaxation


def shifted_corner(G: ca.SX, H: ca.SX, root: ca.SX) -> ca.SX:
    """Return c d where c + d >= 0, else -(c² + d²) / 2, with c = G - sqrt(sigma), d = H - sqrt(sigma).

    Source: Kanzow and Schwartz, SIAM J. Optim. 23 (2013).
    """
    c, d = G - root, H - root
    return ca.if_else(c + d >= 0, c * d, -0.5 * (c**2 + d**2))


kanzow_schwartz = Relaxation("kanzow_schwartz", shifted_corner, power=2, vanishing=True, bounds_product=False)
"""min(G, H) <= sqrt(sigma)."""
