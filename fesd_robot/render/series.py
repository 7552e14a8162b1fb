"""Lines over physical time with jumps drawn as jumps, and the look that all figures share."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fesd_robot.render.palette import BLACK, GREY, SERIES

TEXT = 9.0
DPI = 150

SAME_TIME = 1e-6
"""Samples closer than this, s, are the two sides of a jump (the clock of a solved plan stands still only nearly)."""


def new_figure(title: str, rows: int, columns: int, panel: tuple[float, float]) -> tuple[Figure, np.ndarray]:
    """Return a figure and its axes, shape (rows, columns), without pyplot's global state.

    Args:
        title: stands at the top left.
        rows: of panels.
        columns: of panels.
        panel: width and height of one panel, inch.
    """
    figure = Figure(figsize=(columns * panel[0] + 0.4, rows * panel[1] + 0.6), dpi=DPI, layout="constrained")
    axes = figure.subplots(rows, columns, sharex=True, squeeze=False)
    figure.suptitle(title, x=0.01, ha="left", fontsize=TEXT + 2, color=BLACK)
    for axis in axes.flat:
        axis.spines[["top", "right"]].set_visible(False)
        axis.spines[["left", "bottom"]].set_color(GREY)
        axis.tick_params(labelsize=TEXT - 1, colors=BLACK, length=3, color=GREY)
        axis.margins(x=0.01)
    return figure, axes


def small_multiples(title: str, count: int) -> tuple[Figure, list[Axes]]:
    """Return a figure with `count` panels in a grid that stays readable; panels left over are removed."""
    columns = 1 if count == 1 else 2 if count <= 8 else 3 if count <= 18 else 4
    rows = math.ceil(count / columns)
    figure, axes = new_figure(title, rows, columns, (7.2, 2.4) if columns == 1 else (9.6 / columns, 1.9))
    panels = list(axes.flat)
    for spare in panels[count:]:
        spare.remove()
    for panel in panels[max(count - columns, 0) : count]:
        panel.tick_params(labelbottom=True)
        panel.set_xlabel("time (s)", fontsize=TEXT)
    return figure, panels[:count]


def name_panel(panel: Axes, name: str, unit: str | None = None) -> None:
    """Write what a panel shows above its left end, where long names have room."""
    panel.set_title(f"{name} ({unit})" if unit else name, loc="left", fontsize=TEXT, color=BLACK)


def draw_series(panel: Axes, time: np.ndarray, values: np.ndarray, color: str = SERIES[1]) -> Line2D:
    """Draw values over time, leaving a gap with a dotted connection where they jump at one time.

    Args:
        panel: where to draw.
        time: s, non-decreasing; a jump has two samples at the same time, before and after, shape (n,).
        values: shape (n,).
        color: of the line.

    Returns:
        The line; without the NaN that part it, its data are the given ones.
    """
    jumps = 1 + np.flatnonzero((np.diff(time) < SAME_TIME) & (np.diff(values) != 0))
    (line,) = panel.plot(np.insert(time, jumps, np.nan), np.insert(values, jumps, np.nan), color=color, linewidth=1.4)
    panel.vlines(time[jumps], values[jumps - 1], values[jumps], colors=color, linestyles="dotted", linewidth=1.0)
    return line


def mark_times(panels: Iterable[Axes], times: Iterable[float]) -> None:
    """Draw thin vertical lines at the given times, s, behind everything else."""
    for panel in panels:
        for time in sorted(set(times)):
            panel.axvline(time, color=GREY, linewidth=0.6, alpha=0.45, zorder=0)
