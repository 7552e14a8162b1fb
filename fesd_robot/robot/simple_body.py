"""Solid bodies of one shape: boxes, balls and cylinders, with frames at their middle and where they may touch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, Literal

import coal
import numpy as np
import pinocchio as pin

from fesd_robot.robot.load import robot_from_model
from fesd_robot.robot.model_file import ModelFile, Shape
from fesd_robot.robot.robot import Robot
from fesd_robot.robot.root import ROOT_JOINT, SAGITTAL_NAMES, Root, make_root_joint

MOVING, FIXED = np.array([0.16, 0.38, 0.62, 1.0]), np.array([0.45, 0.45, 0.48, 1.0])
"""Colours of bodies that move and of those that do not: red, green, blue and opacity."""

MIDDLE = "middle"
"""Name of the first link of a simple body in its own model."""

_UPRIGHT = {"x": pin.exp3(np.array([0.0, np.pi / 2, 0.0])), "y": pin.exp3(np.array([-np.pi / 2, 0.0, 0.0]))}
"""Axis -> the turn that brings the z axis there."""


@dataclass(frozen=True)
class UniformSolid:
    """A shape about its middle, the same everywhere in it.

    Attributes:
        geometry: box, sphere or cylinder of coal.
        placement: of the geometry in the axes of the body.
        inertia: of the body, mass in kg; zero for one that does not move.
        places: name of a frame -> where it is in the axes of the body, m, (3).
    """

    geometry: Any
    placement: pin.SE3
    inertia: pin.Inertia
    places: Mapping[str, np.ndarray]


def box(size: tuple[float, float, float], mass: float) -> UniformSolid:
    """Return a box with edges of some lengths, m, and frames at its eight corners.

    Corners are called ``front_left_top`` and so on: front and rear along x, left and right along y, top and bottom.
    """
    sides = (("rear", -1), ("front", 1)), (("right", -1), ("left", 1)), (("bottom", -1), ("top", 1))
    corners = {
        "_".join(name for name, _ in corner): np.array([sign for _, sign in corner]) * np.array(size) / 2
        for corner in product(*sides)
    }
    return UniformSolid(coal.Box(*size), pin.SE3.Identity(), pin.Inertia.FromBox(mass, *size), corners)


def ball(radius: float, mass: float) -> UniformSolid:
    """Return a ball of a radius, m."""
    return UniformSolid(coal.Sphere(radius), pin.SE3.Identity(), pin.Inertia.FromSphere(mass, radius), {})


def cylinder(radius: float, length: float, axis: Literal["x", "y", "z"], mass: float) -> UniformSolid:
    """Return a cylinder along an axis, lengths in m, with frames at the middles of its ends, `low` and `high`."""
    turn = pin.SE3(_UPRIGHT.get(axis, np.eye(3)), np.zeros(3))
    turn.rotation = np.round(turn.rotation)
    along = turn.rotation[:, 2] * length / 2
    inertia = turn.act(pin.Inertia.FromCylinder(mass, radius, length))
    return UniformSolid(coal.Cylinder(radius, length), turn, inertia, {"low": -along, "high": along})


def simple_body(name: str, solid: UniformSolid, root: Root) -> Robot:
    """Return a solid body on a root joint as a robot of one link, `MIDDLE`.

    Args:
        name: of the body.
        solid: its shape and its inertia.
        root: joint between the world and the body.
    """
    model = pin.Model()
    model.name = name
    joint, parent, root_joint = 0, 0, make_root_joint(root)
    if root_joint is not None:
        joint = model.addJoint(0, root_joint, pin.SE3.Identity(), ROOT_JOINT)
        model.appendBodyToJoint(joint, solid.inertia, pin.SE3.Identity())
        parent = model.addJointFrame(joint, 0)
    middle = model.addBodyFrame(MIDDLE, joint, pin.SE3.Identity(), parent)
    for frame, place in solid.places.items():
        pose = pin.SE3(np.eye(3), place)
        model.addFrame(pin.Frame(frame, joint, middle, pose, pin.FrameType.OP_FRAME), False)
    shape = Shape(
        name="shape",
        body=MIDDLE,
        placement=solid.placement,
        geometry=solid.geometry,
        color=FIXED if root_joint is None else MOVING,
        touches=True,
        visible=True,
    )
    composites = {ROOT_JOINT: list(SAGITTAL_NAMES)} if root == "sagittal" else {}
    read = ModelFile(model, "task", composites=composites, shapes=[shape])
    return robot_from_model(read, source=Path(name), package_directories=())
