"""The geometry of every contact: the two surfaces that touch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca

from fesd_robot.contact.boxes import circle_box_contact
from fesd_robot.contact.circles import circle_contact, two_circles_contact
from fesd_robot.contact.ground import Surface
from fesd_robot.contact.model import Contact
from fesd_robot.contact.points import leading_out_of_plane, leaves_plane, point_contact
from fesd_robot.contact.two_in_space import Facing, ball_box_contact, two_balls_contact
from fesd_robot.robot import Robot


@dataclass(frozen=True)
class PointOnSurface:
    """The origin of a frame against a surface."""

    frame: str
    surface: Surface


@dataclass(frozen=True)
class CircleOnSurface:
    """A circle in the x-z plane, of a radius in m about the origin of a frame and turning with it, on a surface.

    Attributes:
        path: the surface raised by the radius, on which the centre runs.
    """

    frame: str
    radius: float
    path: Surface


@dataclass(frozen=True)
class CircleOnCircle:
    """Two circles in the x-z plane, in space balls, each about the origin of its frame and turning with it.

    Attributes:
        radius, other_radius: m.
        facing: in space, the axis of the world that is nearest to the normal at the start; None in the plane.
    """

    frame: str
    radius: float
    other_frame: str
    other_radius: float
    facing: Facing | None = None


@dataclass(frozen=True)
class CircleOnBox:
    """A circle in the x-z plane about the origin of a frame, of a radius in m, and a box about that of another one.

    Attributes:
        other_size: of the box along the x and the z axis of its frame, m; in space, of a box that a ball touches, along
            all three.
        facing: in space, the axis of the world that is nearest to the normal at the start; None in the plane.
    """

    frame: str
    radius: float
    other_frame: str
    other_size: tuple[float, ...]
    facing: Facing | None = None


TwoBodies = CircleOnCircle | CircleOnBox
"""Geometries that touch another body of the robot, not a surface."""

ContactGeometry = PointOnSurface | CircleOnSurface | TwoBodies


@dataclass(frozen=True)
class Scene:
    """Everything that a robot may touch.

    Attributes:
        surfaces: name -> surface; ``ground``, the walls and other surfaces.
        geometries: name of a contact -> its geometry.
    """

    surfaces: Mapping[str, Surface]
    geometries: Mapping[str, ContactGeometry]


def contact_of(
    robot: Robot, configuration: ca.SX, geometry: ContactGeometry, *, name: str, friction: float, in_space: bool = False
) -> Contact:
    """Return gap, normal and tangent directions of a geometry as expressions.

    Args:
        configuration: q, SX symbols (n_q).
        friction: coefficient mu.
        in_space: whether the contact may slip in two directions; a circle is a ball then.

    Raises:
        RobotError: a frame of the geometry can leave the x-z plane.
    """
    if isinstance(geometry, PointOnSurface):
        return point_contact(
            robot,
            configuration,
            geometry.surface,
            name=name,
            frame=geometry.frame,
            friction=friction,
            in_space=in_space,
        )
    if isinstance(geometry, CircleOnSurface):
        return circle_contact(
            robot,
            configuration,
            geometry.path,
            name=name,
            frame=geometry.frame,
            radius=geometry.radius,
            friction=friction,
            in_space=in_space,
        )
    return _two_bodies_contact(robot, configuration, geometry, name=name, friction=friction)


def _two_bodies_contact(
    robot: Robot, configuration: ca.SX, geometry: TwoBodies, *, name: str, friction: float
) -> Contact:
    common: dict[str, Any] = {"name": name, "frames": (geometry.frame, geometry.other_frame), "friction": friction}
    if geometry.facing is not None:
        common["facing"] = geometry.facing
    if isinstance(geometry, CircleOnBox):
        common |= {"radius": geometry.radius, "size": geometry.other_size}
        make_box = circle_box_contact if geometry.facing is None else ball_box_contact
        return make_box(robot, configuration, **common)
    radii = geometry.radius, geometry.other_radius
    make = two_circles_contact if geometry.facing is None else two_balls_contact
    return make(robot, configuration, radii=radii, **common)


def needs_space(robot: Robot, configuration: ca.SX, geometries: Mapping[str, ContactGeometry]) -> bool:
    """Return whether a robot touches something out of the x-z plane, so that its contacts slip in two directions.

    Args:
        configuration: q, SX symbols (n_q).
        geometries: name of a contact -> its geometry.
    """
    return any(
        leaves_plane(robot, configuration, frame, turning=not isinstance(geometry, PointOnSurface))
        for geometry in geometries.values()
        for frame in frames_of(geometry)
    )


def out_of_plane(robot: Robot, configuration: ca.SX, geometry: ContactGeometry) -> list[str]:
    """Return the velocity coordinates that move what a contact is between out of the x-z plane.

    Args:
        configuration: q, SX symbols (n_q).
    """
    turning = not isinstance(geometry, PointOnSurface)
    found = [leading_out_of_plane(robot, configuration, frame, turning=turning) for frame in frames_of(geometry)]
    return list(dict.fromkeys(name for names in found for name in names))


def frames_of(geometry: ContactGeometry) -> list[str]:
    """Return the names of the frames that a contact is between, without surfaces."""
    return [geometry.frame, *([geometry.other_frame] if isinstance(geometry, TwoBodies) else [])]
