"""Where bodies of a robot overlap each other, and how deep they are in a surface, by coal's algorithms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from fesd_robot.robot.model_file import Shape
from fesd_robot.robot.robot import Robot

_POINTS = 32
"""Points on a rim or a great circle."""

_ALONG = 9
"""Points along an axis or an edge, for grounds that are not flat."""


@dataclass(frozen=True)
class Depth:
    """How deep a body is in something.

    Attributes:
        body: name of its frame.
        shape: number of its shape.
        depth: m, positive inside.
        place, radius: its deepest point lies on a ball of this radius around this place in the world, m, (3) and m.
    """

    body: str
    shape: int
    depth: float
    place: np.ndarray
    radius: float


class BodyShapes:
    """The collision shapes of a robot at any configuration.

    Args:
        robot: with shapes; meshes are taken with their convex hulls, and overlap only where they do themselves.

    Raises:
        RobotError: if a mesh is missing or unreadable.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot, self._data = robot, robot.model.createData()
        self._shapes, frames = list(robot.collision_shapes), robot.model.frames
        self._joints = [frames[robot.frame_id(shape.body)].parentJoint for shape in self._shapes]
        self._points = [outline_points(shape) for shape in self._shapes]
        self._geometry = pin.GeometryModel()
        for number, (shape, joint) in enumerate(zip(self._shapes, self._joints, strict=True)):
            place = frames[robot.frame_id(shape.body)].placement * shape.placement
            hull = _hull(shape.geometry)
            self._geometry.addGeometryObject(pin.GeometryObject(f"{number}", joint, place, hull))
        for first, second in self._movable_pairs():
            self._geometry.addCollisionPair(pin.CollisionPair(first, second))
        self._geometry_data = pin.GeometryData(self._geometry)

    @property
    def shapes(self) -> Sequence[Shape]:
        """The collision shapes."""
        return self._shapes

    def overlaps(self, q: np.ndarray, least: float) -> list[tuple[int, int, float]]:
        """Return numbers of two shapes that overlap by more than `least`, m, and by how much, deepest first.

        Left out are shapes of one body, of a body and the one that carries it, and of bodies one further that overlap
        when every joint is at zero: they do so by construction.
        """
        found = []
        for pair, depth in zip(self._geometry.collisionPairs, self._depths(q), strict=True):
            if depth > least and self._collide(pair):
                found.append((pair.first, pair.second, depth))
        return sorted(found, key=lambda one: -one[2])

    def depths(self, q: np.ndarray, distance: Callable[[np.ndarray], np.ndarray]) -> list[Depth]:
        """Return how deep every shape is below a surface.

        Args:
            q: configuration, (n_q).
            distance: signed distance of points (3, n) from the surface, m, (n).
        """
        pin.framesForwardKinematics(self._robot.model, self._data, q)
        result = []
        for number, (shape, (points, radius)) in enumerate(zip(self._shapes, self._points, strict=True)):
            pose = self._data.oMf[self._robot.frame_id(shape.body)]
            world = pose.rotation @ points + pose.translation[:, None]
            gaps = distance(world) - radius
            worst = int(np.argmin(gaps))
            result.append(Depth(shape.body, number, float(-gaps[worst]), world[:, worst], radius))
        return result

    def gap(self, number: int, place: np.ndarray) -> float:
        """Return the distance of a place from a shape's hull in the configuration `depths` was asked for last, m.

        Args:
            number: of the shape.
            place: in the world, m, (3).
        """
        shape = self._shapes[number]
        pose = self._data.oMf[self._robot.frame_id(shape.body)] * shape.placement
        at, point = coal.Transform3s(pose.rotation, pose.translation), coal.Transform3s(np.eye(3), place)
        hull = self._geometry.geometryObjects[number].geometry
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        return float(coal.distance(hull, at, coal.Sphere(0.0), point, request, result))

    def _depths(self, q: np.ndarray) -> np.ndarray:
        pin.computeDistances(self._robot.model, self._data, self._geometry, self._geometry_data, q)
        return np.array([-result.min_distance for result in self._geometry_data.distanceResults])

    def _collide(self, pair: pin.CollisionPair) -> bool:
        """Return whether two shapes overlap themselves, not only their hulls, in the configuration looked at last."""
        places = [self._geometry_data.oMg[number] for number in (pair.first, pair.second)]
        transforms = [coal.Transform3s(place.rotation, place.translation) for place in places]
        one, other = (self._shapes[number].geometry for number in (pair.first, pair.second))
        request, result = coal.CollisionRequest(), coal.CollisionResult()
        return bool(coal.collide(one, transforms[0], other, transforms[1], request, result))

    def _movable_pairs(self) -> list[tuple[int, int]]:
        """Return the pairs of shapes whose overlap is reported."""
        near = {joint: self._neighbours(joint) for joint in set(self._joints)}
        pairs = [
            (first, second)
            for first, second in combinations(range(len(self._shapes)), 2)
            if self._joints[first] != self._joints[second] and self._joints[second] not in near[self._joints[first]]
        ]
        geometry = pin.GeometryModel(self._geometry)
        for first, second in pairs:
            geometry.addCollisionPair(pin.CollisionPair(first, second))
        data = pin.GeometryData(geometry)
        pin.computeDistances(self._robot.model, self._data, geometry, data, self._robot.neutral)
        built_in = {
            pair
            for pair, result in zip(pairs, data.distanceResults, strict=True)
            if result.min_distance <= 0 and near[self._joints[pair[0]]] & near[self._joints[pair[1]]]
        }
        return [pair for pair in pairs if pair not in built_in]

    def _neighbours(self, joint: int) -> set[int]:
        """Return the joints whose bodies are next to that of a joint; joints without shapes have no body."""
        return {
            other
            for other in set(self._joints)
            if other != joint and (self._carrier(joint) == other or self._carrier(other) == joint)
        }

    def _carrier(self, joint: int) -> int | None:
        """Return the next joint with shapes on the way to the world, None if there is none."""
        parents, shaped = self._robot.model.parents, set(self._joints)
        while joint:
            joint = parents[joint]
            if joint in shaped:
                return int(joint)
        return None


