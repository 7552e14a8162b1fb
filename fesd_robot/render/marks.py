"""Named things around a robot that stands still: frames, shapes, places that touch, obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import coal
import numpy as np
import pinocchio as pin

import fesd_robot.render.meshcat.geometry as mg
from fesd_robot.render.geometry import box_corners, make_visual, mesh
from fesd_robot.render.meshcat.commands import SetObject, SetTransform
from fesd_robot.render.meshcat.path import Path
from fesd_robot.render.meshes import Meshes
from fesd_robot.render.palette import color_number
from fesd_robot.render.scene import tube
from fesd_robot.render.window import SceneWindow

AXES = ("#d55e00", "#009e73", "#0072b2")
"""Colours of the x, y and z axis of a frame."""

AXIS, THICKNESS = 0.05, 0.0012
"""Length and radius of a drawn axis over the size of the robot."""


@dataclass(frozen=True)
class Mark:
    """Something with a name at a place in the world.

    Attributes:
        group: what it is one of; groups are shown and hidden together.
        name: written beside it.
        pose: in the world.
        shape: a shape of coal that is drawn there; None for the axes of a frame.
        color: ``#rrggbb``.
        opacity: 0 ... 1.
    """

    group: str
    name: str
    pose: pin.SE3
    shape: Any = None
    color: str = AXES[2]
    opacity: float = 0.35


def add_marks(window: SceneWindow, marks: Sequence[Mark], meshes: Meshes, size: float) -> list[dict[str, object]]:
    """Add every mark below a node of its group.

    Args:
        meshes: of the page.
        size: of the robot, m.

    Returns:
        of every mark text, place and group, for its label.
    """
    for number, mark in enumerate(marks):
        path = Path(("marks", mark.group, f"{number} {mark.name.replace('/', '_')}"))
        if mark.shape is None:
            _add_axes(window, path, mark, number, size)
            continue
        red, green, blue = (int(mark.color[k : k + 2], 16) / 255 for k in (1, 3, 5))
        drawn = pin.GeometryObject(f"mark {number}", 0, 0, pin.SE3.Identity(), mark.shape)
        drawn.meshColor = np.array([red, green, blue, mark.opacity])
        drawn.overrideMaterial = True
        visual = make_visual(drawn, meshes)
        if visual is not None:
            window.send(SetObject(visual.element, path=path))
            window.send(SetTransform(mark.pose.homogeneous @ visual.matrix, path))
    return [{"text": one.name, "at": one.pose.translation.round(6).tolist(), "group": one.group} for one in marks]


def corners(marks: Sequence[Mark]) -> np.ndarray:
    """Return the corners of the boxes around all marks, m, (n, 3)."""
    points = [mark.pose.translation for mark in marks]
    for mark in marks:
        if mark.shape is not None:
            points += [mark.pose.act(corner) for corner in box_corners(mark.shape)]
    return np.array(points).reshape(-1, 3)


def dot(size: float) -> coal.Sphere:
    """Return the shape that draws a place without extent.

    Args:
        size: of the robot, m.
    """
    return coal.Sphere(0.008 * size)


def _add_axes(window: SceneWindow, path: Path, mark: Mark, number: int, size: float) -> None:
    for axis, color in enumerate(AXES):
        vertices, faces = tube(np.array([np.zeros(3), AXIS * size * np.eye(3)[axis]]), THICKNESS * size)
        material = mg.MeshBasicMaterial(color=color_number(color))
        element = mesh(f"mark {number} {axis}", mg.TriangularMeshGeometry(vertices, faces), material)
        part = Path((*path.entries, "xyz"[axis]))
        window.send(SetObject(element, path=part))
        window.send(SetTransform(mark.pose.homogeneous, part))
