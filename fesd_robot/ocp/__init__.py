"""From a task in names to an optimal control problem in vectors."""

from fesd_robot.ocp.actuation import Actuation
from fesd_robot.ocp.motion import MotionProblem, formulate
from fesd_robot.ocp.robot import load_task_robot
from fesd_robot.ocp.timing import TimeGrid
from fesd_robot.ocp.transcription import transcribe

__all__ = ["Actuation", "MotionProblem", "TimeGrid", "formulate", "load_task_robot", "transcribe"]
