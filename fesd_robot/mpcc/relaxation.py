"""Relaxations of a complementarity pair; each turns 0 <= a, 0 <= b, a b = 0 into smooth rows with a parameter sigma."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca

Relaxation = Callable[[ca.SX, ca.SX, ca.SX], ca.SX]
"""(a, b, sigma) -> r, to be held at r <= 0 together with a, b >= 0."""


def scholtes(a: ca.SX, b: ca.SX, sigma: ca.SX) -> ca.SX:
    """Return a b - sigma, the inequality relaxation of Scholtes (SIAM J. Optim. 11, 2001)."""
    return a * b - sigma
