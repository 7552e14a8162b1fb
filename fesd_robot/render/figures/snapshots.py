"""The robot over the ground at a few moments: what a reader wants to see first."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch
from scipy.spatial import ConvexHull

from fesd_robot.contact import ContactMode
from fesd_robot.instants import SAME_EVENT
from fesd_robot.render.figures.background import Phases
from fesd_robot.render.figures.look import DPI, TEXT, Look, add_legend, write_title
from fesd_robot.render.figures.robot_motion import RobotMotion
from fesd_robot.render.palette import BLACK, GREEN, GREY, MODES, series_color
from fesd_robot.render.terrain import FacingWallVisual

BODY, GROUND = "#d5dbe1", "#eef0f2"

ARROW = 0.4
"""Length of the largest force, over the height of the picture."""

HIGHEST = 2.4
"""Height of a snapshot, inch."""

APART = 0.004
"""Space on either side of a snapshot, over the width of the figure."""


def snapshots_figure(robot: RobotMotion, title: str, phases: Phases, look: Look) -> Figure:
    """Return the robot at start, end and moments between them, with feet coloured by mode and contact forces."""
    count = 4 if look.narrow else 6
    samples = chosen_samples(robot.plan.trajectory.time, [*phases.switches, *phases.impacts], count)
    boxes = [drawn_box(robot, sample) for sample in samples]
    width = 1.15 * max(float(high[0] - low[0]) for low, high in boxes)
    bottom, top = min(low[1] for low, _ in boxes), max(high[1] for _, high in boxes)
    room = 0.08 * (top - bottom)
    bottom, top = bottom - 2 * room, top + room
    width = max(width, (top - bottom) * (look.inches / count) / HIGHEST, 1e-3)
    above = 0.42 + 0.18 * look.legend_lines
    share = 1 / count
    across = (share - 2 * APART) * look.inches
    tall = above + (top - bottom) / width * across + 0.32
    figure = Figure(figsize=(look.inches, tall), dpi=DPI)
    write_title(figure, title)
    scale = ARROW * (top - bottom) / largest_force(robot, samples)
    for number, (sample, (low, high)) in enumerate(zip(samples, boxes, strict=True)):
        panel = figure.add_axes((number * share + APART, 0.32 / tall, share - 2 * APART, 1 - (above + 0.32) / tall))
        middle = 0.5 * float(low[0] + high[0])
        window = (middle - width / 2, middle + width / 2, bottom, top)
        draw_world(panel, robot, window)
        draw_robot(panel, robot, sample, scale)
        panel.set_title(f"{robot.plan.trajectory.time[sample]:.3g} s", fontsize=TEXT, color=BLACK, pad=2)
    add_legend(figure, *snapshot_legend(robot, samples))
    return figure


def snapshot_legend(robot: RobotMotion, samples: Sequence[int]) -> tuple[list[Artist], list[str]]:
    """Return the legend of the signs in the snapshots."""
    seen = {contact.mode[sample] for contact in robot.plan.contacts.values() for sample in samples}
    handles: list[Artist] = []
    labels: list[str] = []
    for mode in (ContactMode.FLIGHT, ContactMode.STICK, ContactMode.SLIP, ContactMode.TOUCH, ContactMode.IMPACT):
        if mode in seen:
            handles.append(
                Line2D([], [], linestyle="none", marker="o", markersize=4, color=_face(mode), markeredgecolor=BLACK)
            )
            labels.append(str(mode))
    if {ContactMode.STICK, ContactMode.SLIP, ContactMode.TOUCH} & seen:
        handles.append(Line2D([], [], color=GREEN, linewidth=1.5))
        labels.append("contact force")
    handles.append(Line2D([], [], linestyle="none", marker="P", markersize=5, color=BLACK, markeredgecolor="white"))
    labels.append("centre of mass")
    return handles, labels


def _face(mode: ContactMode) -> str:
    return "white" if mode == ContactMode.FLIGHT else MODES[mode]


def chosen_samples(time: np.ndarray, events: Sequence[float], count: int) -> list[int]:
    """Return the samples to show: start, end, events far enough apart, and the middle of the longest times between.

    Args:
        time: s, (n,).
        events: times of switches and impacts, s.
        count: how many; fewer where there are fewer samples.
    """
    start, end = float(time[0]), float(np.max(time))
    apart = (end - start) / (2.5 * count)
    times = [start, end]
    while len(times) < count and events:
        farthest = max(events, key=lambda event: min(abs(event - other) for other in times))
        if min(abs(farthest - other) for other in times) < apart:
            break
        times.append(farthest)
    while len(times) < count:
        times.sort()
        gap = int(np.argmax(np.diff(times)))
        times.append(0.5 * (times[gap] + times[gap + 1]))
    # Of the two samples of an impact the one after it shows the force.
    return sorted(
        {int(np.flatnonzero(np.abs(time - moment) <= np.abs(time - moment).min() + SAME_EVENT)[-1]) for moment in times}
    )


def drawn_box(robot: RobotMotion, sample: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest x, z of the drawing of a sample, the ground below it too."""
    robot.silhouettes.place(robot.configuration[sample])
    points = [*robot.silhouettes.outlines(), *robot.silhouettes.sticks(), robot.center_of_mass[sample][None, [0, 2]]]
    points += [robot.touching(name, sample)[0][None, :] for name in robot.plan.contacts]
    low, high = np.vstack(points).min(axis=0), np.vstack(points).max(axis=0)
    level = [robot.ground.elevation(x) for x in np.linspace(low[0], high[0], 9)]
    # The ground is shown where it is near; a robot that hangs high above it needs none.
    if not robot.ground.untouched and low[1] - min(level) < 2.0 * max(float((high - low).max()), 1e-3):
        low[1], high[1] = min(low[1], *level), max(high[1], *level)
    return low, high


