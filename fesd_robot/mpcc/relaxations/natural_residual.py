"""Natural residual: a smoothed minimum of the pair."""

from __future__ import annotations

import casadi as ca

from fesd_robot.mpcc.relaxations.relaxation import Relaxation


def smoothed_minimum(G: ca.SX, H: ca.SX, sigma: ca.SX) -> ca.SX:
    """Return (G + H - sqrt((G - H)² + 4 sigma)) / 2, which has the sign of G H - sigma where G + H > 0.

    Source: Chen and Harker, SIAM J. Matrix Anal. Appl. 14 (1993); Kanzow, ibid. 17 (1996).
    """
    return 0.5 * (G + H - ca.sqrt((G - H) ** 2 + 4 * sigma))


natural_residual = Relaxation("natural_residual", smoothed_minimum, vanishing=True)
"""(G + H - sqrt((G - H)² + 4 sigma)) / 2 <= 0."""

natural_residual_equality = Relaxation("natural_residual_equality", smoothed_minimum, equality=True)
"""(G + H - sqrt((G - H)² + 4 sigma)) / 2 = 0."""
