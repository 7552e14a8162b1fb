"""Nonsmooth systems and their complementarity form."""

from fesd_robot.dcs.heaviside import ABOVE, BELOW, heaviside
from fesd_robot.dcs.jump import ABOVE_LAW, IMPACT_LAW, Impulse, Jump
from fesd_robot.dcs.lagrangian import (
    BACKWARDS,
    FORCE_AT_A_DISTANCE,
    FORWARDS,
    FRICTION_ALONG_SLIDING,
    SLIPPING,
    Mechanism,
    UnilateralContact,
    state_of,
    with_contacts,
)
from fesd_robot.dcs.model import OMITTED, Model
from fesd_robot.dcs.regions import heaviside_from_regions
from fesd_robot.dcs.step_functions import StepFunctions
from fesd_robot.dcs.stewart import stewart
from fesd_robot.dcs.subsystem import Subsystem
from fesd_robot.dcs.system import ComplementaritySystem

__all__ = [
    "ABOVE",
    "ABOVE_LAW",
    "BACKWARDS",
    "BELOW",
    "FORCE_AT_A_DISTANCE",
    "FORWARDS",
    "FRICTION_ALONG_SLIDING",
    "IMPACT_LAW",
    "OMITTED",
    "SLIPPING",
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
