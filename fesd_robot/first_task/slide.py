"""A first task for a robot without legs that moves as a whole: it slides or rolls forward."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError
from fesd_robot.first_task.base import Base
from fesd_robot.first_task.feet import SAME_FRAME, labels_of, limbs_of
from fesd_robot.first_task.posture import clipped
from fesd_robot.first_task.proposal import Contact, Proposal, RobotSection, State, what_moves
from fesd_robot.robot import Robot

_FORWARD, _DURATION, _INTERVALS = 0.3, 1.0, 15
"""m, s, and the control intervals."""

_ROUND = 1e-3
"""Difference of a shape's extents along x and z, of its size, that still is round."""


def slide(name: str, robot: Robot, section: RobotSection, base: Base) -> list[Proposal]:
    """Return the first task in which a robot that is one body moves forward: on its lowest frames, or as a wheel.

    Args:
        name: of the task.
        robot: with the joints of the section locked and coupled.
        section: of the task.
        base: how the robot moves as a whole.
    """
    assert base.forward is not None and base.up is not None
    q = clipped(robot, robot.neutral)
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    (limb,) = limbs_of(robot, q)
    places = {body: data.oMf[robot.frame_id(body)].translation for body in limb.bodies}
    low = min(place[2] for place in places.values())
    forward = base.forward_sign * _FORWARD
    goal, radius = {base.forward: forward}, _radius(robot, limb.frame)
    if radius and base.pitch:
        contacts = [Contact("rim", limb.frame, radius=radius)]
        goal[base.pitch] = round(base.pitch_sign * _FORWARD / radius, 3)
    else:
        feet: dict[str, float] = {}
        for body, place in places.items():
            if place[2] <= low + SAME_FRAME and all(abs(place[0] - x) > SAME_FRAME for x in feet.values()):
                feet[body] = float(place[0])
        feet = dict(sorted(feet.items(), key=lambda foot: -foot[1]))
        contacts = [Contact(*each) for each in zip(labels_of([*feet], [*feet.values()]), feet, strict=True)]
    stand = tuple(contact.name for contact in contacts)
    adjust = (base.up,) if base.up != "root_z" or len(stand) > 1 else ()
    return [
        Proposal(
            name=name,
            words=f"{what_moves(section)} moves {_FORWARD:g} m forward over the ground and stops.",
            robot=section,
            contacts=tuple(contacts),
            duration=_DURATION,
            intervals=_INTERVALS,
            initial=State(stand_on=stand, adjust=adjust),
            goal=State(configuration=goal, stand_on=stand, adjust=adjust),
            found="that of the model file",
            slides=True,
        )
    ]


def _radius(robot: Robot, body: str) -> float | None:
    """Return the radius of a body that is drawn round about its frame, in the x-z plane, m; None of any other."""
    try:
        shapes = robot.visual_model.geometryObjects
    except RobotError:
        return None
    radii = []
    for shape in shapes:
        if shape.parentFrame != robot.frame_id(body):
            continue
        shape.geometry.computeLocalAABB()
        box = shape.geometry.aabb_local
        turn = np.abs(robot.model.frames[shape.parentFrame].placement.actInv(shape.placement).rotation)
        size, middle = turn @ (box.max_ - box.min_), shape.geometry.aabb_local.center()
        if abs(size[0] - size[2]) <= _ROUND * size[0] and np.abs(middle).max() <= SAME_FRAME:
            radii.append(size[0] / 2)
    return float(f"{max(radii):.4g}") if radii and max(radii) > SAME_FRAME else None
