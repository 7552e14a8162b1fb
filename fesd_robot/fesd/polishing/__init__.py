"""From a nearly complementary trajectory to an exact one: read what vanishes where, solve the smooth problem."""

from fesd_robot.fesd.polishing.conditions import Alternative, Alternatives, Choice, alternatives_of
from fesd_robot.fesd.polishing.reading import Structure, read_structure
from fesd_robot.fesd.polishing.transcription import BranchTranscription

__all__ = [
    "Alternative",
    "Alternatives",
    "BranchTranscription",
    "Choice",
    "Structure",
    "alternatives_of",
    "read_structure",
]
