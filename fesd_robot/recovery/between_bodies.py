"""Where two bodies of a robot touch, in numbers."""

from __future__ import annotations

import math

import numpy as np

from fesd_robot.contact import CircleOnCircle, TwoBodies


def closest(
    geometry: TwoBodies, center: np.ndarray, origin: np.ndarray, rotation: np.ndarray
) -> tuple[float, np.ndarray]:
    """Return the gap between a circle and another body, m, and the direction from that to the circle's centre, (3).

    Args:
        geometry: what touches what.
        center: of the circle, m, (3).
        origin, rotation: of the other body's frame, (3) and (3, 3).
    """
    apart = center - origin
    if isinstance(geometry, CircleOnCircle):
        distance = math.hypot(apart[0], apart[2])
        return distance - geometry.radius - geometry.other_radius, np.array([apart[0], 0.0, apart[2]]) / distance
    own, half = (rotation.T @ apart)[[0, 2]], np.array(geometry.other_size) / 2
    away = own - np.clip(own, -half, half)
    distance = math.hypot(*away)
    if distance > 0:
        direction = away / distance
    else:  # inside of the box the nearest side counts
        side = int(np.argmax(np.abs(own) - half))
        distance = float(np.abs(own[side]) - half[side])
        direction = np.sign(own) * (np.arange(2) == side)
    return distance - geometry.radius, rotation @ np.array([direction[0], 0.0, direction[1]])
