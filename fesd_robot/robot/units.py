"""Units of a robot's coordinates, read off the kind of each joint."""

from __future__ import annotations

from fesd_robot.robot.robot import Robot

_ENDINGS = {
    "x": "m",
    "y": "m",
    "z": "m",
    "vx": "m/s",
    "vy": "m/s",
    "vz": "m/s",
    "wx": "rad/s",
    "wy": "rad/s",
    "wz": "rad/s",
}


def configuration_units(robot: Robot) -> dict[str, str]:
    """Return name -> ``m``, ``rad`` or ``1`` (cosines, sines, quaternion components)."""
    units = {}
    for name in robot.configuration_names:
        ending = name.rsplit(".", 1)[-1] if name not in robot.velocity_names else ""
        units[name] = _ENDINGS.get(ending, "1") if ending else ("m" if _slides(robot, name) else "rad")
    return units


def velocity_units(robot: Robot) -> dict[str, str]:
    """Return name -> ``m/s`` or ``rad/s``."""
    joints = set(robot.model.names)
    return {
        name: ("m/s" if _slides(robot, name) else "rad/s") if name in joints else _ENDINGS[name.rsplit(".", 1)[-1]]
        for name in robot.velocity_names
    }


def _slides(robot: Robot, joint: str) -> bool:
    return "P" in robot.model.joints[robot.model.getJointId(joint)].shortname().removeprefix("JointModel")
