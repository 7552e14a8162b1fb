"""A posture in which a robot stands with bent legs, or in which an arm holds its tip somewhere, by least squares."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from scipy.optimize import least_squares

from fesd_robot.orientations import turn_entries
from fesd_robot.robot import Robot

BENT = 0.8
"""Of a leg's length: how far the foot is from the hip where a robot stands, so that it can push."""

_STARTS = 12
_PATTERN = (0.7, -1.4, 0.7)
"""rad; how a leg is bent at first: the knee backwards."""

_UNLIMITED = np.pi
_LIKE_GUESS = 1e-2
"""Weight of the distance from the first guess, which decides what nothing else does."""

_MARGIN = 0.03
"""Of a joint's range: how far a posture stays away from its ends, so that it can be left both ways."""

_SHANK = 0.25
"""Of a leg's length: a foot that touches farther from its frame than this has the frame of a knee, not of an ankle."""

_LEVEL = 0.5
"""Weight, m/rad, of a sole's tilt in units of the leg's length."""

Residual = Callable[[np.ndarray, pin.Data], list[float]]


class Leg(NamedTuple):
    """A leg or an arm, from the joint next to the base to its end.

    Attributes:
        joints: from the first one to the last.
        frame: at its end.
        rest: length from every joint to the end, m, stretched.
        end: place of the end in the axes of the frame, m.
    """

    joints: tuple[int, ...]
    frame: str
    rest: tuple[float, ...]
    end: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def length(self) -> float:
        """Length of all of it, m."""
        return self.rest[0] if self.rest else 0.0

    def below(self, robot: Robot, data: pin.Data) -> np.ndarray:
        """Return the end as seen from the first joint, m, (3,), where the data has the places of all frames."""
        end = data.oMf[robot.frame_id(self.frame)].act(np.array(self.end))
        return np.asarray(end - hinge(robot.model, data, self.joints[0]))


def leg_to(robot: Robot, frame: str, base: Sequence[str], place: np.ndarray | None = None) -> Leg:
    """Return the chain of joints that carries a frame, without those of the base, by names of coordinates.

    Args:
        frame: of the body at the end.
        base: coordinates that are not of the leg.
        place: where that body touches, in the axes of the frame, m, (3,): the end, if a part of the leg is between; its
            origin if omitted.
    """
    model, data = robot.model, robot.model.createData()
    number, touching = robot.frame_id(frame), np.zeros(3) if place is None else place
    fixed = {robot.velocity_names.index(name) for name in base}
    chain, joint = [], model.frames[number].parentJoint
    while joint and model.joints[joint].idx_v not in fixed:
        chain.append(joint)
        joint = model.parents[joint]
    chain.reverse()
    q = clipped(robot, robot.neutral)
    pin.framesForwardKinematics(model, data, q)
    places = [
        *(hinge(model, data, joint) for joint in chain),
        data.oMf[number].translation,
        data.oMf[number].act(touching),
    ]
    links = [float(np.linalg.norm((b - a)[[0, 2]])) for a, b in pairwise(places)]
    x, y, z = touching.tolist() if links[-1] > _SHANK * sum(links) else (0.0, 0.0, 0.0)
    if (x, y, z) == (0.0, 0.0, 0.0):
        links.pop()
    rest = tuple(sum(links[i:]) + _slides(robot, chain[i:], q) for i in range(len(chain)))
    return Leg(tuple(chain), frame, rest, (x, y, z))


def hinge(model: pin.Model, data: pin.Data, joint: int) -> np.ndarray:
    """Return the place where a joint is attached, m, (3,): a slide's own frame moves with its child."""
    return np.asarray((data.oMi[model.parents[joint]] * model.jointPlacements[joint]).translation)


def _slides(robot: Robot, chain: Sequence[int], q: np.ndarray) -> float:
    """Return by how much sliding joints can still lengthen a chain, m."""
    more = 0.0
    for joint in chain:
        kind = robot.model.joints[joint]
        if kind.nq == 1 and kind.nv == 1 and kind.shortname().startswith(("JointModelP", "JointModelPrismatic")):
            ends = [
                end for end in (robot.lower_position[kind.idx_q], robot.upper_position[kind.idx_q]) if np.isfinite(end)
            ]
            more += max((abs(end) - abs(q[kind.idx_q]) for end in ends), default=0.0)
    return max(more, 0.0)


