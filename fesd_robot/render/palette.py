"""Colours that stay apart for colour-blind readers (Okabe and Ito, 2008), shared by the page and the figures."""

from __future__ import annotations

from fesd_robot.contact import ContactMode

BLACK = "#1f2328"
GREY = "#8b949e"
BLUE = "#0072b2"
ORANGE = "#e69f00"
GREEN = "#009e73"
VERMILION = "#d55e00"
PURPLE = "#cc79a7"
SKY = "#56b4e9"

SERIES = (VERMILION, BLUE, GREEN, PURPLE, ORANGE, SKY)
"""Colours of things that come in a row, such as the feet."""

MODES = {
    ContactMode.FLIGHT: "#e3e7eb",
    ContactMode.STICK: BLUE,
    ContactMode.SLIP: ORANGE,
    ContactMode.IMPACT: VERMILION,
    ContactMode.TOUCH: PURPLE,
}
"""Colour of each contact mode."""


def series_color(index: int) -> str:
    """Return the colour of the `index`-th thing in a row as ``#rrggbb``; the palette repeats."""
    return SERIES[index % len(SERIES)]


def color_number(color: str) -> int:
    """Return a ``#rrggbb`` colour as the integer that the viewer wants."""
    return int(color.removeprefix("#"), 16)
