"""Nonsmooth systems and their complementarity form."""

from fesd_robot.dcs.heaviside import ABOVE, BELOW, heaviside
from fesd_robot.dcs.model import Model
from fesd_robot.dcs.regions import heaviside_from_regions
from fesd_robot.dcs.step_functions import StepFunctions
from fesd_robot.dcs.stewart import stewart
from fesd_robot.dcs.subsystem import Subsystem
from fesd_robot.dcs.system import ComplementaritySystem

__all__ = [
    "ABOVE",
    "BELOW",
    "ComplementaritySystem",
    "Model",
    "StepFunctions",
    "Subsystem",
    "heaviside",
    "heaviside_from_regions",
    "stewart",
]
