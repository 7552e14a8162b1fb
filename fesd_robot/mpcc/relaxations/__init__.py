"""Relaxations of a complementarity pair, by name; each turns 0 <= G, 0 <= H, G H = 0 into smooth rows with a sigma.

Compared with each other by Hoheisel, Kanzow, Schwartz, Math. Program. 137 (2013), and, with ways of steering sigma, by
Nurkanovic, Pozharskiy, Diehl, arXiv 2312.11022.
"""

from __future__ import annotations

from fesd_robot.errors import OptionError, nearest
from fesd_robot.mpcc.relaxations.chen_chen_kanzow import chen_chen_kanzow
from fesd_robot.mpcc.relaxations.fischer_burmeister import fischer_burmeister, fischer_burmeister_equality
from fesd_robot.mpcc.relaxations.kadrani import kadrani
from fesd_robot.mpcc.relaxations.kanzow_schwartz import kanzow_schwartz
from fesd_robot.mpcc.relaxations.lin_fukushima import lin_fukushima
from fesd_robot.mpcc.relaxations.natural_residual import natural_residual, natural_residual_equality
from fesd_robot.mpcc.relaxations.relaxation import Relaxation
from fesd_robot.mpcc.relaxations.scholtes import scholtes, scholtes_equality
from fesd_robot.mpcc.relaxations.steffensen_ulbrich_polynomial import steffensen_ulbrich_polynomial
from fesd_robot.mpcc.relaxations.steffensen_ulbrich_sine import steffensen_ulbrich_sine

__all__ = ["RELAXATIONS", "Relaxation", "relaxation_named", "scholtes"]

RELAXATIONS = {
    relaxation.name: relaxation
    for relaxation in (
        scholtes,
        scholtes_equality,
        fischer_burmeister,
        fischer_burmeister_equality,
        natural_residual,
        natural_residual_equality,
        chen_chen_kanzow,
        steffensen_ulbrich_sine,
        steffensen_ulbrich_polynomial,
        kanzow_schwartz,
        lin_fukushima,
        kadrani,
    )
}
"""Every relaxation by its name."""


def relaxation_named(name: str) -> Relaxation:
    """Return the relaxation of that name.

    Raises:
        OptionError: there is none; the message has the nearest one.
    """
    if name not in RELAXATIONS:
        raise OptionError(f"unknown relaxation '{name}'{nearest(name, RELAXATIONS)}")
    return RELAXATIONS[name]
