"""Shapes of the ground in the x-z plane, each a signed distance with its gradient."""

from fesd_robot.contact.ground.heights import read_heights
from fesd_robot.contact.ground.plane import Plane
from fesd_robot.contact.ground.profile import MAX_PIECES, STEEPEST, Profile
from fesd_robot.contact.ground.profiles import height_map, steps
from fesd_robot.contact.ground.surface import LATERAL, Ground
from fesd_robot.contact.ground.terrain import Terrain
from fesd_robot.contact.ground.wall import Wall

__all__ = [
    "LATERAL",
    "MAX_PIECES",
    "STEEPEST",
    "Ground",
    "Plane",
    "Profile",
    "Terrain",
    "Wall",
    "height_map",
    "read_heights",
    "steps",
]
