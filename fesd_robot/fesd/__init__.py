"""Finite elements with switch detection: schemes, discretisation of optimal control problems, simulation."""

from fesd_robot.fesd.ocp import OptimalControlProblem
from fesd_robot.fesd.options import CrossComplementarity, FesdOptions
from fesd_robot.fesd.simulate import Simulation, SimulationError, simulate
from fesd_robot.fesd.tableau import Tableau, make_tableau
from fesd_robot.fesd.transcription import Element, Transcription

__all__ = [
    "CrossComplementarity",
    "Element",
    "FesdOptions",
    "OptimalControlProblem",
    "Simulation",
    "SimulationError",
    "Tableau",
    "Transcription",
    "make_tableau",
    "simulate",
]
