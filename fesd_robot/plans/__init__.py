"""The result: a checked trajectory in physical time, its files and its report."""

from fesd_robot.errors import PlanFileError
from fesd_robot.plans.exports import EXPORTS, export
from fesd_robot.plans.exports.joint_trajectory import joint_trajectory
from fesd_robot.plans.files import check_output_folder, read_plan, write_plan
from fesd_robot.plans.origin import task_of, task_to_improve, task_to_refine
from fesd_robot.plans.plan import Plan
from fesd_robot.plans.report import report

__all__ = [
    "EXPORTS",
    "Plan",
    "PlanFileError",
    "check_output_folder",
    "export",
    "joint_trajectory",
    "read_plan",
    "report",
    "task_of",
    "task_to_improve",
    "task_to_refine",
    "write_plan",
]
