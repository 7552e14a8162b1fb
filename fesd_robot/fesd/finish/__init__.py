"""From a nearly complementary trajectory to an exact one: read what vanishes where, solve the smooth problem."""

from fesd_robot.fesd.finish.alternatives import Alternative, Alternatives, Choice, alternatives_of
from fesd_robot.fesd.finish.reading import Structure, read_structure
from fesd_robot.fesd.finish.smooth import SmoothTranscription

__all__ = [
    "Alternative",
    "Alternatives",
    "Choice",
    "SmoothTranscription",
    "Structure",
    "alternatives_of",
    "read_structure",
]
