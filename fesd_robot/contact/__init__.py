"""Contact between a robot and the ground or itself, with a clock that stops during impacts."""

from fesd_robot.contact.boxes import circle_box_contact
from fesd_robot.contact.build import contact_system
from fesd_robot.contact.circles import circle_contact, two_circles_contact
from fesd_robot.contact.compliance import CompliantContact
from fesd_robot.contact.geometry import (
    CircleOnBox,
    CircleOnCircle,
    CircleOnSurface,
    ContactGeometry,
    PointOnSurface,
    Scene,
    TwoBodies,
    contact_of,
    frames_of,
    needs_space,
    out_of_plane,
)
from fesd_robot.contact.ground import Ground, Plane, Profile, Surface, Terrain, Wall
from fesd_robot.contact.kinds import FRICTION_AFTER_IMPACT
from fesd_robot.contact.model import Contact, ContactOptions, ContactSystem, MultibodyDynamics, StepOptions
from fesd_robot.contact.modes import (
    ContactMode,
    Modes,
    acting_impulses,
    acting_sets,
    contact_modes,
    factors_of,
    joint_modes,
    modes_of,
    names_of_modes,
)
from fesd_robot.contact.points import leaves_plane, point_contact
from fesd_robot.contact.two_in_space import Facing, axes_about, ball_box_contact, two_balls_contact

__all__ = [
    "FRICTION_AFTER_IMPACT",
    "CircleOnBox",
    "CircleOnCircle",
    "CircleOnSurface",
    "CompliantContact",
    "Contact",
    "ContactGeometry",
    "ContactMode",
    "ContactOptions",
    "ContactSystem",
    "Facing",
    "Ground",
    "Modes",
    "MultibodyDynamics",
    "Plane",
    "PointOnSurface",
    "Profile",
    "Scene",
    "StepOptions",
    "Surface",
    "Terrain",
    "TwoBodies",
    "Wall",
    "acting_impulses",
    "acting_sets",
    "axes_about",
    "ball_box_contact",
    "circle_box_contact",
    "circle_contact",
    "contact_modes",
    "contact_of",
    "contact_system",
    "factors_of",
    "frames_of",
    "joint_modes",
    "leaves_plane",
    "modes_of",
    "names_of_modes",
    "needs_space",
    "out_of_plane",
    "point_contact",
    "two_balls_contact",
    "two_circles_contact",
]