def clipped(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return a configuration (nq,) moved into the limits."""
    return np.asarray(np.clip(q, robot.lower_position, robot.upper_position))


def joint_values(robot: Robot, q: np.ndarray, joints: Sequence[int]) -> dict[str, float]:
    """Return the values of joints with one degree of freedom in a configuration (nq,) by coordinate, m or rad."""
    entries = dict.fromkeys(robot.model.joints[joint].idx_q for joint in joints)
    turns = {at.start: (name, at) for name, at in turn_entries(robot.configuration_names).items()}
    values = {}
    for entry in entries:
        if entry in turns:
            name, at = turns[entry]
            values[name] = float(np.arctan2(*q[at][::-1]))
        else:
            values[robot.configuration_names[entry]] = float(q[entry])
    return values


def standing_posture(robot: Robot, legs: Sequence[Leg]) -> np.ndarray:
    """Return q (nq,) with every foot below its hip, 0.8 of the leg's length away, and with level soles."""
    model = robot.model
    level = clipped(robot, robot.neutral)
    data = model.createData()
    pin.framesForwardKinematics(model, data, level)
    soles = [data.oMf[robot.frame_id(leg.frame)].rotation.copy() for leg in legs]

    def residual(q: np.ndarray, data: pin.Data) -> list[float]:
        rows: list[float] = []
        for leg, sole in zip(legs, soles, strict=True):
            foot = data.oMf[robot.frame_id(leg.frame)]
            below = leg.below(robot, data) / leg.length
            rows += [float(below[0]), float(below[2]) + BENT]
            if len(leg.joints) > 2:
                rows.append(_LEVEL * float(pin.log3(sole.T @ foot.rotation)[1]))
        return rows

    return solved(robot, [leg.joints for leg in legs], residual, level)


def solved(
    robot: Robot, chains: Sequence[Sequence[int]], residual: Residual, start: np.ndarray, *, only_near: bool = False
) -> np.ndarray:
    """Return the configuration (nq,) within the limits with the least squares of a residual, of several starts.

    Args:
        chains: joints with one coordinate each that may move, by chain.
        residual: of q and data with the places of all frames.
        start: of what does not move, (nq,), and the first guess of what does.
        only_near: whether `start` is the only guess.
    """
    model, data = robot.model, robot.model.createData()
    entries = [model.joints[joint].idx_q for chain in chains for joint in chain if model.joints[joint].nq == 1]
    lower = np.maximum(robot.lower_position[entries], -_UNLIMITED)
    upper = np.minimum(robot.upper_position[entries], _UNLIMITED)
    lower, upper = lower + _MARGIN * (upper - lower), upper - _MARGIN * (upper - lower)
    pattern = [
        _PATTERN[i % len(_PATTERN)] if model.joints[joint].nq == 1 else 0.0
        for chain in chains
        for i, joint in enumerate(chain)
        if model.joints[joint].nq == 1
    ]
    random = np.random.default_rng(0)
    width = upper - lower
    guesses = [np.clip(pattern, lower, upper), np.clip(-np.array(pattern), lower, upper)]
    guesses += [lower + width * random.uniform(0.1, 0.9, len(entries)) for _ in range(_STARTS)]
    if only_near:
        guesses = [np.clip(start[entries], lower, upper)]
    best: tuple[float, np.ndarray] | None = None
    for guess in guesses:

        def rows(values: np.ndarray, guess: np.ndarray = guess) -> np.ndarray:
            q = start.copy()
            q[entries] = values
            pin.framesForwardKinematics(model, data, q)
            return np.array([*residual(q, data), *(_LIKE_GUESS * (values - guess))])

        inside = np.clip(guess, lower + 1e-3 * width, upper - 1e-3 * width)
        found = least_squares(rows, inside, bounds=(lower, np.maximum(upper, lower + 1e-9)))
        # A tenth cheaper at least: the first guess is the natural one.
        if best is None or found.cost < 0.9 * best[0] - 1e-6:
            best = (float(found.cost), found.x)
    assert best is not None
    q = start.copy()
    q[entries] = np.clip(np.round(best[1], 3), lower, upper)
    return q
