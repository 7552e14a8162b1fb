"""A first task for a robot that stands: a jump forward."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError
from fesd_robot.first_task.base import Base
from fesd_robot.first_task.feet import feet_of, lowest_place
from fesd_robot.first_task.posture import Leg, clipped, joint_values, leg_to, standing_posture
from fesd_robot.first_task.proposal import Contact, Proposal, RobotSection, State, what_moves
from fesd_robot.robot import STANDARD_GRAVITY, Robot

_POSTURES = ("standing", "straight_standing", "stand", "half_sitting", "home", "default")
"""Names of postures in which robots stand, the likeliest first."""

_TIMES, _INTERVALS = 4.0, 15
"""Duration of a jump in units of the square root of height over gravity; its control intervals."""

_FORWARD, _APEX = 0.6, 0.3
"""Length and height of a jump in units of the height of the hips."""

_EFFORT = 3.0
"""Guessed torque of a joint without motor in units of weight and leg."""

_LEAST_STAND = 0.3
"""Of a leg's length: with feet nearer to the hips, a posture of the file is not one in which a robot stands."""


def jump(name: str, robot: Robot, section: RobotSection, base: Base, feet: Sequence[str]) -> list[Proposal]:
    """Return first tasks in which a robot stands and jumps, the likeliest first: one for every posture it may stand in.

    Args:
        name: of the task.
        robot: with the joints of the section locked and coupled.
        section: of the task.
        base: how the robot moves as a whole.
        feet: bodies that are feet; none to guess.

    Raises:
        RobotError: if no joint moves a foot.
    """
    proposals = []
    for posture, q, names in _postures(robot, base, feet):
        contacts = feet_of(robot, q, names)
        legs = [leg_to(robot, one.frame, base.names, lowest_place(robot, q, one.frame)) for one in contacts]
        height = _height(robot, q, contacts, legs)
        values = {} if posture else joint_values(robot, q, [j for leg in legs for j in leg.joints])
        stand = tuple(contact.name for contact in contacts)
        shaped = any(contact.shapes for contact in contacts) or len(contacts) > 1
        adjust = tuple(each for each in (base.up, base.pitch if shaped else None) if each)
        default = ("root_z", "root_pitch")[: len(adjust)]
        adjust = () if adjust == default else adjust
        forward = base.forward_sign * round(_FORWARD * height, 2)
        effort = {} if robot.driven.any() or robot.drives else _effort(robot, base, height)
        assert base.forward is not None and base.up is not None
        proposals.append(
            Proposal(
                name=name,
                words=f"{what_moves(section)} jumps {abs(forward):g} m forward and lands as it stood.",
                robot=section,
                contacts=tuple(contacts),
                duration=max(round(_TIMES * float(np.sqrt(height / STANDARD_GRAVITY)), 1), 0.3),
                intervals=_INTERVALS,
                initial=State(posture, values, stand, adjust),
                goal=State(posture, {base.forward: forward, **values}, stand, adjust),
                found=f"'{posture}' of the model file" if posture else "one with bent legs",
                apex={base.up: base.up_sign * round(_APEX * height, 3)},
                effort=effort,
            )
        )
    return proposals


def _postures(robot: Robot, base: Base, feet: Sequence[str]) -> list[tuple[str, np.ndarray, Sequence[str]]]:
    """Return the postures of the model file in which its legs are stretched, then a found one.

    Each comes with its name, its configuration and its feet: those of a posture of the file are guessed in it, those of
    the found one where it began, for bending may lift a foot.
    """
    neutral = clipped(robot, robot.neutral)
    result = []
    for name in (each for each in _POSTURES if each in robot.postures):
        q = neutral.copy()
        for coordinate, value in robot.postures[name].items():
            if coordinate in robot.configuration_names:
                q[robot.configuration_names.index(coordinate)] = value
        legs = _legs(robot, q, base, feet)
        if all(leg.joints and _reach(robot, q, leg) > _LEAST_STAND * leg.length for leg in legs):
            result.append((name, q, feet))
    legs = _legs(robot, neutral, base, feet)
    if not all(leg.joints and leg.length > 0 for leg in legs):
        frame = next(leg.frame for leg in legs if not (leg.joints and leg.length > 0))
        raise RobotError(f"{robot.source}: found no joint that moves the foot {frame}; name the feet by --foot")
    return [*result, ("", standing_posture(robot, legs), list(dict.fromkeys(leg.frame for leg in legs)))]


def _legs(robot: Robot, q: np.ndarray, base: Base, feet: Sequence[str]) -> list[Leg]:
    """Return the legs to the feet that touch in a configuration (nq,), each to where its foot touches."""
    frames = [contact.frame for contact in feet_of(robot, q, feet)]
    return [leg_to(robot, frame, base.names, lowest_place(robot, q, frame)) for frame in frames]


def _reach(robot: Robot, q: np.ndarray, leg: Leg) -> float:
    """Return how far a foot is below its hip, m."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return -float(leg.below(robot, data)[2])


def _height(robot: Robot, q: np.ndarray, contacts: Sequence[Contact], legs: Sequence[Leg]) -> float:
    """Return the height of the centre of mass above the lowest foot, m."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    places = [(one.frame, leg.end if any(leg.end) else one.offset) for one, leg in zip(contacts, legs, strict=True)]
    ends = [data.oMf[robot.frame_id(frame)].act(np.array([*end])) for frame, end in places]
    feet = min(float(end[2]) for end in ends)
    return max(float(pin.centerOfMass(robot.model, data, q)[2]) - feet, 1e-2)


def _effort(robot: Robot, base: Base, height: float) -> dict[str, float]:
    """Return a torque or force for every joint of a robot without motors, rounded to one digit."""
    largest = _EFFORT * float(pin.computeTotalMass(robot.model)) * STANDARD_GRAVITY * height
    digit = 10 ** np.floor(np.log10(largest))
    return {name: float(np.ceil(largest / digit) * digit) for name in robot.velocity_names if name not in base.names}
