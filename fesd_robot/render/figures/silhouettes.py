"""The robot as flat shapes in the x-z plane, seen along +y, drawn without a browser."""

from __future__ import annotations

from collections.abc import Mapping

import coal
import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull, QhullError

from fesd_robot.render.geometry import box_corners, file_unit
from fesd_robot.robot import Robot

UNBOUNDED = 1e6
"""m; geometries that reach farther, such as planes, are not drawn."""

CORNERS = 36


class Silhouettes:
    """The convex outlines of a robot's shapes, and the lines between its joints, at any configuration.

    Args:
        robot: with shapes that can be read.
        contacts: name of a contact -> the name of its frame, to which a line is drawn from its joint.

    Raises:
        RobotError: the shapes of the robot cannot be read.
    """

    def __init__(self, robot: Robot, contacts: Mapping[str, str]) -> None:
        self._model, self._visual = robot.model, robot.visual_model
        self._data, self._placed = self._model.createData(), self._visual.createData()
        cached: dict[str, np.ndarray] = {}
        self._points: dict[int, np.ndarray] = {}
        for index, shape in enumerate(self._visual.geometryObjects):
            key = f"{shape.meshPath} {np.ravel(shape.meshScale)}" if shape.meshPath.count("/") else f"{index}"
            if key not in cached:
                cached[key] = _corners(shape.geometry) * file_unit(shape)
            if np.abs(cached[key]).max() < UNBOUNDED:
                self._points[index] = cached[key]
        self._frames = [robot.frame_id(frame) for frame in dict.fromkeys(contacts.values())]

    def place(self, q: np.ndarray) -> None:
        """Move the robot to a configuration, (n_q)."""
        pin.framesForwardKinematics(self._model, self._data, pin.normalize(self._model, q))
        pin.updateGeometryPlacements(self._model, self._data, self._visual, self._placed)

    def outlines(self) -> list[np.ndarray]:
        """Return corners x, z of every shape, m, (k, 2), those farthest from the reader first."""
        found = []
        for index, points in self._points.items():
            pose = self._placed.oMg[index]
            world = points @ pose.rotation.T + pose.translation
            found.append((float(world[:, 1].mean()), _hull(world[:, [0, 2]])))
        return [outline for _, outline in sorted(found, key=lambda each: -each[0])]

    def sticks(self) -> list[np.ndarray]:
        """Return the lines between joints that carry a mass, and from there to the contacts, x, z in m, (2, 2) each."""
        lines = []
        for joint in range(1, self._model.njoints):
            parent = self._model.parents[joint]
            if parent > 0 and self._model.inertias[parent].mass > 0:
                lines.append((self._data.oMi[parent], self._data.oMi[joint]))
        for frame in self._frames:
            joint = self._model.frames[frame].parentJoint
            parent = self._model.parents[joint]
            # What is a single body needs no stick; a limb does.
            if parent > 0 and self._model.inertias[parent].mass > 0:
                lines.append((self._data.oMi[joint], self._data.oMf[frame]))
        flat = [np.array([a.translation[[0, 2]], b.translation[[0, 2]]]) for a, b in lines]
        return [line for line in flat if np.ptp(line, axis=0).max() > 1e-6]


def _hull(points: np.ndarray) -> np.ndarray:
    """Return the corners of the convex hull of points in a plane, in order; of points on a line all of them."""
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:
        return points


def _corners(shape: coal.CollisionGeometry) -> np.ndarray:
    """Return points whose convex hull is that of a shape, m or the unit of its file, (k, 3)."""
    angle = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False)
    rim = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    if isinstance(shape, coal.Sphere):
        return shape.radius * _ball()
    if isinstance(shape, coal.Ellipsoid):
        return _ball() * np.ravel(shape.radii)
    if isinstance(shape, coal.Capsule):
        ends = np.array([[0.0, 0.0, side * shape.halfLength] for side in (-1, 1)])
        return np.concatenate([shape.radius * _ball() + end for end in ends])
    if isinstance(shape, (coal.Cylinder, coal.Cone)):
        height = np.array([0.0, 0.0, shape.halfLength])
        top = shape.radius * rim if isinstance(shape, coal.Cylinder) else np.zeros((1, 3))
        return np.concatenate([shape.radius * rim - height, top + height])
    if hasattr(shape, "vertices") and not isinstance(shape, coal.Box):
        points = np.asarray(shape.vertices(), dtype=float).reshape(-1, 3)
        try:
            return points[ConvexHull(points).vertices]
        except QhullError:
            return points
    return box_corners(shape)


def _ball() -> np.ndarray:
    """Return points of the unit sphere on rings of latitude, (k, 3)."""
    rings = []
    for latitude in np.linspace(-np.pi / 2, np.pi / 2, CORNERS // 2 + 1):
        angle = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False)
        across = np.full_like(angle, np.sin(latitude))
        rings.append(np.stack([np.cos(latitude) * np.cos(angle), np.cos(latitude) * np.sin(angle), across], axis=1))
    return np.concatenate(rings)
