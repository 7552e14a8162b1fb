"""The result: a checked trajectory in physical time, its files and its report."""

from fesd_robot.plans.files import PlanFileError, check_output_folder, read_plan, write_plan
from fesd_robot.plans.plan import Plan
from fesd_robot.plans.report import report

__all__ = ["Plan", "PlanFileError", "check_output_folder", "read_plan", "report", "write_plan"]
