"""Grounds of every shape."""

from __future__ import annotations

import numpy as np

from fesd_robot.contact import Plane, Surface, Terrain, Wall
from fesd_robot.contact.ground import height_map, steps

SINE_X = np.linspace(-2.0, 3.0, 101)


def sine(x: np.ndarray) -> np.ndarray:
    """The height map's own formula: hills of 0.1 m, 1.2 m apart."""
    return 0.1 * np.sin(2 * np.pi * x / 1.2)


STAIRS = Terrain(steps(0.1, [0.4, 0.7, 1.3], [0.25, 0.4, -0.2], 0.1))
HILLS = Terrain(height_map(SINE_X, sine(SINE_X)))
SOFT = Terrain(steps(0.0, [0.5], [0.2], 0.6))
GROUNDS: dict[str, Surface] = {
    "level": Plane(0.3),
    "slope": Plane(-0.2, 0.4),
    "stairs": STAIRS,
    "hills": HILLS,
    "left of a wall": Wall(1.2, "left"),
    "right of a wall": Wall(-0.4, "right"),
    "raised slope": Plane(-0.2, 0.4).raised(0.3),
    "raised hills": HILLS.raised(0.1),
    "raised step": SOFT.raised(0.15),
    "raised wall": Wall(1.2, "left").raised(0.2),
}
