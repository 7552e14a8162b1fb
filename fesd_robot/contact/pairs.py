"""What touches what: the geometry of every contact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca

from fesd_robot.contact.circles import circle_contact, two_circles_contact
from fesd_robot.contact.ground import Ground
from fesd_robot.contact.model import PlanarContact
from fesd_robot.contact.points import point_contact
from fesd_robot.robot import Robot


@dataclass(frozen=True)
class PointPair:
    """The origin of a frame against a surface."""

    frame: str
    surface: Ground


@dataclass(frozen=True)
class CirclePair:
    """A circle in the x-z plane, of a radius in m about the origin of a frame and turning with it, on a surface.

    Attributes:
        path: the surface raised by the radius, on which the centre runs.
    """

    frame: str
    radius: float
    path: Ground


@dataclass(frozen=True)
class TwoCirclesPair:
    """Two circles in the x-z plane, each about the origin of its frame and turning with it, radii in m."""

    frame: str
    radius: float
    other_frame: str
    other_radius: float


Pair = PointPair | CirclePair | TwoCirclesPair


@dataclass(frozen=True)
class Surroundings:
    """Everything that a robot may touch.

    Attributes:
        surfaces: name -> surface; ``ground`` and the walls.
        pairs: name of a contact -> its geometry.
    """

    surfaces: Mapping[str, Ground]
    pairs: Mapping[str, Pair]


def pair_contact(robot: Robot, configuration: ca.SX, pair: Pair, *, name: str, friction: float) -> PlanarContact:
    """Return gap, normal and tangent directions of a pair as expressions.

    Args:
        configuration: q, SX symbols (n_q).
        friction: coefficient mu.

    Raises:
        RobotError: a frame of the pair can leave the x-z plane.
    """
    if isinstance(pair, PointPair):
        return point_contact(robot, configuration, pair.surface, name=name, frame=pair.frame, friction=friction)
    if isinstance(pair, CirclePair):
        return circle_contact(
            robot, configuration, pair.path, name=name, frame=pair.frame, radius=pair.radius, friction=friction
        )
    return two_circles_contact(
        robot,
        configuration,
        name=name,
        frames=(pair.frame, pair.other_frame),
        radii=(pair.radius, pair.other_radius),
        friction=friction,
    )
