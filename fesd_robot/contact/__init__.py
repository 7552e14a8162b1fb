"""Contact between points of a robot and the ground, with a clock that stops during impacts."""

from fesd_robot.contact.build import contact_system
from fesd_robot.contact.ground import Ground, Plane
from fesd_robot.contact.model import ContactOptions, ContactSystem, Mechanics, PlanarContact
from fesd_robot.contact.points import point_contact
from fesd_robot.contact.recover import ImpactRecord, PhysicalMotion, recover
from fesd_robot.contact.switches import SwitchRecord

__all__ = [
    "ContactOptions",
    "ContactSystem",
    "Ground",
    "ImpactRecord",
    "Mechanics",
    "PhysicalMotion",
    "PlanarContact",
    "Plane",
    "SwitchRecord",
    "contact_system",
    "point_contact",
    "recover",
]
