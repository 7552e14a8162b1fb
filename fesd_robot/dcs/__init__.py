"""Nonsmooth systems and their complementarity form."""

from fesd_robot.dcs.heaviside import ABOVE, BELOW, heaviside
from fesd_robot.dcs.jump import Impulse, Jump
from fesd_robot.dcs.lagrangian import Mechanism, UnilateralContact, state_of, with_contacts
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
    "Impulse",
    "Jump",
    "Mechanism",
    "Model",
    "StepFunctions",
    "Subsystem",
    "UnilateralContact",
    "heaviside",
    "heaviside_from_regions",
    "state_of",
    "stewart",
    "with_contacts",
]
