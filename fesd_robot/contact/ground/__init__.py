"""Surfaces in space, each a signed distance with its gradient and its tangents."""

from fesd_robot.contact.ground.height_field import MAX_POINTS, HeightField
from fesd_robot.contact.ground.heights import Grid, read_heights, read_image
from fesd_robot.contact.ground.plane import HalfSpace, Plane, TiltedPlane, facing_wall, tilted_plane
from fesd_robot.contact.ground.profile import MAX_PIECES, Profile
from fesd_robot.contact.ground.profiles import height_map, steps
from fesd_robot.contact.ground.solids import Box, Cylinder, Pose, Solid
from fesd_robot.contact.ground.surface import LATERAL, Axes, Ground, Surface
from fesd_robot.contact.ground.terrain import Terrain
from fesd_robot.contact.ground.wall import Wall

__all__ = [
    "LATERAL",
    "MAX_PIECES",
    "MAX_POINTS",
    "Axes",
    "Box",
    "Cylinder",
    "Grid",
    "Ground",
    "HalfSpace",
    "HeightField",
    "Plane",
    "Pose",
    "Profile",
    "Solid",
    "Surface",
    "Terrain",
    "TiltedPlane",
    "Wall",
    "facing_wall",
    "height_map",
    "read_heights",
    "read_image",
    "steps",
    "tilted_plane",
]
