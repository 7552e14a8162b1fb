"""A flat ground; the same code serves numbers and CasADi expressions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Plane:
    """A plane through (0, 0, height) that rises along +x by `slope`: f(x, z) = (z - height) cos(slope) - x sin(slope).

    Args:
        height: m, at x = 0.
        slope: rad, between -pi/2 and pi/2.
    """

    height: float = 0.0
    slope: float = 0.0

    def distance(self, point: Any) -> Any:
        """Signed distance of a point (x, y, z), m."""
        if self.slope == 0.0:
            return point[2] - self.height
        return (point[2] - self.height) * math.cos(self.slope) - point[0] * math.sin(self.slope)

    def normal(self, point: Any) -> np.ndarray:
        """Unit normal, (3,)."""
        return np.array([-math.sin(self.slope), 0.0, math.cos(self.slope)])

    def tangent(self, point: Any) -> np.ndarray:
        """Unit tangent in the x-z plane, (3,)."""
        return np.array([math.cos(self.slope), 0.0, math.sin(self.slope)])

    def heights(self) -> None:
        """No points: it is a plane."""

    def raised(self, radius: float) -> Plane:
        """The plane that is higher by `radius`, m, along the normal."""
        return Plane(self.height + radius / math.cos(self.slope), self.slope)
