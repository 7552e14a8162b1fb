"""The ground as the page draws it: a slab with a plane top."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fesd_robot.errors import FesdRobotError


@dataclass(frozen=True)
class GroundVisual:
    """A plane that rises along x: z = height + tan(slope) x, level along y.

    Args:
        height: z of the plane at x = 0, m.
        slope: angle between the plane and the horizontal, rad; positive if it rises towards +x.
    """

    height: float = 0.0
    slope: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.height) and abs(self.slope) < math.pi / 2):
            raise FesdRobotError(
                f"GroundVisual: height {self.height} must be finite and slope {self.slope} "
                "an angle in rad between -pi/2 and pi/2"
            )

    def elevation(self, x: float) -> float:
        """Return z of the plane at `x`, both in m."""
        return self.height + math.tan(self.slope) * x

    def frame(self, x: float, y: float) -> np.ndarray:
        """Return the pose of the plane's point above (x, y) with its third axis along the normal, shape (4, 4)."""
        sine, cosine = math.sin(self.slope), math.cos(self.slope)
        return np.array(
            [[cosine, 0.0, -sine, x], [0.0, 1.0, 0.0, y], [sine, 0.0, cosine, self.elevation(x)], [0.0, 0.0, 0.0, 1.0]]
        )
