"""Collision shapes as spheres, capsules and boxes whose distances have closed forms."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from fesd_robot.errors import RobotError
from fesd_robot.robot.model_file import Shape

THICKER = 1.05
"""Radius of the spheres around a capsule over its own."""

_TURNS = 64
"""Points of a rim from which the capsule around it is computed."""


@dataclass(frozen=True)
class RoundShape:
    """All points within a radius of a point or of a segment.

    Attributes:
        ends: of the segment in the axes of the body's frame, m, (2, 3); twice the same place for a sphere.
        radius: m.
    """

    ends: np.ndarray
    radius: float

    @property
    def length(self) -> float:
        """Of the segment, m."""
        return float(np.linalg.norm(self.ends[1] - self.ends[0]))

    def spheres(self) -> list[RoundShape]:
        """Return spheres of `THICKER` radius that contain the shape; itself if it is a sphere."""
        if self.length == 0:
            return [self]
        reach = 2 * self.radius * math.sqrt(THICKER**2 - 1)
        parts = np.linspace(0.0, 1.0, math.ceil(self.length / reach) + 1)
        centers = self.ends[0] + parts[:, None] * (self.ends[1] - self.ends[0])
        return [RoundShape(np.array([center, center]), THICKER * self.radius) for center in centers]


@dataclass(frozen=True)
class BoxShape:
    """A box.

    Attributes:
        placement: of its middle and axes on the body's frame.
        half: half the lengths of its edges, m, (3).
    """

    placement: pin.SE3
    half: np.ndarray


SimpleShape = RoundShape | BoxShape


def simple_shape(shape: Shape) -> SimpleShape | None:
    """Return a collision shape as it is, None if it is neither sphere nor capsule nor box."""
    geometry, place = shape.geometry, shape.placement
    if isinstance(geometry, coal.Sphere):
        return RoundShape(np.array([place.translation, place.translation]), float(geometry.radius))
    if isinstance(geometry, coal.Capsule):
        along = geometry.halfLength * place.rotation[:, 2]
        return RoundShape(np.array([place.translation - along, place.translation + along]), float(geometry.radius))
    if isinstance(geometry, coal.Box):
        return BoxShape(place, np.array(geometry.halfSide, dtype=float).ravel())
    return None


def enclosing(shape: Shape) -> RoundShape:
    """Return the smallest capsule found around a collision shape; a sphere or a capsule is its own.

    Its axis is one of the principal axes of the shape's corners; its radius is the largest distance from the axis, and
    it is no longer than it has to be.

    Raises:
        RobotError: a shape without ends.
    """
    simple = simple_shape(shape)
    if isinstance(simple, RoundShape):
        return simple
    geometry = shape.geometry
    if isinstance(geometry, coal.Cylinder):
        along = np.array([0.0, 0.0, geometry.halfLength])
        local = RoundShape(np.array([-along, along]), float(geometry.radius))
    elif isinstance(geometry, coal.Ellipsoid):
        radii = np.array(geometry.radii, dtype=float).ravel()
        longest = int(np.argmax(radii))
        radius = float(np.delete(radii, longest).max())
        along = np.eye(3)[longest] * (radii[longest] - radius)
        local = RoundShape(np.array([-along, along]), radius)
    else:
        local = _around(_corners(shape))
    return RoundShape(np.array([shape.placement.act(end) for end in local.ends]), local.radius)


def _corners(shape: Shape) -> np.ndarray:
    """Return points whose convex hull contains a shape, in its own axes, m, (n, 3)."""
    geometry: Any = shape.geometry
    if isinstance(geometry, coal.Box):
        half = np.array(geometry.halfSide, dtype=float).ravel()
        return np.array([half * sign for sign in _signs()])
    if isinstance(geometry, coal.Cone):
        turn = np.linspace(0, 2 * np.pi, _TURNS, endpoint=False)
        outside = geometry.radius / math.cos(np.pi / _TURNS)
        rim = [[outside * math.cos(a), outside * math.sin(a), -geometry.halfLength] for a in turn]
        return np.array([*rim, [0.0, 0.0, geometry.halfLength]])
    if isinstance(geometry, coal.BVHModelBase):
        return np.array(geometry.vertices())
    if isinstance(geometry, coal.Convex):
        return np.array(geometry.points())
    raise RobotError(
        f"found shape '{shape.name}' of body '{shape.body}', a {kind_of(shape)}, around which there is no capsule, "
        "expected shapes that end somewhere"
    )


def _signs() -> Iterator[np.ndarray]:
    for corner in np.ndindex(2, 2, 2):
        yield 2.0 * np.array(corner) - 1.0


def _around(points: np.ndarray) -> RoundShape:
    """Return the smallest capsule of some around points, (n, 3)."""
    _, _, principal = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    found = [_about(points, axis) for axes in (principal, np.eye(3)) for axis in axes]
    return min(found, key=lambda one: one.radius**2 * (one.length + 4 / 3 * one.radius))


def _about(points: np.ndarray, axis: np.ndarray) -> RoundShape:
    """Return the capsule around points with an axis of this direction in the middle of their extent across it."""
    across = np.linalg.svd(axis[None, :])[2][1:]
    sideways = points @ across.T
    middle = (sideways.min(axis=0) + sideways.max(axis=0)) / 2
    off = np.linalg.norm(sideways - middle, axis=1)
    radius, along = float(off.max()), points @ axis
    cap = np.sqrt(np.maximum(radius**2 - off**2, 0.0))
    low, high = float((along + cap).min()), float((along - cap).max())
    if low > high:
        low = high = (low + high) / 2
    place = middle @ across
    return RoundShape(np.array([place + low * axis, place + high * axis]), radius)


def kind_of(shape: Shape) -> str:
    """Return the name of a shape's kind."""
    if isinstance(shape.geometry, coal.BVHModelBase | coal.Convex):
        return "mesh"
    return type(shape.geometry).__name__.lower()


def shapes_of_body(shapes: Sequence[Shape], body: str) -> list[Shape]:
    """Return the collision shapes of a body.

    Raises:
        RobotError: it has none; names the bodies that have some.
    """
    own = [shape for shape in shapes if shape.body == body]
    if not own:
        known = ", ".join(sorted({shape.body for shape in shapes})) or "none: the model has none"
        raise RobotError(f"found body '{body}' without collision shapes, expected one of {known}")
    return own
