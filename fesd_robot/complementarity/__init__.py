"""One type for a complementarity condition, its structured label, and the branch that says which factor vanishes."""

from fesd_robot.complementarity.branch import ActiveFactor, Branch
from fesd_robot.complementarity.condition import Complementarity, HeldAt, Level
from fesd_robot.complementarity.labels import NOWHERE, Label, LateLabels, Place

__all__ = ["NOWHERE", "ActiveFactor", "Branch", "Complementarity", "HeldAt", "Label", "LateLabels", "Level", "Place"]