def _hull(geometry: Any) -> Any:
    """Return the convex hull of a mesh, or a shape as it is."""
    if isinstance(geometry, coal.BVHModelBase):
        geometry.buildConvexHull(True, "Qt")
        return geometry.convex
    return geometry


def outline_points(shape: Shape) -> tuple[np.ndarray, float]:
    """Return points in the axes of a shape's frame, m, (3, n), and the radius within which all around them is shape."""
    geometry, radius = shape.geometry, 0.0
    turn = np.linspace(0, 2 * np.pi, _POINTS, endpoint=False)
    circle = np.stack([np.cos(turn), np.sin(turn), np.zeros(_POINTS)], axis=1)
    along = np.linspace(-1, 1, _ALONG)[:, None] * [0.0, 0.0, 1.0]
    if isinstance(geometry, coal.Sphere):
        points, radius = np.zeros((1, 3)), geometry.radius
    elif isinstance(geometry, coal.Capsule):
        points, radius = geometry.halfLength * along, geometry.radius
    elif isinstance(geometry, coal.Cylinder):
        points = (geometry.radius * circle + geometry.halfLength * along[:, None]).reshape(-1, 3)
    elif isinstance(geometry, coal.Cone):
        rim = geometry.radius * circle - [0.0, 0.0, geometry.halfLength]
        points = np.vstack([rim, [[0.0, 0.0, geometry.halfLength]]])
    elif isinstance(geometry, coal.Box):
        points = _box(np.array(geometry.halfSide, dtype=float).ravel())
    elif isinstance(geometry, coal.Ellipsoid):
        height = np.cos(np.linspace(0, np.pi, _POINTS // 2 + 1))[:, None, None]
        ball = np.sqrt(1 - height**2) * circle + height * [0.0, 0.0, 1.0]
        points = ball.reshape(-1, 3) * np.array(geometry.radii, dtype=float).ravel()
    else:
        points = np.array(_hull(geometry).points())
    return shape.placement.rotation @ points.T + shape.placement.translation[:, None], float(radius)


def _box(half: np.ndarray) -> np.ndarray:
    """Return points on the edges of a box, (n, 3)."""
    steps = np.linspace(-1, 1, _ALONG)
    grid = np.array(np.meshgrid(steps, steps, steps)).reshape(3, -1).T
    return half * grid[(np.abs(grid) == 1).sum(axis=1) >= 2]
