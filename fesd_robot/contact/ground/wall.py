"""A vertical wall across x."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from fesd_robot.contact.ground.surface import Axes, upright_axes


@dataclass(frozen=True)
class Wall:
    """A vertical plane at `x` without ends: f = x_wall - x for a robot on its left, f = x - x_wall on its right.

    Args:
        x: m.
        side: the side that is free: ``left`` towards -x, ``right`` towards +x.
    """

    x: float
    side: Literal["left", "right"]

    varies_across = False

    def distance(self, point: Any) -> Any:
        """Return the distance of a point (x, y, z), m, negative beyond the wall."""
        return self.x - point[0] if self.side == "left" else point[0] - self.x

    def normal(self, point: Any) -> np.ndarray:
        """Return the unit normal towards the free side, (3,)."""
        return np.array([-1.0 if self.side == "left" else 1.0, 0.0, 0.0])

    def axes(self, point: Any) -> Axes:
        """Return unit normal and tangents: (n_z, 0, -n_x), up for a robot on the left, else down, and +y."""
        return upright_axes(np.array([0.0, 0.0, 1.0 if self.side == "left" else -1.0]))

    def distances(self, points: np.ndarray) -> np.ndarray:
        """Return the distance of many points, (3, n), m, (n)."""
        return np.asarray(self.distance(points), dtype=float)

    def raised(self, radius: float) -> Wall:
        """Return the wall that is nearer by `radius`, m."""
        return Wall(self.x - radius if self.side == "left" else self.x + radius, self.side)
