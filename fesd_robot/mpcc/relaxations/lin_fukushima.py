"""Lin and Fukushima: the axes between two hyperbolas, without the signs."""

from __future__ import annotations

import casadi as ca

from fesd_robot.mpcc.relaxations.relaxation import Relaxation


def between_hyperbolas(a: ca.SX, b: ca.SX, root: ca.SX) -> ca.SX:
    """Return (a b - sigma, sigma - (a + sqrt(sigma)) (b + sqrt(sigma))), two rows a pair.

    The second lets a and b be negative by at most sqrt(sigma).

    Source: Lin and Fukushima, Ann. Oper. Res. 133 (2005).
    """
    return ca.vertcat(a * b - root**2, root**2 - (a + root) * (b + root))


lin_fukushima = Relaxation("lin_fukushima", between_hyperbolas, power=2, signs=False, bounds_product=False)
"""a b <= sigma and (a + sqrt(sigma)) (b + sqrt(sigma)) >= sigma."""
