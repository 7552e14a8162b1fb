"""Kadrani, Dussault and Benchakroun: the smaller side within sqrt(sigma) of zero, without the corner."""

from __future__ import annotations

import casadi as ca

from fesd_robot.mpcc.relaxations.relaxation import Relaxation


def two_strips(G: ca.SX, H: ca.SX, root: ca.SX) -> ca.SX:
    """Return ((G - sqrt(sigma)) (H - sqrt(sigma)), -G - sqrt(sigma), -H - sqrt(sigma)), three rows a pair.

    The two strips touch in (sqrt(sigma), sqrt(sigma)) only; G = H = 0 is not in them.

    Source: Kadrani, Dussault, Benchakroun, SIAM J. Optim. 20 (2009).
    """
    return ca.vertcat((G - root) * (H - root), -G - root, -H - root)


kadrani = Relaxation("kadrani", two_strips, power=2, signs=False, bounds_product=False)
"""(G - sqrt(sigma)) (H - sqrt(sigma)) <= 0, G >= -sqrt(sigma), H >= -sqrt(sigma)."""
