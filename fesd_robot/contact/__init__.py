"""Contact between points of a robot and the ground, as set-valued step functions."""

from fesd_robot.contact.ground import Ground, Plane
from fesd_robot.contact.points import point_contact
from fesd_robot.contact.recover import ImpactRecord, PhysicalMotion, recover
from fesd_robot.contact.steps import Mechanics, PlanarContact, StepContactSystem, StepOptions, step_contact_system
from fesd_robot.contact.switches import SwitchRecord

__all__ = [
    "Ground",
    "ImpactRecord",
    "Mechanics",
    "PhysicalMotion",
    "PlanarContact",
    "Plane",
    "StepContactSystem",
    "StepOptions",
    "SwitchRecord",
    "point_contact",
    "recover",
    "step_contact_system",
]
