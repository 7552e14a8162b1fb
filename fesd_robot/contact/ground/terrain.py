"""An uneven ground over a profile of heights."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from fesd_robot.contact.ground.offset import offset_profile
from fesd_robot.contact.ground.profile import Profile
from fesd_robot.contact.ground.surface import Axes, upright_axes


@dataclass(frozen=True)
class Terrain:
    """The ground below z = h(x): f = g / sqrt(1 + h'(x)^2 / (1 + (g / l)^2)) with g = z - h(x), l = 1 / max |h''|.

    Near the ground f is the distance to the tangent line below the point, g / sqrt(1 + h'^2), and on it the gradient of
    f is the unit normal (-h', 1) / sqrt(1 + h'^2) exactly. At heights beyond the smallest radius of curvature l it
    becomes the height g above the ground: the slope below would else shrink the gap of a foot that passes high above
    a step, and its gradient would grow with the height. f has the sign of g and grows with z.

    Args:
        profile: h(x).
    """

    profile: Profile

    varies_across = False

    def distance(self, point: Any) -> Any:
        """Return the gap f of a point (x, y, z), m."""
        height: Any
        slope: Any
        if isinstance(point[0], ca.SX):
            height, slope = self.profile.expressions(point[0])
        else:
            height, slope, _ = self.profile.numbers(float(point[0]))
        above = point[2] - height
        return above * (1 + slope**2 / (1 + (self.profile.curvature * above) ** 2)) ** -0.5

    def normal(self, point: Any) -> Any:
        """Return the gradient of f, (3,), by CasADi's differentiation of an expression, by hand for numbers."""
        if isinstance(point[0], ca.SX):
            at = ca.SX.sym("point", 3)
            gradient = ca.Function("gradient", [at], [ca.gradient(self.distance(at), at)])
            return gradient(ca.vertcat(point[0], point[1], point[2]))
        height, slope, curvature = self.profile.numbers(float(point[0]))
        above, rate = float(point[2]) - height, self.profile.curvature
        fade = 1 / (1 + (rate * above) ** 2)
        root = 1 + slope**2 * fade
        by_height = root**-0.5 + (slope * fade * rate * above) ** 2 * root**-1.5
        by_slope = -above * slope * fade * root**-1.5
        return np.array([-slope * by_height + curvature * by_slope, 0.0, by_height])

    def axes(self, point: Any) -> Axes:
        """Return the unit normal of the ground below the point, and tangents."""
        if isinstance(point[0], ca.SX):
            rise = self.profile.expressions(point[0])[1]
            length = ca.sqrt(1 + rise**2)
            return upright_axes(ca.vertcat(1 / length, ca.SX(1, 1), rise / length))
        _, slope, _ = self.profile.numbers(float(point[0]))
        return upright_axes(np.array([1.0, 0.0, slope]) / math.hypot(1.0, slope))

    def distances(self, points: np.ndarray) -> np.ndarray:
        """Return the distance of many points, (3, n), from the tangent lines below them, m, (n)."""
        height, slope, _ = self.profile.derivatives(points[0])
        return np.asarray((points[2] - height) / np.sqrt(1 + slope**2))

    def raised(self, radius: float) -> Terrain:
        """Return the ground whose profile is the parallel curve at distance `radius`, m."""
        return Terrain(offset_profile(self.profile, radius))

    def heights(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the heights at many places, m."""
        return np.asarray(self.profile.derivatives(x)[0])

    def bends(self, low: float, high: float) -> np.ndarray:
        """Return many x of every piece, m, increasing."""
        x = np.unique(self.profile.sampled(0)[0])
        return x[(low < x) & (x < high)]

    def heights_in_words(self) -> str:
        """Say where it is uneven, and how high there."""
        x, z = self.profile.sampled(0)
        return (
            f"For x from {x.min():.4g} to {x.max():.4g} m its heights are {z.min():.4g} to {z.max():.4g} m; level "
            "beyond."
        )
