"""Rigid bodies in the x-z plane, each made of one line of numbers."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fesd_robot.contact import CircleOnSurface, ContactGeometry, PointOnSurface, Scene
from fesd_robot.contact.ground import Plane
from fesd_robot.recovery.physics import NumericPhysics
from fesd_robot.robot import load_robot

GRAVITY = 9.81

_AXES = {"x": ("prismatic", "1 0 0"), "z": ("prismatic", "0 0 1"), "pitch": ("revolute", "0 1 0")}


def body(
    mass: float,
    inertia: float,
    points: Mapping[str, tuple[float, float]],
    *,
    friction: float,
    restitution: float = 0.0,
    slope: float = 0.0,
    radius: float = 0.0,
    coordinates: tuple[str, ...] = ("x", "z", "pitch"),
) -> NumericPhysics:
    """Return the physics of a body whose controls are forces along its coordinates.

    Args:
        mass, inertia: kg, kg m^2 about its centre.
        points: name -> (x, z) from the centre, m; each a contact with a plane through the origin.
        friction, restitution: coefficients of every contact.
        slope: of the plane, rad.
        radius: of the circle about each point, m; zero for the point itself.
        coordinates: that the body has, in their order.
    """
    links = ["<link name='world'/>"]
    joints, parent = [], "world"
    for name in coordinates:
        kind, axis = _AXES[name]
        inertial = ""
        if name == coordinates[-1]:
            inertial = (
                f"<inertial><mass value='{mass}'/>"
                f"<inertia ixx='{inertia}' iyy='{inertia}' izz='{inertia}' ixy='0' ixz='0' iyz='0'/></inertial>"
            )
        links.append(f"<link name='link_{name}'>{inertial}</link>")
        joints.append(
            f"<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='link_{name}'/>"
            f"<axis xyz='{axis}'/><limit lower='-100' upper='100' velocity='100' effort='100'/></joint>"
        )
        parent = f"link_{name}"
    for name, (x, z) in points.items():
        links.append(f"<link name='{name}'/>")
        joints.append(
            f"<joint name='{name}' type='fixed'><parent link='{parent}'/><child link='{name}'/>"
            f"<origin xyz='{x} 0 {z}' rpy='0 0 0'/></joint>"
        )
    plane = Plane(0.0, slope)

    def geometry(name: str) -> ContactGeometry:
        return CircleOnSurface(name, radius, plane.raised(radius)) if radius else PointOnSurface(name, plane)

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "body.urdf"
        file.write_text(f"<robot name='body'>{''.join(links)}{''.join(joints)}</robot>", encoding="utf-8")
        robot = load_robot(file)
    scene = Scene({"ground": plane}, {name: geometry(name) for name in points})
    return NumericPhysics(
        robot,
        scene,
        dict.fromkeys(points, friction),
        lambda _: np.eye(len(coordinates)),
        restitution=dict.fromkeys(points, restitution),
    )


def block(friction: float = 0.4, slope: float = 0.0, restitution: float = 0.0) -> NumericPhysics:
    """A block of 2 kg, 0.3 m long and 0.2 m high, on its two lower corners."""
    corners = {"rear": (-0.15, -0.1), "front": (0.15, -0.1)}
    return body(2.0, 0.0217, corners, friction=friction, restitution=restitution, slope=slope)


def point(friction: float, slope: float = 0.0) -> NumericPhysics:
    """A point mass of 1 kg."""
    return body(1.0, 1e-3, {"foot": (0.0, 0.0)}, friction=friction, slope=slope, coordinates=("x", "z"))


def disc(friction: float, restitution: float = 0.0) -> NumericPhysics:
    """A solid disc of 3 kg with a radius of 0.25 m."""
    inertia = 0.5 * 3.0 * 0.25**2
    return body(3.0, inertia, {"rim": (0.0, 0.0)}, friction=friction, restitution=restitution, radius=0.25)


ROD_LENGTH = 1.2


def rod(friction: float, restitution: float = 0.0) -> NumericPhysics:
    """A slender rod of 1 kg, whose end at -x from its centre is the contact."""
    tip = {"tip": (-ROD_LENGTH / 2, 0.0)}
    return body(1.0, ROD_LENGTH**2 / 12.0, tip, friction=friction, restitution=restitution)
