"""The background of curves over time: contacts, switches and impacts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from fesd_robot.contact import ContactMode
from fesd_robot.instants import SAME_EVENT
from fesd_robot.plans import Plan
from fesd_robot.render.palette import GREY, MODES
from fesd_robot.render.timeline import ModeSpan, mode_spans

SHADE = {
    ContactMode.FLIGHT: "#f6f7f8",
    ContactMode.STICK: "#d3e5f1",
    ContactMode.SLIP: "#fbe8c2",
    ContactMode.TOUCH: "#f3dfea",
}
"""Mode -> colour behind a curve: those of the timeline, paler."""


@dataclass(frozen=True)
class Phases:
    """When the contacts of a plan are in which mode.

    Attributes:
        spans: name of a contact -> its stretches of one mode.
        switches: times of all switches without those of impacts, s.
        impacts: times of all impacts, s.
    """

    spans: Mapping[str, Sequence[ModeSpan]]
    switches: tuple[float, ...]
    impacts: tuple[float, ...]

    def of(self, contact: str) -> Phases:
        """Return the phases of a single contact, with all switches."""
        return Phases({contact: self.spans[contact]}, self.switches, self.impacts)


def phases_of(plan: Plan) -> Phases:
    """Return the phases of a plan's contacts."""
    time = np.maximum.accumulate(plan.trajectory.time)
    impacts = _distinct(impulse.time for impulse in plan.impulses)
    switches = _distinct([*(each.time for each in plan.switches), *(each.time for each in plan.joint_switches)])
    return Phases(
        spans={name: mode_spans(time, contact.mode) for name, contact in plan.contacts.items()},
        switches=tuple(each for each in switches if all(abs(each - other) > SAME_EVENT for other in impacts)),
        impacts=tuple(impacts),
    )


def _distinct(times: Iterable[float]) -> list[float]:
    kept: list[float] = []
    for time in sorted(times):
        if not kept or time - kept[-1] > SAME_EVENT:
            kept.append(time)
    return kept


def shade(panel: Axes, phases: Phases) -> None:
    """Shade a panel by the modes of its contacts, a band for each from the top down, with lines at switches."""
    across = panel.get_xaxis_transform()
    count = len(phases.spans)
    for mode, color in SHADE.items():
        boxes = [
            [(span.start, low), (span.end, low), (span.end, high), (span.start, high)]
            for row, spans in enumerate(phases.spans.values())
            for low, high in [(1 - (row + 1) / count, 1 - row / count)]
            for span in spans
            if span.mode == mode
        ]
        if boxes:
            panel.add_collection(
                PolyCollection(boxes, facecolors=color, linewidths=0, transform=across, zorder=-2), autolim=False
            )
    for times, color in ((phases.switches, GREY), (phases.impacts, MODES[ContactMode.IMPACT])):
        if times:
            panel.vlines(times, 0, 1, transform=across, colors=color, linewidth=0.6, alpha=0.7, zorder=-1)


def legend_of(phases: Phases) -> tuple[list[Patch | Line2D], list[str]]:
    """Return handles and labels of the shading, for `add_legend`."""
    modes = [mode for mode in SHADE if any(span.mode == mode for spans in phases.spans.values() for span in spans)]
    handles: list[Patch | Line2D] = [Patch(facecolor=SHADE[mode], edgecolor=GREY, linewidth=0.4) for mode in modes]
    labels = [str(mode) for mode in modes]
    if phases.impacts:
        handles.append(Line2D([], [], color=MODES[ContactMode.IMPACT], linewidth=0.8))
        labels.append(str(ContactMode.IMPACT))
    if len(phases.spans) > 1:
        handles.append(Line2D([], [], linestyle="none"))
        names = ", ".join(phases.spans)
        labels.append(f"top down: {names}" if len(names) < 30 else f"top down: {len(phases.spans)} contacts")
    return handles, labels
