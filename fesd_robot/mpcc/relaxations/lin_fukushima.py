"""Lin and Fukushima: the axes between two hyperbolas, without the signs."""

from __future__ import annotations

import casadi as ca

from fesd_robot.mpcc.relaxations.relaxation import Relaxation


def between_hyperbolas(G: ca.SX, H: ca.SX, root: ca.SX) -> ca.SX:
    """Return (G H - sigma, sigma - (G + sqrt(sigma)) (H + sqrt(sigma))), two rows a pair.

    The second lets G and H be negative by at most sqrt(sigma).

    Source: Lin and Fukushima, Ann. Oper. Res. 133 (2005).
    """
    return ca.vertcat(G * H - root**2, root**2 - (G + root) * (H + root))


lin_fukushima = Relaxation("lin_fukushima", between_hyperbolas, power=2, signs=False, bounds_product=False)
"""G H <= sigma and (G + sqrt(sigma)) (H + sqrt(sigma)) >= sigma."""
