"""From a nearly complementary trajectory to an exact one: read what vanishes where, solve the smooth problem."""

from fesd_robot.fesd.finish.conditions import Choice, Condition, Conditions, conditions_of
from fesd_robot.fesd.finish.reading import Structure, read_structure
from fesd_robot.fesd.finish.smooth import SmoothTranscription

__all__ = ["Choice", "Condition", "Conditions", "SmoothTranscription", "Structure", "conditions_of", "read_structure"]
