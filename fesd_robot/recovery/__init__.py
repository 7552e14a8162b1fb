"""The way back: from finite elements in numerical time to motion in physical time, and its physics in numbers."""

from fesd_robot.recovery.between import DenseSamples
from fesd_robot.recovery.motion import JointFriction, PhysicalMotion, recover
from fesd_robot.recovery.samples import ImpactRecord
from fesd_robot.recovery.switches import SwitchRecord

__all__ = ["DenseSamples", "ImpactRecord", "JointFriction", "PhysicalMotion", "SwitchRecord", "recover"]
