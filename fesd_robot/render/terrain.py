"""The ground as the page draws it: a slab with a plane top, or a block under a profile, and walls."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from fesd_robot.errors import FesdRobotError


@dataclass(frozen=True)
class WallVisual:
    """A vertical wall at `x`, m, whose drawn thickness lies on the side away from the robot.

    Args:
        side: the side of the robot, ``left`` (-x) or ``right`` (+x).
    """

    x: float
    side: str


@dataclass(frozen=True)
class GroundVisual:
    """A ground that varies along x only: a plane z = height + tan(slope) x, or a line of points, level beyond its ends.

    Args:
        height: z of the plane at x = 0, m.
        slope: angle between the plane and the horizontal, rad; positive if it rises towards +x.
        profile: points x, z of the ground, m, x increasing, shape (n, 2); takes the place of the plane.
        walls: name -> wall.
    """

    height: float = 0.0
    slope: float = 0.0
    profile: np.ndarray | None = None
    walls: dict[str, WallVisual] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (math.isfinite(self.height) and abs(self.slope) < math.pi / 2):
            raise FesdRobotError(
                f"GroundVisual: height {self.height} must be finite and slope {self.slope} "
                "an angle in rad between -pi/2 and pi/2"
            )
        if self.profile is not None and (self.height or self.slope):
            raise FesdRobotError("GroundVisual: a ground with a profile has no height and slope of its own")

    def elevation(self, x: float) -> float:
        """Return z of the ground at `x`, both in m."""
        if self.profile is not None:
            return float(np.interp(x, *self.profile.T))
        return self.height + math.tan(self.slope) * x

    def outline(self, low: float, high: float, tolerance: float = 0.0) -> np.ndarray:
        """Return points x, z of the ground from x = low to high, without those within `tolerance` of a line, m."""
        ends = np.array([[x, self.elevation(x)] for x in (low, high)])
        if self.profile is None:
            return ends
        inside = self.profile[(self.profile[:, 0] > low) & (self.profile[:, 0] < high)]
        return _simplified(np.vstack([ends[:1], inside, ends[1:]]), tolerance)

    def frame(self, x: float, y: float) -> np.ndarray:
        """Return the pose of the plane's point above (x, y) with its third axis along the normal, shape (4, 4)."""
        sine, cosine = math.sin(self.slope), math.cos(self.slope)
        return np.array(
            [[cosine, 0.0, -sine, x], [0.0, 1.0, 0.0, y], [sine, 0.0, cosine, self.elevation(x)], [0.0, 0.0, 0.0, 1.0]]
        )


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
