"""Lines over physical time: what jumps is drawn as a jump, what is constant on intervals as steps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from fesd_robot.instants import SAME_EVENT
from fesd_robot.render.palette import GREY, SERIES

LINE = 1.2


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
    jumps = 1 + np.flatnonzero((np.diff(time) < SAME_EVENT) & (np.diff(values) != 0))
    (line,) = panel.plot(np.insert(time, jumps, np.nan), np.insert(values, jumps, np.nan), color=color, linewidth=LINE)
    if len(jumps):
        panel.vlines(time[jumps], values[jumps - 1], values[jumps], colors=color, linestyles="dotted", linewidth=0.9)
    return line


def with_steps(time: np.ndarray, values: np.ndarray, edges: np.ndarray, stages: int) -> tuple[np.ndarray, np.ndarray]:
    """Return force samples with the step at every edge at which they may jump.

    Between edges the forces of the scheme are the polynomial through the stages of every element, and the sample at an
    edge is that of the element that ends there. Where the next one begins is what its first stages say.

    Args:
        time: s, (n,).
        values: N, (n,).
        edges: times at which forces may jump, s, increasing.
        stages: of an element.

    Returns:
        time and values with a sample more for every edge that has none of the element behind it.
    """
    after = np.searchsorted(edges, time - SAME_EVENT)
    # The second of two samples at one time is that of the element behind.
    second = np.flatnonzero(np.diff(time) < SAME_EVENT) + 1
    after[second] = np.searchsorted(edges, time[second] + SAME_EVENT)
    after = np.maximum.accumulate(after)
    places, starts, begun = [], [], []
    for first in np.flatnonzero(np.diff(after) > 0) + 1:
        edge = float(edges[after[first] - 1])
        own = np.flatnonzero(after == after[first])[:stages]
        if time[first] - edge > SAME_EVENT:
            places.append(first)
            starts.append(edge)
            begun.append(_at(edge, time[own], values[own]))
    return np.insert(time, places, starts), np.insert(values, places, begun)


def _at(edge: float, time: np.ndarray, values: np.ndarray) -> float:
    """Return the polynomial through some samples at a time; the first of them where it would leave their range far."""
    if np.any(np.diff(time) < SAME_EVENT):
        return float(values[0])
    weights = [np.prod([(edge - other) / (own - other) for other in time if other != own]) for own in time]
    value, reach = float(np.dot(weights, values)), float(np.ptp(values))
    inside = values.min() - reach <= value <= values.max() + reach
    return value if inside else float(values[0])


def edges_of(starts: np.ndarray, switches: Sequence[float]) -> np.ndarray:
    """Return the times at which forces may jump: starts of control intervals but the first, and switches, each once."""
    times = np.sort(np.concatenate([starts[1:], np.asarray(switches, dtype=float)]))
    return times[np.insert(np.diff(times) > 2 * SAME_EVENT, 0, True)] if times.size else times


def draw_steps(panel: Axes, starts: np.ndarray, end: float, values: np.ndarray) -> None:
    """Draw values that are constant on intervals.

    Args:
        starts: of the intervals, s, (N,).
        end: of the last one, s.
        values: (N,).
    """
    edges = np.append(starts, max(end, float(starts[-1])))
    panel.stairs(values, edges, baseline=None, color=SERIES[1], linewidth=LINE)
    panel.axhline(0.0, color=GREY, linewidth=0.5, alpha=0.6, zorder=0)
