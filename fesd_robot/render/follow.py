"""The aim of the camera that follows the robot."""

from __future__ import annotations

from typing import Any

import numpy as np

from fesd_robot.render.animation import Motion
from fesd_robot.render.terrain import GroundVisual

CALM = 0.12
"""s; standard deviation of the window over which the camera's path is smoothed, so that steps do not shake it."""

HEIGHTS_ABOVE = 1.0
"""Heights of the robot that the ground may lie below it and still be in the picture."""

MOST = 400
"""Places of the camera that a page keeps; between them it moves evenly."""


def followed(motion: Motion, ground: GroundVisual) -> dict[str, Any] | None:
    """Return the path of the camera's aim and the size of the view around it.

    Returns:
        ``time`` since the start, s, ``center``, m, (k, 3), and ``size``, m, (3); None without geometry.
    """
    if not np.isfinite(motion.boxes).all():
        return None
    time, low, high = motion.time.astype(float), motion.boxes[:, 0].copy(), motion.boxes[:, 1]
    levels = np.array([ground.elevation(float(x), float(y)) for x, y in (low[:, :2] + high[:, :2]) / 2])
    height = float((high - low)[:, 2].max())
    on_ground = bool((low[:, 2] - levels).min() < HEIGHTS_ABOVE * height)
    bottom = levels if on_ground else np.full(len(time), low[:, 2].min())
    top = float((high[:, 2] - bottom).max())
    path = np.stack([(low[:, 0] + high[:, 0]) / 2, (low[:, 1] + high[:, 1]) / 2, bottom + top / 2], axis=1)
    chosen = np.unique(np.linspace(0, len(time) - 1, min(len(time), MOST)).round().astype(int))
    weights = (
        np.exp(-0.5 * ((time[chosen, None] - time[None, :]) / CALM) ** 2)
        * np.gradient(time + 1e-9 * np.arange(len(time)))
        if len(time) > 1
        else np.ones((1, 1))
    )
    center = (weights / weights.sum(axis=1, keepdims=True)) @ path
    size = (high - low).max(axis=0)
    size[2] = top
    return {"time": time[chosen].round(6).tolist(), "center": center.round(5).tolist(), "size": size.round(5).tolist()}
