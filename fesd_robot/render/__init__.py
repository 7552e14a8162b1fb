"""Pictures of a plan: a web page that animates the robot, and figures in physical time."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__all__ = ["CircleVisual", "GroundVisual", "PageContent", "WallVisual", "build_figures", "render_page", "write_figures"]

_HOME = {
    "CircleVisual": "fesd_robot.render.circles",
    "GroundVisual": "fesd_robot.render.terrain",
    "PageContent": "fesd_robot.render.page",
    "WallVisual": "fesd_robot.render.terrain",
    "build_figures": "fesd_robot.render.figures",
    "render_page": "fesd_robot.render.page",
    "write_figures": "fesd_robot.render.figures",
}

if TYPE_CHECKING:
    from fesd_robot.render.circles import CircleVisual
    from fesd_robot.render.figures import build_figures, write_figures
    from fesd_robot.render.page import PageContent, render_page
    from fesd_robot.render.terrain import GroundVisual, WallVisual


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'fesd_robot.render' has no attribute '{name}'")
    return getattr(importlib.import_module(_HOME[name]), name)
