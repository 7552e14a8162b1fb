"""The ground as the page draws it: its heights and outlines; walls, boxes and cylinders."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from dataclasses import field as dataclass_field

import coal
import numpy as np

from fesd_robot.contact.ground import Ground, Plane

_LOOKS = 9
"""Along each axis: places at which the height of a piece of ground is looked at."""


@dataclass(frozen=True)
class WallVisual:
    """A vertical wall at `x`, m, whose drawn thickness lies on the side away from the robot.

    Args:
        side: the side of the robot, ``left`` (-x) or ``right`` (+x).
    """

    x: float
    side: str


@dataclass(frozen=True)
class FacingWallVisual:
    """A vertical wall through a place, m, whose normal is turned from +x towards +y by an angle, rad."""

    place: tuple[float, float]
    facing: float


@dataclass(frozen=True)
class SolidVisual:
    """A box or cylinder to stand on or to touch.

    Args:
        pose: of its centre, (4, 4).
        size: lengths along its own axes, m, infinite where it has no end.
        is_round: whether it is a cylinder along its z axis, of the diameter ``size[0]``.
    """

    pose: np.ndarray
    size: tuple[float, float, float]
    is_round: bool

    def shape(self, longest: float) -> coal.CollisionGeometry:
        """Return it as a shape of coal, endless lengths cut to a length in m."""
        x, y, z = (min(length, longest) for length in self.size)
        return coal.Cylinder(x / 2, z) if self.is_round else coal.Box(x, y, z)

    def corners(self) -> np.ndarray:
        """Return the corners of the box around it, m, (8, 3); where it has no end, those in its middle."""
        half = np.where(np.isfinite(self.size), self.size, 0.0) / 2
        signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T
        return np.asarray(signs * half @ self.pose[:3, :3].T + self.pose[:3, 3])


UNTOUCHED_ROOM = 0.1
"""Of the height of all that moves: how far below it a ground is drawn that nothing touches."""


@dataclass(frozen=True)
class GroundVisual:
    """A ground, and what else there is.

    Args:
        ground: its heights.
        walls: name -> wall.
        solids: name -> box or cylinder.
        untouched: whether nothing falls on it or touches it, so that it is no more than a scale below what moves.
    """

    ground: Ground = dataclass_field(default_factory=Plane)
    walls: dict[str, WallVisual | FacingWallVisual] = dataclass_field(default_factory=dict)
    solids: dict[str, SolidVisual] = dataclass_field(default_factory=dict)
    untouched: bool = False

    @property
    def varies_across(self) -> bool:
        """Whether it varies along y."""
        return self.ground.varies_across

    def below(self, boxes: Iterable[np.ndarray]) -> GroundVisual:
        """Return it where it is or, if it is untouched, below boxes and paths, m, (k, 3) each."""
        heights = [box[:, 2] for box in boxes if len(box) and np.isfinite(box).all()]
        if not self.untouched or not heights:
            return self
        low, high = (float(end(np.concatenate(heights))) for end in (np.min, np.max))
        return replace(self, ground=Plane(low - UNTOUCHED_ROOM * (high - low)))

    def elevation(self, x: float, y: float = 0.0) -> float:
        """Return z of the ground at a place, all in m."""
        return float(self.ground.heights(np.array([x]), np.array([y]))[0])

    def elevations(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return z of the ground over a grid, (n, m), from x, (n), and y, (m), all in m."""
        return self.ground.heights(*np.meshgrid(x, y, indexing="ij"))

    def levels(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Return heights of the ground, m, that span those between two corners, (2) or (3) each."""
        if not self.varies_across:
            return self.outline(low[0], high[0])[:, 1]
        return self.elevations(*(np.linspace(low[i], high[i], _LOOKS) for i in range(2))).ravel()

    def is_straight(self, low: float, high: float) -> bool:
        """Return whether it is a plane from x = low to high, m."""
        return not (self.varies_across or len(self.ground.bends(low, high)))

    def outline(self, low: float, high: float, tolerance: float = 0.0) -> np.ndarray:
        """Return points x, z of the ground at y = 0 from x = low to high, without those `tolerance` from a line, m."""
        x = np.concatenate([[low], self.ground.bends(low, high), [high]])
        return _simplified(np.stack([x, self.ground.heights(x, np.zeros_like(x))], axis=1), tolerance)

    def frame(self, x: float, y: float) -> np.ndarray:
        """Return the pose of a point of the ground, its third axis along the normal, shape (4, 4)."""
        pose = np.eye(4)
        pose[:3, 3] = x, y, self.elevation(x, y)
        normal, tangent, lateral = self.ground.axes(pose[:3, 3])
        pose[:3, :3] = np.stack([tangent, lateral, normal], axis=1)
        return pose


def _simplified(points: np.ndarray, tolerance: float) -> np.ndarray:
    """Return the corners of a polyline that stays within `tolerance` along z (Douglas and Peucker)."""
    keep = np.zeros(len(points), dtype=bool)
    keep[[0, -1]] = True
    spans = [(0, len(points) - 1)]
    while spans:
        first, last = spans.pop()
        between = points[first + 1 : last]
        if not len(between):
            continue
        away = np.abs(between[:, 1] - np.interp(between[:, 0], *points[[first, last]].T))
        worst = int(np.argmax(away))
        if away[worst] > tolerance:
            middle = first + 1 + worst
            keep[middle] = True
            spans += [(first, middle), (middle, last)]
    return points[keep]
