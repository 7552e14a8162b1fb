"""The motion as a GIF, drawn without a browser."""

from __future__ import annotations

import io
from collections.abc import Sequence

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from PIL import Image

from fesd_robot.contact import ContactMode
from fesd_robot.render.figures.look import TEXT, write_title
from fesd_robot.render.figures.robot_motion import RobotMotion
from fesd_robot.render.figures.snapshots import ARROW, draw_robot, draw_world, drawn_box, largest_force
from fesd_robot.render.palette import BLACK, GREEN, MODES, SERIES

FRAMES_A_SECOND = 25
"""A GIF counts time in hundredths of a second, so that other rates would not play in real time."""

MOST_FRAMES = 400

WIDTH, DOTS = 6.4, 100
"""Inch, and dots an inch."""

SWATCH = 12
"""Height of what is given to a colour when the palette is chosen, dots."""

PAUSE = 800
"""How long the last frame stays, ms."""


def animation(robot: RobotMotion, title: str) -> bytes:
    """Return the motion in real time as a GIF that repeats; more than `MOST_FRAMES` are thinned out.

    Args:
        robot: a planned motion with its robot.
        title: stands above it.
    """
    time = np.maximum.accumulate(robot.plan.trajectory.time)
    seconds = float(time[-1] - time[0])
    count = int(np.clip(round(seconds * FRAMES_A_SECOND) + 1, 2, MOST_FRAMES))
    samples = [int(np.argmin(np.abs(time - moment))) for moment in np.linspace(time[0], time[-1], count)]
    boxes = [drawn_box(robot, sample) for sample in samples[:: max(count // 20, 1)] + samples[-1:]]
    low, high = np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)
    room = 0.06 * max(float(high[0] - low[0]), float(high[1] - low[1]), 1e-3)
    left, right, bottom, top = low[0] - room, high[0] + room, low[1] - 2 * room, high[1] + 2 * room
    # A tall picture is widened, a flat one gets air.
    right_most = (top - bottom) * WIDTH / 4.8
    extra = max(right_most - (right - left), 0.0) / 2
    left, right = left - extra, right + extra
    top = max(top, bottom + (right - left) * 1.6 / WIDTH)
    picture = (top - bottom) / (right - left) * WIDTH
    tall = round((picture + 0.6) * DOTS / 2) * 2 / DOTS
    figure = Figure(figsize=(WIDTH, tall), dpi=DOTS)
    canvas = FigureCanvasAgg(figure)
    write_title(figure, title)
    panel = figure.add_axes((0.0, 0.28 / tall, 1.0, 1 - 0.6 / tall))
    draw_world(panel, robot, (left, right, bottom, top))
    panel.xaxis.set_major_locator(MaxNLocator(8, prune="both"))
    clock = panel.text(0.99, 0.98, "", ha="right", va="top", transform=panel.transAxes, fontsize=TEXT + 1, color=BLACK)
    clock.set_animated(True)
    canvas.draw()
    background = canvas.copy_from_bbox(figure.bbox)
    scale = ARROW * (top - bottom) / largest_force(robot, samples)
    frames = []
    for sample in samples:
        canvas.restore_region(background)
        drawn = draw_robot(panel, robot, sample, scale)
        clock.set_text(f"{time[sample]:.2f} s")
        for artist in sorted([*drawn, clock], key=lambda each: each.get_zorder()):
            panel.draw_artist(artist)
        for artist in drawn:
            artist.remove()
        frames.append(Image.fromarray(np.asarray(canvas.buffer_rgba())[:, :, :3]))
    # One palette for all frames keeps colours still.
    palette = _palette([frames[0], frames[len(frames) // 2]])
    flat = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    step = max(round(100 * seconds / (count - 1)), 2) * 10
    content = io.BytesIO()
    flat[0].save(content, "GIF", save_all=True, append_images=flat[1:], duration=[step] * (count - 1) + [PAUSE], loop=0)
    return content.getvalue()


def _palette(frames: Sequence[Image.Image]) -> Image.Image:
    """Return the colours for all frames: those of some of them, and of signs and arrows that are in others."""
    width, height = frames[0].size
    colors = [
        "#ffffff",
        GREEN,
        MODES[ContactMode.STICK],
        MODES[ContactMode.SLIP],
        MODES[ContactMode.IMPACT],
        MODES[ContactMode.TOUCH],
        *SERIES,
    ]
    together = Image.new("RGB", (width, height * len(frames) + SWATCH * len(colors)), "white")
    for number, frame in enumerate(frames):
        together.paste(frame, (0, number * height))
    for number, color in enumerate(colors):
        top = height * len(frames) + number * SWATCH
        together.paste(Image.new("RGB", (width, SWATCH), color), (0, top))
    return together.quantize(96)
