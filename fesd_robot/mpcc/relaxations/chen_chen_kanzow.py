"""Chen, Chen and Kanzow: Fischer-Burmeister and the product, in equal parts."""

from __future__ import annotations

import casadi as ca

from fesd_robot.mpcc.relaxations.fischer_burmeister import norm_against_sum
from fesd_robot.mpcc.relaxations.relaxation import Relaxation
from fesd_robot.mpcc.relaxations.scholtes import product

FISCHER_BURMEISTER_WEIGHT = 0.5
"""Weight of the Fischer-Burmeister function."""


def penalized_fischer_burmeister(G: ca.SX, H: ca.SX, sigma: ca.SX) -> ca.SX:
    """Return (G + H - sqrt(G² + H² + 2 sigma)) / 2 + (G H - sigma) / 2.

    Source: Chen, Chen, Kanzow, Math. Program. 88 (2000); smoothed as in Nurkanovic, Pozharskiy, Diehl,
    arXiv 2312.11022.
    """
    weight = FISCHER_BURMEISTER_WEIGHT
    return weight * norm_against_sum(G, H, sigma) + (1 - weight) * product(G, H, sigma)


chen_chen_kanzow = Relaxation("chen_chen_kanzow", penalized_fischer_burmeister, vanishing=True)
"""(G + H - sqrt(G² + H² + 2 sigma)) / 2 + (G H - sigma) / 2 <= 0."""
