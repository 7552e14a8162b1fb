"""A first task for a robot that does not move as a whole: its tip goes down to the ground."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError
from fesd_robot.first_task.feet import SAME_FRAME, limbs_of
from fesd_robot.first_task.posture import Leg, clipped, joint_values, leg_to, solved
from fesd_robot.first_task.proposal import Contact, Proposal, RobotSection, State, what_moves
from fesd_robot.robot import Robot

_DURATION, _INTERVALS = 1.0, 15

_AHEAD, _HIGH = 0.6, 0.3
"""Where the tip begins, in units of the arm's length ahead of its first joint and above the ground."""

_CLEAR = 0.2
"""Of the arm's length: how far joints beyond the first stay above the ground."""

_UPRIGHT = 0.8
"""Of the way from a joint to the tip: how far that joint is above it at least, where it is near."""

_PRESSED = 10.0
"""Weight of a joint that is lower than that."""

_MISSED = 0.05
"""Of the arm's length: a tip that stays this high does not reach the ground."""


def reach(name: str, robot: Robot, section: RobotSection, feet: Sequence[str]) -> list[Proposal]:
    """Return the first task in which an arm puts its tip to the ground.

    Args:
        name: of the task.
        robot: with the joints of the section locked and coupled.
        section: of the task.
        feet: the body that is the tip; none to guess: of the longest limb.

    Raises:
        RobotError: if the tip does not get to the ground.
    """
    q = clipped(robot, robot.neutral)
    tips = [*feet] or [body for limb in limbs_of(robot, q) for body in limb.bodies]
    # The longest way through the joints; of several bodies at its end the farthest.
    arm = max((leg_to(robot, tip, ()) for tip in tips), key=lambda leg: (len(leg.joints), round(leg.length, 4)))
    if not arm.joints or arm.length < SAME_FRAME:
        raise RobotError(
            f"{robot.source}: found no joint that moves the body {arm.frame} far; name another one by --foot"
        )
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    ahead = float(data.oMi[arm.joints[0]].translation[0]) + _AHEAD * arm.length
    start = _at(robot, arm, ahead, _HIGH * arm.length, q)
    end = _at(robot, arm, ahead, 0.0, start, near=True)
    pin.framesForwardKinematics(robot.model, data, end)
    height = float(data.oMf[robot.frame_id(arm.frame)].translation[2])
    if abs(height) > _MISSED * arm.length:
        raise RobotError(
            f"{robot.source}: found no posture in which {arm.frame} touches the ground ({height:.3g} m from it); name "
            "another body by --foot"
        )
    values = {which: joint_values(robot, at, arm.joints) for which, at in (("start", start), ("end", end))}
    adjust = tuple(values["end"])
    return [
        Proposal(
            name=name,
            words=f"{what_moves(section)} lowers its tip by {_HIGH * arm.length:.2g} m to the ground and rests there.",
            robot=section,
            contacts=(Contact("tip", arm.frame),),
            duration=_DURATION,
            intervals=_INTERVALS,
            initial=State(configuration=values["start"]),
            goal=State(configuration=values["end"], stand_on=("tip",), adjust=adjust),
            found="one that inverse kinematics found",
        )
    ]


def _at(robot: Robot, arm: Leg, ahead: float, height: float, start: np.ndarray, *, near: bool = False) -> np.ndarray:
    """Return q (nq,) with the tip at a place and all joints well above the ground; `near` to `start` only."""
    frame = robot.frame_id(arm.frame)
    clear = [min(_CLEAR * arm.length, _UPRIGHT * rest) for rest in arm.rest[1:]]

    def residual(q: np.ndarray, data: pin.Data) -> list[float]:
        tip = data.oMf[frame].translation
        inner = [float(data.oMi[joint].translation[2]) for joint in arm.joints]
        low = [_PRESSED * min(z - height, 0.0) / arm.length for z, height in zip(inner[1:], clear, strict=True)]
        away = (ahead - float(tip[0])) / arm.length
        return [away, 10 * (float(tip[2]) - height) / arm.length, *low]

    return solved(robot, [arm.joints], residual, start, only_near=near)
