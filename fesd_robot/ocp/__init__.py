"""From a task in names to an optimal control problem in vectors."""

from fesd_robot.ocp.actuation import Actuation
from fesd_robot.ocp.motion import MotionProblem, formulate

__all__ = ["Actuation", "MotionProblem", "formulate"]
