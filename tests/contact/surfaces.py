"""Surfaces that vary along y, of every kind."""

from __future__ import annotations

import numpy as np

from fesd_robot.contact import Surface
from fesd_robot.contact.ground import Box, Cylinder, HeightField, Pose, facing_wall, tilted_plane

X, Y = np.linspace(-1.0, 1.2, 20), np.sort(np.append(np.linspace(-0.9, 1.0, 14), [-0.37, 0.44]))


def waves(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Hills of 0.1 m in both directions, (n, m)."""
    return np.asarray(0.1 * np.sin(3.0 * x)[:, None] * np.cos(2.5 * y)[None, :])


HILLS = HeightField.through(X, Y, waves(X, Y))
SURFACES: dict[str, Surface] = {
    "hills": HILLS,
    "raised hills": HILLS.raised(0.1),
    "tilted plane": tilted_plane(0.1, 0.3, -0.4),
    "raised tilted plane": tilted_plane(0.1, 0.3, -0.4).raised(0.2),
    "wall": facing_wall((0.3, -0.2), 2.0),
    "wall facing y": facing_wall((0.3, 0.5), np.pi / 2),
    "box": Box(Pose.turned((0.1, 0.2, 0.3), 0.4), 0.05, (0.3, 0.2, 0.1)),
    "ramp": Box(Pose.turned((0.1, 0.2, 0.3), -0.7, 0.3), 0.05, (0.4, 0.2, 0.1)),
    "pedestal": Box(Pose.turned((0.1, 0.2, 0.1), 0.4), 0.05, (0.3, 0.2, 0.1), underside=False),
    "column": Cylinder(Pose.turned((0.0, 0.1, 0.2), 0.0), 0.03, 0.3, 0.2, underside=False),
    "standing cylinder": Cylinder(Pose.turned((0.0, 0.1, 0.2), 0.0), 0.03, 0.3, 0.2),
    "lying cylinder": Cylinder(Pose.turned((0.0, 0.1, 0.2), 0.5).along("x"), 0.03, 0.2, 0.4),
    "raised lying cylinder": Cylinder(Pose.turned((0.0, 0.1, 0.2), 0.5).along("x"), 0.03, 0.2, 0.4).raised(0.1),
}
LEVEL_ALONG_Y: dict[str, Surface] = {
    "box without ends": Box(Pose.turned((0.1, 0.2, 0.3), 0.0, 0.4), 0.05, (0.3, np.inf, 0.1)),
    "log": Cylinder(Pose.turned((0.1, 0.0, 0.2), 0.0).along("y"), 0.05, 0.3, np.inf),
}
