"""Which joints take the contacts of a robot out of the x-z plane."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from fesd_robot.contact import out_of_plane
from fesd_robot.ocp import MotionProblem
from fesd_robot.robot import Robot
from fesd_robot.robot.tree import directions

_NAMED = 3
"""How many joints are named."""


def described_space(motion: MotionProblem) -> list[str]:
    """Return a sentence that says why contacts are in space, with the axes of joints; nothing in the plane."""
    if not motion.in_space:
        return []
    robot, q = motion.robot, motion.dynamics.configuration
    found = [out_of_plane(robot, q, geometry) for geometry in motion.scene.geometries.values()]
    names = list(dict.fromkeys(name for each in found for name in each))
    if not names:
        return []
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    lead = "lead" if len(names) > 1 else "leads"
    first = ", ".join(_with_axis(robot, name) for name in names[:_NAMED])
    return [f"Contacts are in space and slip in two directions: {first}{more} {lead} out of the x-z plane."]


def _with_axis(robot: Robot, name: str) -> str:
    """Return the name of a coordinate, with the axis of its joint in the world at the neutral configuration."""
    model = robot.model
    index = model.getJointId(name)
    if index >= model.njoints or model.joints[index].nv != 1:
        return name
    data = model.createData()
    pin.forwardKinematics(model, data, robot.neutral)
    linear, angular = directions(model.joints[index])
    axis = data.oMi[index].rotation @ (linear + angular)
    axis = np.where(np.abs(axis) < 1e-12, 0.0, axis)
    return f"{name} {'about' if angular.any() else 'along'} ({', '.join(f'{entry:.3g}' for entry in axis)})"
