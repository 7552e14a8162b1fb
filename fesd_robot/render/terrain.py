"""The ground as the page draws it: a slab, a block under a profile or a mesh; walls, boxes and cylinders."""

from __future__ import annotations

import math
from dataclasses import dataclass
from dataclasses import field as dataclass_field

import coal
import numpy as np

from fesd_robot.contact.ground import HeightField
from fesd_robot.errors import FesdRobotError

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
        """Return it as a shape of coal, what has no end with a length in m."""
        x, y, z = (min(length, longest) for length in self.size)
        return coal.Cylinder(x / 2, z) if self.is_round else coal.Box(x, y, z)

    def corners(self) -> np.ndarray:
        """Return the corners of the box around it, m, (8, 3); where it has no end, those in its middle."""
        half = np.where(np.isfinite(self.size), self.size, 0.0) / 2
        signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T
        return np.asarray(signs * half @ self.pose[:3, :3].T + self.pose[:3, 3])


@dataclass(frozen=True)
class GroundVisual:
    """A ground: a plane, or a line of points along x, level beyond its ends, or a field of heights; and what else.

    Args:
        height: z of the plane at x = y = 0, m.
        slope, lateral_slope: angles by which the plane rises along +x and +y, rad.
        profile: points x, z of the ground, m, x increasing, shape (n, 2); takes the place of the plane.
        field: heights over x and y; takes the place of the plane.
        walls: name -> wall.
        solids: name -> box or cylinder.
    """

    height: float = 0.0
    slope: float = 0.0
    lateral_slope: float = 0.0
    profile: np.ndarray | None = None
    field: HeightField | None = None
    walls: dict[str, WallVisual | FacingWallVisual] = dataclass_field(default_factory=dict)
    solids: dict[str, SolidVisual] = dataclass_field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (math.isfinite(self.height) and max(abs(self.slope), abs(self.lateral_slope)) < math.pi / 2):
            raise FesdRobotError(
                f"GroundVisual: height {self.height} must be finite and slope {self.slope} and lateral slope "
                f"{self.lateral_slope} angles in rad between -pi/2 and pi/2"
            )
        if self.profile is not None and (self.height or self.slope):
            raise FesdRobotError("GroundVisual: a ground with a profile has no height and slope of its own")

    @property
    def varies_across(self) -> bool:
        """Whether it varies along y."""
        return self.field is not None or self.lateral_slope != 0.0

    def elevation(self, x: float, y: float = 0.0) -> float:
        """Return z of the ground at a place, all in m."""
        if self.field is not None:
            return float(self.field.numbers(x, y).h)
        if self.profile is not None:
            return float(np.interp(x, *self.profile.T))
        level = self.height + math.tan(self.slope) * x
        return level + math.tan(self.lateral_slope) * y if self.lateral_slope else level

    def elevations(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return z of the ground over a grid, (n, m), from x, (n), and y, (m), all in m."""
        if self.field is not None:
            return np.asarray(self.field.derivatives(*np.meshgrid(x, y, indexing="ij")).h)
        return np.array([[self.elevation(float(one), float(other)) for other in y] for one in x])

    def levels(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Return heights of the ground, m, that span those between two corners, (2) or (3) each."""
        if not self.varies_across:
            return self.outline(low[0], high[0])[:, 1]
        return self.elevations(*(np.linspace(low[i], high[i], _LOOKS) for i in range(2))).ravel()

    def outline(self, low: float, high: float, tolerance: float = 0.0) -> np.ndarray:
        """Return points x, z of the ground at y = 0 from x = low to high, without those `tolerance` from a line, m."""
        ends = np.array([[x, self.elevation(x)] for x in (low, high)])
        profile = self.profile
        if self.field is not None:
            x = self.field.sampled_places[0]
            profile = np.stack([x, self.field.derivatives(x, np.zeros_like(x)).h], axis=1)
        if profile is None:
            return ends
        inside = profile[(profile[:, 0] > low) & (profile[:, 0] < high)]
        return _simplified(np.vstack([ends[:1], inside, ends[1:]]), tolerance)

    def frame(self, x: float, y: float) -> np.ndarray:
        """Return the pose of a point of the plane, level along y, its third axis along the normal, shape (4, 4)."""
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
