"""Size and type of figures, and axes on which round-off is flat."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fesd_robot.errors import FesdRobotError
from fesd_robot.render.palette import BLACK, GREY
from fesd_robot.task import FigureFormat, FigureWidth

TEXT = 8.0
"""Size of all type, pt."""

DPI = 200

WIDTHS = {"one_column": 3.5, "two_columns": 7.16}
"""Width of a figure in a journal of two columns, inch."""

FLOORS = {"m": 1e-2, "rad": 1e-2, "m/s": 1e-2, "rad/s": 1e-2, "N": 1e-1, "N m": 1e-2, "W": 1e-1, "J": 1e-2}
"""Unit -> shortest range of an axis, so that what differs by round-off is drawn as a level line."""

_LEFT, _RIGHT, _BETWEEN, _BOTTOM, _TITLE, _LEGEND, _PANEL_TITLE = 0.54, 0.17, 0.54, 0.38, 0.24, 0.2, 0.2
"""Inch: room for numbers beside the panels, for the time below them, and for the lines of text above them."""

_LETTER, _HANDLE = 0.057, 0.36
"""Inch: width of a letter of `TEXT`, and of the sign before it and the space after it in a legend."""


@dataclass(frozen=True)
class Look:
    """How figures are written.

    Args:
        formats: ``png``, ``svg`` or ``pdf``, each figure in all of them.
        width: ``one_column`` or ``two_columns`` of a journal, `WIDTHS`.

    Raises:
        FesdRobotError: a format or a width that is not known.
    """

    formats: Sequence[str] = ("png",)
    width: str = "two_columns"

    def __post_init__(self) -> None:
        _known("figure format", self.formats, get_args(FigureFormat))
        _known("width of figures", [self.width], get_args(FigureWidth))

    @property
    def inches(self) -> float:
        """Width of a figure."""
        return WIDTHS[self.width]

    @property
    def narrow(self) -> bool:
        """Whether a figure has room for one or two panels beside each other only."""
        return self.width == "one_column"

    @property
    def legend_lines(self) -> int:
        """Lines of text that the legend may take."""
        return 2 if self.narrow else 1


def _known(what: str, names: Sequence[str], known: Sequence[str]) -> None:
    for name in names or [""]:
        if name not in known:
            raise FesdRobotError(f"found {what} '{name}', expected one of {', '.join(known)}")


def new_figure(
    title: str, rows: int, columns: int, look: Look, height: float, *, legend: bool = False, share_time: bool = True
) -> tuple[Figure, np.ndarray]:
    """Return a figure and its axes, shape (rows, columns), without pyplot's global state.

    Args:
        title: stands at the top left.
        rows, columns: of panels.
        look: how wide it is.
        height: of one panel, inch.
        legend: whether there is room for a line of a legend below the title.
        share_time: whether all panels have the same horizontal axis, with numbers below the last row only.
    """
    above = _TITLE + (look.legend_lines * _LEGEND if legend else 0.0) + _PANEL_TITLE
    between = 1.6 * _PANEL_TITLE if share_time else _BOTTOM + 1.2 * _PANEL_TITLE
    tall = above + rows * height + (rows - 1) * between + _BOTTOM
    figure = Figure(figsize=(look.inches, tall), dpi=DPI)
    axes = figure.subplots(rows, columns, sharex=share_time, squeeze=False)
    panel = (look.inches - _LEFT - _RIGHT - (columns - 1) * _BETWEEN) / columns
    figure.subplots_adjust(
        left=_LEFT / look.inches,
        right=1 - _RIGHT / look.inches,
        bottom=_BOTTOM / tall,
        top=1 - above / tall,
        wspace=_BETWEEN / panel,
        hspace=between / height,
    )
    write_title(figure, title)
    for axis in axes.flat:
        plain(axis)
    return figure, axes


def write_title(figure: Figure, title: str) -> None:
    """Write the title into the top left corner, in the width there is."""
    width, tall = figure.get_size_inches()
    most = int(width * 14.5)
    text = title if len(title) <= most else title[: most - 1] + "…"
    figure.suptitle(text, x=0.06 / width, y=1 - 0.05 / tall, ha="left", va="top", fontsize=TEXT + 1, color=BLACK)


def plain(axis: Axes) -> None:
    """Give an axis its look: no box, few numbers, thin ticks."""
    axis.spines[["top", "right"]].set_visible(False)
    axis.spines[["left", "bottom"]].set_color(GREY)
    axis.tick_params(labelsize=TEXT, colors=BLACK, length=2.5, pad=2, color=GREY, labelcolor=BLACK)
    axis.xaxis.set_major_locator(MaxNLocator(5))
    axis.yaxis.set_major_locator(MaxNLocator(4))
    axis.margins(x=0.0)


def add_legend(figure: Figure, handles: Sequence[Artist], labels: Sequence[str]) -> None:
    """Write a legend below the title, of as many lines as the width of the figure asks for."""
    width, tall = figure.get_size_inches()
    lines: list[list[int]] = [[]]
    used = 0.0
    for index, label in enumerate(labels):
        need = _HANDLE + _LETTER * len(label)
        if lines[-1] and used + need > width:
            lines.append([])
            used = 0.0
        lines[-1].append(index)
        used += need
    for number, line in enumerate(lines):
        legend = figure.legend(
            [handles[index] for index in line],
            [labels[index] for index in line],
            loc="upper left",
            bbox_to_anchor=(0.02 / width, 1 - (0.2 + number * 0.85 * _LEGEND) / tall),
            borderaxespad=0.0,
            ncols=len(line) or 1,
            fontsize=TEXT,
            frameon=False,
            handlelength=1.1,
            handletextpad=0.35,
            columnspacing=0.8,
        )
        figure.add_artist(legend)


def small_multiples(title: str, count: int, look: Look) -> tuple[Figure, list[Axes]]:
    """Return a figure with `count` panels in a grid that stays readable; panels left over are removed."""
    columns = (1 if count <= 4 else 2) if look.narrow else 1 if count == 1 else 2 if count <= 8 else 3
    rows = math.ceil(count / columns)
    figure, axes = new_figure(title, rows, columns, look, 1.5 if count == 1 else 0.95, legend=True)
    panels = list(axes.flat)
    for spare in panels[count:]:
        spare.remove()
    for panel in panels[max(count - columns, 0) : count]:
        panel.tick_params(labelbottom=True)
        panel.set_xlabel("time (s)", fontsize=TEXT, labelpad=2)
    return figure, panels[:count]


def note_panel(panel: Axes, text: str) -> None:
    """Write a note above the right end of a panel, below its name inside of it where both have no room side by side."""
    width = panel.get_window_extent().width / DPI
    if _LETTER * (len(panel.get_title(loc="left")) + len(text)) < width:
        panel.set_title(text, loc="right", fontsize=TEXT, color=BLACK, pad=3)
    else:
        back = {"facecolor": "white", "alpha": 0.7, "linewidth": 0, "pad": 0.8}
        panel.text(
            0.98, 0.04, text, transform=panel.transAxes, ha="right", fontsize=TEXT, color=BLACK, bbox=back, zorder=6
        )


def name_panel(panel: Axes, name: str, unit: str | None = None) -> None:
    """Write what a panel shows above its left end, where long names have room."""
    panel.set_title(f"{name} ({unit})" if unit else name, loc="left", fontsize=TEXT, color=BLACK, pad=3)


def set_range(panel: Axes, values: Sequence[np.ndarray], unit: str | None) -> None:
    """Set the range of the vertical axis to that of some values, but not shorter than `FLOORS` and 1e-5 of them."""
    finite = np.concatenate([np.ravel(each) for each in values])
    finite = finite[np.isfinite(finite)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    shortest = max(FLOORS.get(unit or "", 1e-3), 1e-5 * max(abs(low), abs(high)))
    if high - low < shortest:
        middle = 0.5 * (low + high)
        # Round-off about zero is drawn on zero.
        middle = 0.0 if abs(middle) < 1e-3 * shortest else middle
        low, high = middle - 0.5 * shortest, middle + 0.5 * shortest
    room = 0.07 * (high - low)
    panel.set_ylim(low - room, high + room)
