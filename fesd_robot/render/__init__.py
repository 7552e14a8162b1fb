"""Pictures of a plan: a web page that animates the robot, and figures in physical time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fesd_robot.lazy import lazy_exports

__all__ = [
    "BoxVisual",
    "CircleVisual",
    "FacingWallVisual",
    "GroundVisual",
    "PageContent",
    "SolidVisual",
    "WallVisual",
    "build_figures",
    "inline_html",
    "render_page",
    "write_drawings",
    "write_figures",
    "write_optional_files",
    "write_page",
    "write_robot_page",
    "write_task_page",
]

if TYPE_CHECKING:
    from fesd_robot.render.circles import BoxVisual, CircleVisual
    from fesd_robot.render.figures import build_figures, write_figures
    from fesd_robot.render.inline import inline_html
    from fesd_robot.render.outputs import write_drawings, write_optional_files, write_page
    from fesd_robot.render.page import PageContent, render_page
    from fesd_robot.render.still import write_robot_page, write_task_page
    from fesd_robot.render.terrain import FacingWallVisual, GroundVisual, SolidVisual, WallVisual
else:
    __getattr__, __dir__ = lazy_exports(
        __name__,
        {
            "fesd_robot.render.circles": ["BoxVisual", "CircleVisual"],
            "fesd_robot.render.figures": ["build_figures", "write_figures"],
            "fesd_robot.render.inline": ["inline_html"],
            "fesd_robot.render.outputs": ["write_drawings", "write_optional_files", "write_page"],
            "fesd_robot.render.page": ["PageContent", "render_page"],
            "fesd_robot.render.still": ["write_robot_page", "write_task_page"],
            "fesd_robot.render.terrain": ["FacingWallVisual", "GroundVisual", "SolidVisual", "WallVisual"],
        },
    )
