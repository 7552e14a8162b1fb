"""The contact timeline: who touches the ground when, and how hard the impacts are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from fesd_robot.plans.plan import Plan
from fesd_robot.render.palette import BLACK, MODES
from fesd_robot.render.series import TEXT, new_figure

BAR = 0.5


class ModeSpan(NamedTuple):
    """A stretch of time in which a contact keeps its mode; `start` and `end` in s."""

    mode: str
    start: float
    end: float


def mode_spans(time: np.ndarray, modes: Sequence[str]) -> list[ModeSpan]:
    """Return the stretches of one contact with one mode each, in order and without gaps between them.

    The stretch between two samples has the mode of the second one, because a sample where the mode changes still
    belongs to the one that ends there. An impact has no duration and takes the mode of its neighbour.
    """
    spans: list[ModeSpan] = []
    for index in np.flatnonzero(np.diff(time) > 0).tolist():
        start, end = float(time[index]), float(time[index + 1])
        mode = next((near for near in (modes[index + 1], modes[index]) if near != "impact"), "flight")
        if spans and spans[-1].mode == mode:
            spans[-1] = spans[-1]._replace(end=end)
        else:
            spans.append(ModeSpan(mode, start, end))
    return spans


def timeline_figure(plan: Plan, title: str) -> Figure:
    """Return one bar per contact, coloured by its mode, with a tick and the normal impulse at each impact.

    Joints with dry friction have a bar each below them.
    """
    modes: dict[str, Sequence[str]] = {name: contact.mode for name, contact in plan.contacts.items()}
    modes |= {f"{name} (joint)": joint.mode for name, joint in plan.joint_friction.items()}
    names = list(modes)
    figure, axes = new_figure(title, 1, 1, (9.6, 0.9 + 0.62 * len(names)))
    panel = axes[0, 0]
    start, end = float(plan.trajectory.time[0]), float(plan.trajectory.time[-1])
    for row, name in enumerate(names):
        for span in mode_spans(plan.trajectory.time, modes[name]):
            panel.broken_barh([(span.start, span.end - span.start)], (row - BAR / 2, BAR), facecolors=MODES[span.mode])
        labelled = -np.inf
        for impulse in sorted(
            (entry for entry in plan.impulses if entry.contact == name), key=lambda entry: entry.time
        ):
            panel.vlines(impulse.time, row - BAR / 2 - 0.08, row + BAR / 2, colors=MODES["impact"], linewidth=1.8)
            # Labels of impacts in quick succession would cover each other.
            if impulse.time - labelled >= 0.05 * (end - start):
                labelled = impulse.time
                panel.annotate(
                    f"{impulse.normal:.2g}",
                    (impulse.time, row - BAR / 2 - 0.1),
                    ha="center",
                    va="bottom",
                    fontsize=TEXT - 2,
                    color=BLACK,
                )
    panel.set_yticks(range(len(names)), names)
    panel.set_ylim(len(names) - 0.5, -0.6)
    panel.set_xlim(start, end if end > start else start + 1.0)
    panel.set_xlabel("time (s)", fontsize=TEXT)
    panel.spines["left"].set_visible(False)
    panel.tick_params(axis="y", length=0, labelsize=TEXT)
    handles: list[Patch | Line2D] = [Patch(color=MODES[mode], label=mode) for mode in ("flight", "stick", "slip")]
    handles.append(Line2D([], [], color=MODES["impact"], linewidth=1.8, label="impact with normal impulse (N s)"))
    figure.legend(handles=handles, loc="outside upper right", ncols=4, fontsize=TEXT - 1, frameon=False)
    return figure
