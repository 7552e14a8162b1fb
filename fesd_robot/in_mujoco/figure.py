"""The figure of a replay: distances from the plan over time."""

from __future__ import annotations

import fesd_robot.render.matplotlib_settings  # noqa: F401  before Matplotlib is

# isort: split
import io

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from fesd_robot.in_mujoco.replays import Replay
from fesd_robot.render.figures.look import DPI, Look, add_legend, name_panel, small_multiples
from fesd_robot.render.palette import GREY, series_color

LEAST, MOST = 1e-6, 10.0
"""m or rad; smaller and larger distances are not drawn."""


def errors_figure(replay: Replay) -> Figure:
    """Return a panel for every body, and one for all joints, with a line for each controller, on a logarithmic scale.

    Args:
        replay: of a plan.
    """
    panels = _curves(replay)
    figure, axes = small_multiples(f"{replay.plan.name}: distance from the plan in MuJoCo", len(panels), Look())
    handles = {}
    landings = sorted({each.time for each in replay.plan.switches if each.kind == "touchdown"})
    for axis, ((name, unit), lines) in zip(axes, panels.items(), strict=True):
        for landing in landings:
            axis.axvline(landing, color=GREY, linewidth=0.5, alpha=0.6, zorder=0)
        for number, (controller, (time, values)) in enumerate(lines.items()):
            shown = np.clip(values, LEAST, MOST)
            (handles[controller],) = axis.plot(time, shown, color=series_color(number), linewidth=1.2)
        axis.set_yscale("log")
        axis.set_ylim(
            LEAST, max(1e-2, 2 * max(float(np.clip(values, LEAST, MOST).max()) for _, values in lines.values()))
        )
        axis.grid(axis="y", color=GREY, alpha=0.3, linewidth=0.5)
        name_panel(axis, name, unit)
    add_legend(figure, list(handles.values()), list(handles))
    return figure


def errors_image(replay: Replay) -> bytes:
    """Return the figure as a PNG file."""
    content = io.BytesIO()
    with matplotlib.rc_context():
        errors_figure(replay).savefig(content, format="png", dpi=DPI, metadata={"Software": None})
    return content.getvalue()


def _curves(replay: Replay) -> dict[tuple[str, str], dict[str, tuple[np.ndarray, np.ndarray]]]:
    """Return name and unit of a panel -> controller -> time, s, and distance."""
    result: dict[tuple[str, str], dict[str, tuple[np.ndarray, np.ndarray]]] = {}
    for each in replay.runs:
        found = each.deviation
        curves = {(name, "m"): apart for name, apart in found.distance.items()}
        for kind, name, unit in (("rad/s", "hinges", "rad"), ("m/s", "slides", "m")):
            rows = found.joint_rows(kind)
            if rows:
                curves[name, unit] = np.sqrt(np.mean(found.joints[:, rows] ** 2, axis=1))
        for key, values in curves.items():
            result.setdefault(key, {})[each.controller] = (found.time, values)
    return result
