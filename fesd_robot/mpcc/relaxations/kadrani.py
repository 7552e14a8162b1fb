"""Kadrani, Dussault and Benchakroun: the smaller side within sqrt(sigma) of zero, without the corner."""

from __future__ import annotations

import casadi as ca

from fesd_robot.mpcc.relaxations.relaxation import Relaxation


def two_strips(a: ca.SX, b: ca.SX, root: ca.SX) -> ca.SX:
    """Return ((a - sqrt(sigma)) (b - sqrt(sigma)), -a - sqrt(sigma), -b - sqrt(sigma)), three rows a pair.

    The two strips touch in (sqrt(sigma), sqrt(sigma)) only; a = b = 0 is not in them.

    Source: Kadrani, Dussault, Benchakroun, SIAM J. Optim. 20 (2009).
    """
    return ca.vertcat((a - root) * (b - root), -a - root, -b - root)


kadrani = Relaxation("kadrani", two_strips, power=2, signs=False, bounds_product=False)
"""(a - sqrt(sigma)) (b - sqrt(sigma)) <= 0, a >= -sqrt(sigma), b >= -sqrt(sigma)."""
