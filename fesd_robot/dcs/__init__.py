"""Nonsmooth systems and their complementarity form."""

from fesd_robot.dcs.heaviside import heaviside
from fesd_robot.dcs.system import ComplementaritySystem, Exclusion

__all__ = ["ComplementaritySystem", "Exclusion", "heaviside"]
