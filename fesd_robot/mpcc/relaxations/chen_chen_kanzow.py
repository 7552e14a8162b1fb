"""Chen, Chen and Kanzow: Fischer-Burmeister and the product, in equal parts."""

from __future__ import annotations

import casadi as ca

from fesd_robot.mpcc.relaxations.fischer_burmeister import norm_against_sum
from fesd_robot.mpcc.relaxations.relaxation import Relaxation
from fesd_robot.mpcc.relaxations.scholtes import product

PART = 0.5
"""Weight of the Fischer-Burmeister function."""


def penalized_fischer_burmeister(a: ca.SX, b: ca.SX, sigma: ca.SX) -> ca.SX:
    """Return (a + b - sqrt(a² + b² + 2 sigma)) / 2 + (a b - sigma) / 2.

    Source: Chen, Chen, Kanzow, Math. Program. 88 (2000); smoothed as in Nurkanovic, Pozharskiy, Diehl,
    arXiv 2312.11022.
    """
    return PART * norm_against_sum(a, b, sigma) + (1 - PART) * product(a, b, sigma)


chen_chen_kanzow = Relaxation("chen_chen_kanzow", penalized_fischer_burmeister, vanishing=True)
"""(a + b - sqrt(a² + b² + 2 sigma)) / 2 + (a b - sigma) / 2 <= 0."""
