"""Optimal control of systems with switches, without robots: starts, exact switches, moves between branches, descent."""

from fesd_robot.optimal_control.end_time import EndTime
from fesd_robot.optimal_control.optimize import optimize
from fesd_robot.optimal_control.settings import OptimalControlSettings
from fesd_robot.optimal_control.solution import OptimalControlSolution, StartReport

__all__ = ["EndTime", "OptimalControlSettings", "OptimalControlSolution", "StartReport", "optimize"]
