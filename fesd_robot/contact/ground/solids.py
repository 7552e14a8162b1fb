"""Boxes and cylinders with rounded edges, to stand on or to touch."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import casadi as ca
import numpy as np

from fesd_robot.contact.ground.surface import Axes, turned_axes, upright_axes
from fesd_robot.exactness import NO_LENGTH


@dataclass(frozen=True)
class Pose:
    """Where a solid is.

    Args:
        center: m, (3).
        axes: its own x, y and z axis in the world, (3) each.
    """

    center: tuple[float, float, float]
    axes: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    @classmethod
    def turned(cls, center: tuple[float, float, float], yaw: float, pitch: float = 0.0) -> Pose:
        """Return the pose of a solid that is turned by a pitch about +y, then by a yaw about +z, rad."""
        c, s, d, r = math.cos(yaw), math.sin(yaw), math.cos(pitch), math.sin(pitch)
        return cls(center, ((c * d, s * d, -r), (-s, c, 0.0), (c * r, s * r, d)))

    def along(self, axis: Literal["x", "y", "z"]) -> Pose:
        """Return the pose whose z axis is one of these axes, and whose others are the two that follow it."""
        first = "xyz".index(axis) + 1
        return Pose(self.center, tuple(self.axes[(first + k) % 3] for k in range(3)))

    def local(self, point: Any) -> list[Any]:
        """Return the coordinates of a point of the world along the own axes, m."""
        away = [point[i] - self.center[i] for i in range(3)]
        return [sum(axis[i] * away[i] for i in range(3) if axis[i]) for axis in self.axes]


@dataclass(frozen=True)
class Solid(ABC):
    """Everything within `rounding` of a convex core: f(p) = |max(b, 0)| + min(max b, 0) - rounding.

    b are the distances of p beyond the faces of the core, negative inside of them. Outside of the core f is the exact
    distance; its gradient is a unit vector that turns from one face to the next over the rounded edge.

    Args:
        pose: of its centre.
        rounding: radius of its edges, m, greater than 0.
        underside: whether it has a lower end along its own z; without one it reaches down without end.
    """

    pose: Pose
    rounding: float
    underside: bool = field(default=True, kw_only=True)

    @property
    @abstractmethod
    def varies_across(self) -> bool:
        """Whether it has an end or a turned face along y."""

    @property
    @abstractmethod
    def half_lengths(self) -> tuple[float, float, float]:
        """Half the lengths of its core along its own axes, m."""

    @abstractmethod
    def _beyond(self, own: list[Any]) -> list[tuple[Any, list[Any]]]:
        """Return distances beyond faces of the core, m, each with its gradient in the own axes, at right angles.

        Args:
            own: coordinates of a point along the own axes.
        """

    def distance(self, point: Any) -> Any:
        """Return the gap f of a point (x, y, z), m: the signed distance."""
        parts = [part for part, _ in self._beyond(self.pose.local(point))]
        return _length(parts) + _least(_largest(parts), 0.0) - self.rounding

    def normal(self, point: Any) -> Any:
        """Return the gradient of f, (3,), of length one."""
        faces = self._beyond(self.pose.local(point))
        parts = [part for part, _ in faces]
        length, within = _length(parts), _largest(parts) < 0
        normal: list[Any] = [0.0, 0.0, 0.0]
        for k, (part, gradient) in enumerate(faces):
            nearest = within
            for j, other in enumerate(parts):
                nearest = nearest * (part > other if j < k else part >= other)
            share = _most(part, 0.0) / length + nearest
            for own, axis in zip(gradient, self.pose.axes, strict=True):
                normal = [sum_ + share * own * entry for sum_, entry in zip(normal, axis, strict=True)]
        return ca.vertcat(*normal) if isinstance(point[0], ca.SX) else np.array(normal)

    def axes(self, point: Any) -> Axes:
        """Return the unit normal at the point of the surface that is nearest, and tangents."""
        normal = self.normal(point)
        if self.varies_across:
            return turned_axes(normal)
        if isinstance(normal, ca.SX):
            return upright_axes(ca.vertcat(normal[2], ca.SX(1, 1), -normal[0]))
        return upright_axes(np.array([normal[2], 0.0, -normal[0]]))

    def distances(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance of many points, (3, n), m, (n)."""
        return np.asarray(self.distance(points), dtype=float)

    def raised(self, radius: float) -> Solid:
        """Return the solid whose edges are rounder by `radius`, m, and whose faces are as much further out."""
        return replace(self, rounding=self.rounding + radius)


@dataclass(frozen=True)
class Box(Solid):
    """A box with rounded edges.

    Args:
        half: half the edges of its core along its own axes, m, (3): half its size, less `rounding`; infinite along an
            axis along which it has no end.
    """

    half: tuple[float, float, float]

    @property
    def varies_across(self) -> bool:
        """Whether it has an end or a turned face along y."""
        return not (math.isinf(self.half[1]) and self.pose.axes[1] == (0.0, 1.0, 0.0))

    @property
    def half_lengths(self) -> tuple[float, float, float]:
        """Half the lengths of its core along its own axes, m."""
        return self.half

    def _beyond(self, own: list[Any]) -> list[tuple[Any, list[Any]]]:
        faces = []
        for i, half in enumerate(self.half):
            if math.isfinite(half):
                side = 2.0 * (own[i] >= 0) - 1.0 if i < 2 or self.underside else 1.0
                faces.append((side * own[i] - half, [side if j == i else 0.0 for j in range(3)]))
        return faces


@dataclass(frozen=True)
class Cylinder(Solid):
    """A cylinder along its own z axis, with rounded rims.

    Args:
        radius, half: of its core, m: radius, and half its length, less `rounding`; the length may be infinite.
    """

    radius: float
    half: float

    @property
    def varies_across(self) -> bool:
        """Whether it has an end along y, or is not along y."""
        return not (math.isinf(self.half) and abs(self.pose.axes[2][1]) == 1.0)

    @property
    def half_lengths(self) -> tuple[float, float, float]:
        """Half the lengths of its core along its own axes, m."""
        return self.radius, self.radius, self.half

    def _beyond(self, own: list[Any]) -> list[tuple[Any, list[Any]]]:
        away = (own[0] ** 2 + own[1] ** 2 + NO_LENGTH**2) ** 0.5
        faces: list[tuple[Any, list[Any]]] = [(away - self.radius, [own[0] / away, own[1] / away, 0.0])]
        if math.isfinite(self.half):
            side = 2.0 * (own[2] >= 0) - 1.0 if self.underside else 1.0
            faces.append((side * own[2] - self.half, [0.0, 0.0, side]))
        return faces


def _most(one: Any, other: Any) -> Any:
    return ca.fmax(one, other) if isinstance(one, ca.SX) else np.maximum(one, other)


def _least(one: Any, other: Any) -> Any:
    return ca.fmin(one, other) if isinstance(one, ca.SX) else np.minimum(one, other)


def _largest(parts: list[Any]) -> Any:
    result = parts[0]
    for part in parts[1:]:
        result = _most(result, part)
    return result


def _length(parts: list[Any]) -> Any:
    """Return the distance from the core, m, 1e-9 on it and inside."""
    return (sum(_most(part, 0.0) ** 2 for part in parts) + NO_LENGTH**2) ** 0.5
