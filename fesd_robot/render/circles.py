"""The circles and boxes of a robot that may touch something; circles have a spoke that shows how they turn."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pinocchio as pin

import fesd_robot.render.meshcat.geometry as mg
from fesd_robot.render.geometry import mesh
from fesd_robot.render.meshcat.commands import SetObject, SetTransform
from fesd_robot.render.meshcat.path import Path
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


class BoxVisual(NamedTuple):
    """A box in the x-z plane about the origin of a frame.

    Args:
        frame: Pinocchio's index of the frame, with which the box turns.
        size: along the x and the z axis of the frame, m.
        color: number in the row of colours.
    """

    frame: int
    size: tuple[float, float]
    color: int

    @property
    def outline(self) -> np.ndarray:
        """Its corners in the axes of the frame, the first one again at the end, m, (5, 3)."""
        corners = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1], [-1, 0, -1]])
        return 0.5 * corners * [self.size[0], 0.0, self.size[1]]


def add_circles(
    window: SceneWindow,
    model: pin.Model,
    configuration: np.ndarray,
    circles: Mapping[str, CircleVisual | BoxVisual],
    thickness: float,
) -> None:
    """Add every circle and box below the joint that carries its frame.

    Args:
        configuration: where the motion begins; it tells how the x-z plane lies in every joint, (nq).
        circles: name -> circle or box.
        thickness: radius of the drawn line, m.
    """
    paths, data = joint_paths(model), model.createData()
    pin.framesForwardKinematics(model, data, pin.normalize(model, configuration))
    angle = np.linspace(0.0, 2.0 * np.pi, CORNERS + 1)
    for number, (name, circle) in enumerate(circles.items()):
        joint, place = model.frames[circle.frame].parentJoint, data.oMf[circle.frame]
        if isinstance(circle, BoxVisual):
            parts = {"rim": circle.outline}
        else:
            rim = circle.radius * np.stack([np.cos(angle), np.zeros_like(angle), np.sin(angle)], axis=1)
            parts = {"rim": rim, "spoke": np.stack([np.zeros(3), rim[0]])}
            place = pin.SE3(np.eye(3), place.translation)
        pose = (data.oMi[joint].inverse() * place).homogeneous
        material = mg.MeshBasicMaterial(color=color_number(series_color(circle.color)))
        for part, points in parts.items():
            path = Path((*paths[joint].entries, f"{part} {number} {name.replace('/', '_')}"))
            geometry = mg.TriangularMeshGeometry(*tube(points, thickness))
            window.send(SetObject(mesh(f"{part} {number}", geometry, material), path=path))
            window.send(SetTransform(pose, path))