def largest_force(robot: RobotMotion, samples: Sequence[int]) -> float:
    """Return the largest contact force at some samples, N, never zero."""
    sizes = [float(np.linalg.norm(robot.touching(name, s)[1])) for s in samples for name in robot.plan.contacts]
    return max([*sizes, 1e-6])


def draw_world(panel: Axes, robot: RobotMotion, window: tuple[float, float, float, float]) -> None:
    """Draw ground, walls, the boxes around solids, and the paths of contacts and centre of mass.

    Args:
        panel: its axes; gets the scale of both axes.
        window: left, right, bottom and top of what is shown, m.
    """
    left, right, bottom, top = window
    if not robot.ground.untouched:
        line = robot.ground.outline(left, right)
        panel.fill_between(
            line[:, 0], line[:, 1], min(bottom, float(line[:, 1].min())), color=GROUND, linewidth=0, zorder=0
        )
        panel.plot(line[:, 0], line[:, 1], color=BLACK, linewidth=0.8, zorder=1)
    for solid in robot.ground.solids.values():
        outline = solid.corners()[:, [0, 2]]
        panel.fill(*outline[ConvexHull(outline).vertices].T, facecolor=GROUND, edgecolor=BLACK, linewidth=0.8, zorder=1)
    for wall in robot.ground.walls.values():
        if isinstance(wall, FacingWallVisual):
            continue  # seen from the side it is a face, not a line
        away = 1.0 if wall.side == "left" else -1.0
        panel.fill_betweenx([bottom, top], wall.x, wall.x + away * (right - left), color=GROUND, linewidth=0, zorder=0)
        panel.plot([wall.x, wall.x], [bottom, top], color=BLACK, linewidth=0.8, zorder=1)
    for number, path in enumerate(robot.contact_paths):
        panel.plot(path[:, 0], path[:, 1], color=series_color(number), linewidth=0.7, alpha=0.8, zorder=1.5)
    panel.plot(*robot.center_of_mass[:, [0, 2]].T, color=GREY, linewidth=0.7, linestyle=(0, (4, 2)), zorder=1.5)
    panel.set_xlim(left, right)
    panel.set_ylim(bottom, top)
    panel.set_yticks([])
    panel.spines[["top", "left", "right", "bottom"]].set_visible(False)
    panel.set_xticks(few_places(left, right))
    panel.tick_params(labelsize=TEXT, length=2, pad=1, color=GREY)
    panel.xaxis.set_major_formatter(lambda value, _: f"{value:.4g} m")


def few_places(left: float, right: float) -> list[float]:
    """Return one to three round numbers inside a range, away from its ends, where their labels would be cut off."""
    width = right - left
    low, high = left + 0.22 * width, right - 0.22 * width
    for step in (size * 10.0**power for power in range(4, -5, -1) for size in (5.0, 2.0, 1.0)):
        first = math.ceil(low / step)
        places = [step * k for k in range(first, math.floor(high / step) + 1)]
        if places:
            return [places[0], places[-1]] if len(places) > 1 and step >= 0.4 * width else places[:1]
    return []


def draw_robot(panel: Axes, robot: RobotMotion, sample: int, scale: float) -> list[Artist]:
    """Draw the robot at a sample with its contact points and forces, and return what was drawn.

    Args:
        scale: length of a force, m/N.
    """
    robot.silhouettes.place(robot.configuration[sample])
    shapes = PolyCollection(
        robot.silhouettes.outlines(), facecolors=BODY, edgecolors=BLACK, linewidths=0.5, alpha=0.85, zorder=2
    )
    sticks = LineCollection(robot.silhouettes.sticks(), colors=BLACK, linewidths=1.1, zorder=3, capstyle="round")
    drawn: list[Artist] = [panel.add_collection(shapes, autolim=False), panel.add_collection(sticks, autolim=False)]
    drawn += panel.plot(*robot.center_of_mass[sample][[0, 2]], "P", color=BLACK, mec="white", mew=0.5, ms=5, zorder=4)
    for name, contact in robot.plan.contacts.items():
        point, force = robot.touching(name, sample)
        mode = contact.mode[sample]
        drawn += panel.plot(*point, "o", color=_face(mode), mec=BLACK, mew=0.6, ms=4, zorder=5)
        if scale * np.linalg.norm(force) > 0.08 * ARROW * (panel.get_ylim()[1] - panel.get_ylim()[0]):
            arrow = FancyArrowPatch(
                tuple(point),
                tuple(point + scale * force),
                arrowstyle="-|>",
                mutation_scale=6,
                color=GREEN,
                lw=1.3,
                shrinkA=0,
                shrinkB=0,
                zorder=4.5,
            )
            drawn.append(panel.add_patch(arrow))
    return drawn
