"""Polishing: from a nearly complementary trajectory to an exact one, by the smooth problem on its branch."""

from fesd_robot.fesd.polishing.around import problem_around
from fesd_robot.fesd.polishing.branch_motion import BranchMotion
from fesd_robot.fesd.polishing.conditions import ConditionFactors, ElementConditions, conditions_of
from fesd_robot.fesd.polishing.jumps import with_impulses, without_impulses
from fesd_robot.fesd.polishing.one_branch import OneBranch
from fesd_robot.fesd.polishing.reading import read_branch
from fesd_robot.fesd.polishing.transcription import BranchTranscription

__all__ = [
    "BranchMotion",
    "BranchTranscription",
    "ConditionFactors",
    "ElementConditions",
    "OneBranch",
    "conditions_of",
    "problem_around",
    "read_branch",
    "with_impulses",
    "without_impulses",
]
