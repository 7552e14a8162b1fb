"""Scholtes: the product itself."""

from __future__ import annotations

import casadi as ca

from fesd_robot.mpcc.relaxations.relaxation import Relaxation


def product(a: ca.SX, b: ca.SX, sigma: ca.SX) -> ca.SX:
    """Return a b - sigma.

    Source: Scholtes, SIAM J. Optim. 11 (2001).
    """
    return a * b - sigma


scholtes = Relaxation("scholtes", product, vanishing=True)
"""a b <= sigma."""

scholtes_equality = Relaxation("scholtes_equality", product, equality=True)
"""a b = sigma."""
