"""Units of a robot's coordinates, read off the kind of each joint."""

from __future__ import annotations

from fesd_robot.orientations import deviation_names
from fesd_robot.robot.joints import Prismatic
from fesd_robot.robot.robot import Robot

STANDARD_GRAVITY = 9.81
"""m/s2; what a weight is measured with where the world of a model has another gravity, or none along it."""

_LENGTHS = (".x", ".y", ".z", ".vx", ".vy", ".vz")


def configuration_units(robot: Robot) -> dict[str, str]:
    """Return name -> ``m``, ``rad`` or ``1`` (cosines, sines, quaternion components), in the order of q."""
    units = dict.fromkeys(robot.configuration_names, "")
    for link in robot.tree.links:
        if not link.mimics:
            for entry, suffix in enumerate(link.joint.position_suffixes):
                is_length = suffix in _LENGTHS or isinstance(link.joint, Prismatic)
                is_unit = entry in link.joint.unit_entries
                units[link.name + suffix] = "1" if is_unit else "m" if is_length else "rad"
    return units


def deviation_units(robot: Robot) -> dict[str, str]:
    """Return name -> unit of every entry of a deviation: ``rad`` for roll, pitch and yaw of an orientation."""
    units = configuration_units(robot)
    return {name: units.get(name, "rad") for name in deviation_names(units)}


def velocity_units(robot: Robot) -> dict[str, str]:
    """Return name -> ``m/s`` or ``rad/s``, in the order of v."""
    units = dict.fromkeys(robot.velocity_names, "")
    for link in robot.tree.links:
        if not link.mimics:
            for suffix in link.joint.velocity_suffixes:
                is_length = suffix in _LENGTHS or isinstance(link.joint, Prismatic)
                units[link.name + suffix] = "m/s" if is_length else "rad/s"
    return units
