"""The circles of a robot that may touch something, as rings with a spoke that shows how they turn."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import meshcat.geometry as mg
import numpy as np
import pinocchio as pin
from meshcat.commands import SetObject, SetTransform
from meshcat.path import Path

from fesd_robot.render.geometry import mesh
from fesd_robot.render.palette import color_number, series_color
from fesd_robot.render.scene import joint_paths, tube
from fesd_robot.render.window import SceneWindow

CORNERS = 72


class CircleVisual(NamedTuple):
    """A circle in the x-z plane about the origin of a frame.

    Args:
        frame: Pinocchio's index of the frame, with which the circle turns.
        radius: m.
        color: number in the row of colours, that of the path with which the circle belongs.
    """

    frame: int
    radius: float
    color: int


def add_circles(
    window: SceneWindow,
    model: pin.Model,
    configuration: np.ndarray,
    circles: Mapping[str, CircleVisual],
    thickness: float,
) -> None:
    """Add every circle below the joint that carries its frame.

    Args:
        configuration: where the motion begins; it tells how the x-z plane lies in every joint, (nq).
        circles: name -> circle.
        thickness: radius of the drawn line, m.
    """
    paths, data = joint_paths(model), model.createData()
    pin.framesForwardKinematics(model, data, pin.normalize(model, configuration))
    angle = np.linspace(0.0, 2.0 * np.pi, CORNERS + 1)
    for number, (name, circle) in enumerate(circles.items()):
        rim = circle.radius * np.stack([np.cos(angle), np.zeros_like(angle), np.sin(angle)], axis=1)
        joint = model.frames[circle.frame].parentJoint
        upright = pin.SE3(np.eye(3), data.oMf[circle.frame].translation)
        pose = (data.oMi[joint].inverse() * upright).homogeneous
        material = mg.MeshBasicMaterial(color=color_number(series_color(circle.color)))
        for part, points in (("rim", rim), ("spoke", np.stack([np.zeros(3), rim[0]]))):
            path = Path((*paths[joint].entries, f"{part} {number} {name.replace('/', '_')}"))
            geometry = mg.TriangularMeshGeometry(*tube(points, thickness))
            window.send(SetObject(mesh(f"{part} {number}", geometry, material), path=path))
            window.send(SetTransform(pose, path))
