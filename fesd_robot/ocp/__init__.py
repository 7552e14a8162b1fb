"""From a task in names to an optimal control problem in vectors."""

from fesd_robot.ocp.actuation import Actuation
from fesd_robot.ocp.formulate import MotionProblem, formulate
from fesd_robot.ocp.promises import with_promises
from fesd_robot.ocp.task_robot import load_task_robot
from fesd_robot.ocp.timing import TimeGrid

__all__ = ["Actuation", "MotionProblem", "TimeGrid", "formulate", "load_task_robot", "with_promises"]
