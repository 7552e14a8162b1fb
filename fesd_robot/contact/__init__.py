"""Contact between a robot and the ground or itself, with a clock that stops during impacts."""

from fesd_robot.contact.build import contact_system
from fesd_robot.contact.circles import circle_contact, two_circles_contact
from fesd_robot.contact.ground import Ground, Plane, Profile, Terrain, Wall
from fesd_robot.contact.model import ContactOptions, ContactSystem, Mechanics, PlanarContact
from fesd_robot.contact.pairs import CirclePair, Pair, PointPair, Surroundings, TwoCirclesPair, pair_contact
from fesd_robot.contact.points import point_contact
from fesd_robot.contact.recover import ImpactRecord, PhysicalMotion, recover
from fesd_robot.contact.switches import SwitchRecord

__all__ = [
    "CirclePair",
    "ContactOptions",
    "ContactSystem",
    "Ground",
    "ImpactRecord",
    "Mechanics",
    "Pair",
    "PhysicalMotion",
    "PlanarContact",
    "Plane",
    "PointPair",
    "Profile",
    "Surroundings",
    "SwitchRecord",
    "Terrain",
    "TwoCirclesPair",
    "Wall",
    "circle_contact",
    "contact_system",
    "pair_contact",
    "point_contact",
    "recover",
    "two_circles_contact",
]
