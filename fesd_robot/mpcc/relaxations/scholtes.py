"""Scholtes: the product itself."""

from __future__ import annotations

import casadi as ca

from fesd_robot.mpcc.relaxations.relaxation import Relaxation


def product(G: ca.SX, H: ca.SX, sigma: ca.SX) -> ca.SX:
    """Return G H - sigma.

    Source: Scholtes, SIAM J. Optim. 11 (2001).
    """
    return G * H - sigma


scholtes = Relaxation("scholtes", product, vanishing=True)
"""G H <= sigma."""

scholtes_equality = Relaxation("scholtes_equality", product, equality=True)
"""G H = sigma."""
