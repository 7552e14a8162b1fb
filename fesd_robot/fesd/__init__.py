"""Finite elements with switch detection: schemes, discretisation of optimal control problems, simulation."""

from fesd_robot.fesd.added_rows import AddedRows, BoundBetween
from fesd_robot.fesd.constraints import TrajectoryConstraint
from fesd_robot.fesd.grid import ControlGrid, Span
from fesd_robot.fesd.grid_rows import PHASE, SHORTEST_PHASE
from fesd_robot.fesd.interval import EQUILIBRATION
from fesd_robot.fesd.neighbours.room import at_stages
from fesd_robot.fesd.ocp import Clock, OptimalControlProblem, RelaxedCost, initial_value_problem
from fesd_robot.fesd.options import CrossComplementarity, FesdOptions, Form, StepEquilibration
from fesd_robot.fesd.path_between import PathBetween
from fesd_robot.fesd.refinement import with_stages
from fesd_robot.fesd.refinement.between_stages import STRICTER
from fesd_robot.fesd.sensitivity import end_sensitivity
from fesd_robot.fesd.simulate import simulate
from fesd_robot.fesd.simulation import Note, Phase, Sensitivity, Simulation, SimulationError, StepReport
from fesd_robot.fesd.stepper import SimulationSettings
from fesd_robot.fesd.tableau import Scheme, Tableau, make_tableau
from fesd_robot.fesd.trajectory import Element
from fesd_robot.fesd.transcription import Transcription

__all__ = [
    "EQUILIBRATION",
    "PHASE",
    "SHORTEST_PHASE",
    "STRICTER",
    "AddedRows",
    "BoundBetween",
    "Clock",
    "ControlGrid",
    "CrossComplementarity",
    "Element",
    "FesdOptions",
    "Form",
    "Note",
    "OptimalControlProblem",
    "PathBetween",
    "Phase",
    "RelaxedCost",
    "Scheme",
    "Sensitivity",
    "Simulation",
    "SimulationError",
    "SimulationSettings",
    "Span",
    "StepEquilibration",
    "StepReport",
    "Tableau",
    "TrajectoryConstraint",
    "Transcription",
    "at_stages",
    "end_sensitivity",
    "initial_value_problem",
    "make_tableau",
    "simulate",
    "with_stages",
]
