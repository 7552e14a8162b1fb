"""Refinement of an exact trajectory on its branch: its local errors, more stages, elements in parts, more bounds."""

from fesd_robot.fesd.refinement.between_stages import Violated, violated_between_stages, with_bounds_between
from fesd_robot.fesd.refinement.local_error import local_errors, multiplier_errors
from fesd_robot.fesd.refinement.parts import with_parts
from fesd_robot.fesd.refinement.stages import with_stages

__all__ = [
    "Violated",
    "local_errors",
    "multiplier_errors",
    "violated_between_stages",
    "with_bounds_between",
    "with_parts",
    "with_stages",
]
