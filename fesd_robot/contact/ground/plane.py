"""Flat surfaces; the same code serves numbers and CasADi expressions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from fesd_robot.contact.ground.surface import Axes, turned_axes, upright_axes


@dataclass(frozen=True)
class HalfSpace:
    """A plane without ends that faces any direction: f(p) = n . p - offset.

    Args:
        facing: unit normal n, (3).
        offset: distance of the plane from the origin along n, m.
    """

    facing: tuple[float, float, float]
    offset: float

    @property
    def varies_across(self) -> bool:
        """Whether the normal has a part along y."""
        return self.facing[1] != 0.0

    def distance(self, point: Any) -> Any:
        """Return the signed distance of a point (x, y, z), m."""
        return sum(part * point[i] for i, part in enumerate(self.facing)) - self.offset

    def normal(self, point: Any) -> np.ndarray:
        """Return the unit normal, (3,)."""
        return np.array(self.facing)

    def axes(self, point: Any) -> Axes:
        """Return the unit normal and tangents."""
        n_x, n_y, n_z = self.facing
        return turned_axes(np.array(self.facing)) if n_y else upright_axes(np.array([n_z, 0.0, -n_x]))

    def distances(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance of many points, (3, n), m, (n)."""
        return np.asarray(self.distance(points), dtype=float)

    def raised(self, radius: float) -> HalfSpace:
        """Return the plane that is further out by `radius`, m."""
        return HalfSpace(self.facing, self.offset + radius)


@dataclass(frozen=True)
class TiltedPlane(HalfSpace):
    """A plane that faces upwards, and is the ground."""

    def heights(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the heights at many places, m."""
        n_x, n_y, n_z = self.facing
        return np.asarray((self.offset - n_x * x - n_y * y) / n_z)

    def bends(self, low: float, high: float) -> np.ndarray:
        """Return no x: it is straight."""
        return np.empty(0)

    def heights_in_words(self) -> str:
        """Return an empty string: its section gives height and slopes."""
        return ""


def tilted_plane(height: float, slope: float, lateral_slope: float) -> TiltedPlane:
    """Return the plane z = height + x tan(slope) + y tan(lateral_slope).

    Args:
        height: m, at x = y = 0.
        slope, lateral_slope: rad, between -pi/2 and pi/2.
    """
    upwards = np.array([-math.tan(slope), -math.tan(lateral_slope), 1.0])
    n_x, n_y, n_z = (upwards / np.linalg.norm(upwards)).tolist()
    return TiltedPlane((n_x, n_y, n_z), n_z * height)


def facing_wall(place: tuple[float, float], direction: float) -> HalfSpace:
    """Return the vertical plane through a place whose free side looks into a direction.

    Args:
        place: x and y of a point of the wall, m.
        direction: angle of its normal from +x towards +y, rad.
    """
    n_x, n_y = math.cos(direction), math.sin(direction)
    return HalfSpace((n_x, n_y, 0.0), n_x * place[0] + n_y * place[1])


@dataclass(frozen=True)
class Plane:
    """A plane through (0, 0, height) that rises along +x by `slope`: f(x, z) = (z - height) cos(slope) - x sin(slope).

    Args:
        height: m, at x = 0.
        slope: rad, between -pi/2 and pi/2.
    """

    height: float = 0.0
    slope: float = 0.0

    varies_across = False

    def distance(self, point: Any) -> Any:
        """Return the signed distance of a point (x, y, z), m."""
        if self.slope == 0.0:
            return point[2] - self.height
        return (point[2] - self.height) * math.cos(self.slope) - point[0] * math.sin(self.slope)

    def normal(self, point: Any) -> np.ndarray:
        """Return the unit normal, (3,)."""
        return np.array([-math.sin(self.slope), 0.0, math.cos(self.slope)])

    def axes(self, point: Any) -> Axes:
        """Return the unit normal and tangents."""
        return upright_axes(np.array([math.cos(self.slope), 0.0, math.sin(self.slope)]))

    def distances(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance of many points, (3, n), m, (n)."""
        return np.asarray(self.distance(points), dtype=float)

    def raised(self, radius: float) -> Plane:
        """Return the plane that is higher by `radius`, m, along the normal."""
        return Plane(self.height + radius / math.cos(self.slope), self.slope)

    def heights(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the heights at many places, m."""
        return np.asarray(self.height + math.tan(self.slope) * x)

    def bends(self, low: float, high: float) -> np.ndarray:
        """Return no x: it is straight."""
        return np.empty(0)

    def heights_in_words(self) -> str:
        """Return an empty string: its section gives height and slope."""
        return ""
