"""The result: a checked trajectory in physical time, its files and its report."""

from fesd_robot.plan.files import PlanFileError, check_output_folder, read_plan, write_plan
from fesd_robot.plan.plan import Plan
from fesd_robot.plan.report import report

__all__ = ["Plan", "PlanFileError", "check_output_folder", "read_plan", "report", "write_plan"]
