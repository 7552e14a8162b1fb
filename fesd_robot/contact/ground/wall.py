"""A vertical wall."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np


@dataclass(frozen=True)
class Wall:
    """A vertical plane at `x` without ends: f = x_wall - x for a robot on its left, f = x - x_wall on its right.

    Args:
        x: m.
        side: the side that is free: ``left`` towards -x, ``right`` towards +x.
    """

    x: float
    side: Literal["left", "right"]

    def distance(self, point: Any) -> Any:
        """Distance of a point (x, y, z), m, negative beyond the wall."""
        return self.x - point[0] if self.side == "left" else point[0] - self.x

    def normal(self, point: Any) -> np.ndarray:
        """Unit normal towards the free side, (3,)."""
        return np.array([-1.0 if self.side == "left" else 1.0, 0.0, 0.0])

    def tangent(self, point: Any) -> np.ndarray:
        """Unit tangent (n_z, 0, -n_x), (3,): up for a robot on the left, down for one on the right."""
        return np.array([0.0, 0.0, 1.0 if self.side == "left" else -1.0])

    def heights(self) -> None:
        """No points: it is a plane."""

    def raised(self, radius: float) -> Wall:
        """The wall that is nearer by `radius`, m."""
        return Wall(self.x - radius if self.side == "left" else self.x + radius, self.side)
