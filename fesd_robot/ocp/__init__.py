"""From a task in names to an optimal control problem in vectors."""

from fesd_robot.ocp.actuation import Actuation
from fesd_robot.ocp.motion import MotionProblem, formulate
from fesd_robot.ocp.robot import load_task_robot

__all__ = ["Actuation", "MotionProblem", "formulate", "load_task_robot"]
