"""Gap and forces of the contacts over time, forces in their friction cones, and the timeline of contacts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from fesd_robot.contact import ContactMode
from fesd_robot.plans import ContactHistory, Plan
from fesd_robot.render.figures.background import Phases, legend_of, shade
from fesd_robot.render.figures.lines import LINE, draw_series, edges_of, with_steps
from fesd_robot.render.figures.look import FLOORS, TEXT, Look, add_legend, name_panel, new_figure, note_panel, set_range
from fesd_robot.render.palette import BLACK, GREY, MODES, SERIES
from fesd_robot.render.timeline import mode_spans

BAR = 0.5

CONE = "#e3e7eb"

LATERAL = (0, (2, 1))
"""The line of a lateral force."""


def contacts_figure(plan: Plan, title: str, phases: Phases, look: Look) -> Figure:
    """Return gap, normal force and tangential force inside its friction cone, one column per contact."""
    names = list(plan.contacts)
    columns = min(len(names), 2 if look.narrow else 4)
    crowded = columns * 1.78 > look.inches
    blocks = math.ceil(len(names) / columns)
    figure, axes = new_figure(title, 3 * blocks, columns, look, 0.95, legend=True)
    for row in range(3 * blocks):
        for other in axes[row, 1:]:
            # One scale per row and block, so that contacts can be compared.
            other.sharey(axes[row, 0])
    ranges: list[list[np.ndarray]] = [[] for _ in range(3 * blocks)]
    for index, name in enumerate(names):
        block, column = divmod(index, columns)
        panels = axes[3 * block : 3 * block + 3, column]
        for panel in panels:
            shade(panel, phases.of(name))
        for panel, what in zip(panels, ("gap (m)", "normal force (N)", "tangential force (N)"), strict=True):
            name_panel(panel, f"{name}: {what}" if not crowded else what)
        if crowded:
            name_panel(panels[0], f"{name}: gap (m)")
        for row, shown in enumerate(_draw_contact(list(panels), plan, plan.contacts[name], friction_of(plan, name))):
            ranges[3 * block + row] += shown
        if index + columns >= len(names):  # it would cover the name of the panel below
            panels[2].set_xlabel("time (s)", fontsize=TEXT, labelpad=2)
        panels[2].tick_params(labelbottom=True)
    end = float(np.max(plan.trajectory.time))
    axes[0, 0].set_xlim(float(plan.trajectory.time[0]), end if end > plan.trajectory.time[0] else end + 1.0)
    for row, shown in enumerate(ranges):
        set_range(axes[row, 0], shown, "m" if row % 3 == 0 else "N")
    for spare in range(len(names), blocks * columns):
        block, column = divmod(spare, columns)
        for panel in axes[3 * block : 3 * block + 3, column]:
            panel.remove()
    handles, labels = legend_of(phases.of(names[0]) if len(names) == 1 else Phases(phases.spans, (), phases.impacts))
    if len(names) > 1:
        handles, labels = handles[:-1], labels[:-1]
    handles, labels = [*handles, Patch(facecolor=GREY, alpha=0.35)], [*labels, "friction cone"]
    if any(contact.lateral_force is not None for contact in plan.contacts.values()):
        handles.append(Line2D([], [], color=SERIES[0], linewidth=LINE, linestyle=LATERAL))
        labels.append("lateral force")
    add_legend(figure, handles, labels)
    return figure


def _draw_contact(
    panels: Sequence[Axes], plan: Plan, contact: ContactHistory, friction: float | None
) -> list[list[np.ndarray]]:
    """Draw one contact into its three panels, and return what each shows."""
    gap, normal, tangential = panels
    time = plan.trajectory.time
    draw_series(gap, time, contact.gap, SERIES[2])
    starts = plan.controls.get("time", time[:1])
    edges = edges_of(starts, [*(each.time for each in plan.switches), *(each.time for each in plan.impulses)])
    stages = stages_of(plan)
    stepped, normals = with_steps(time, contact.normal_force, edges, stages)
    _, tangentials = with_steps(time, contact.tangential_force, edges, stages)
    normal.plot(stepped, normals, color=SERIES[1], linewidth=LINE)
    shown = [tangentials]
    if friction is not None:
        limit = friction * normals
        tangential.fill_between(stepped, -limit, limit, color=GREY, alpha=0.35, linewidth=0.0, zorder=0)
        note_panel(tangential, f"µ = {friction:g}")
        shown += [limit, -limit]
    tangential.plot(stepped, tangentials, color=SERIES[0], linewidth=LINE)
    if contact.lateral_force is not None:
        _, across = with_steps(time, contact.lateral_force, edges, stages)
        tangential.plot(stepped, across, color=SERIES[0], linewidth=LINE, linestyle=LATERAL)
        shown.append(across)
    return [[contact.gap, np.zeros(1)], [normals, np.zeros(1)], shown]


def stages_of(plan: Plan) -> int:
    """Return how many stages an element of the plan has; one, so that forces are held, where it does not say so."""
    statistics = getattr(plan, "statistics", None)
    return (statistics.stages if statistics is not None else None) or 1


def rigid_contacts(plan: Plan) -> list[str]:
    """Return the names of the contacts that are not compliant, which have friction."""
    contacts = _section(plan.task, "contacts")
    return [name for name in plan.contacts if not _section(contacts, name).get("stiffness")]


def cones_figure(plan: Plan, title: str, look: Look) -> Figure:
    """Return tangential against normal force of rigid contacts, in the colours of their modes, with friction cones."""
    names = rigid_contacts(plan)
    columns = min(len(names), 2 if look.narrow else 4)
    crowded = columns * 1.78 > look.inches
    rows = math.ceil(len(names) / columns)
    figure, axes = new_figure(title, rows, columns, look, 1.5, legend=True, share_time=False)
    for index, panel in enumerate(axes.flat):
        if index >= len(names):
            panel.remove()
            continue
        name = names[index]
        contact, friction = plan.contacts[name], friction_of(plan, name)
        top = max(float(np.nanmax(contact.normal_force)), FLOORS["N"])
        friction_force = contact.tangential_force if contact.lateral_force is None else contact.friction
        shown = [friction_force, np.array([-1, 1]) * 0.1 * top]
        if friction is not None:
            panel.fill_between([0, 1.1 * top], [0, -1.1 * friction * top], [0, 1.1 * friction * top], color=CONE, lw=0)
            for side in (-1, 1):
                panel.plot([0, 1.1 * top], [0, side * 1.1 * friction * top], color=GREY, linewidth=0.7)
            shown.append(np.array([-1, 1]) * 1.1 * friction * top)
        modes = np.array(contact.mode, dtype=object)
        for mode in (ContactMode.STICK, ContactMode.SLIP):
            own = modes == mode
            panel.plot(contact.normal_force[own], friction_force[own], ".", color=MODES[mode], markersize=3)
        set_range(panel, shown, "N")
        panel.set_xlim(0, 1.1 * top)
        panel.tick_params(labelbottom=True)
        name_panel(panel, f"{name}: tang. (N)" if crowded else f"{name}: tangential force (N)")
        if friction is not None:
            note_panel(panel, f"µ = {friction:g}")
        panel.set_xlabel("normal force (N)", fontsize=TEXT, labelpad=2)
    marks = [
        Line2D([], [], linestyle="none", marker=".", color=MODES[mode])
        for mode in (ContactMode.STICK, ContactMode.SLIP)
    ]
    add_legend(figure, [*marks, Patch(facecolor=CONE, edgecolor=GREY)], ["stick", "slip", "friction cone"])
    return figure


def timeline_figure(plan: Plan, title: str, look: Look) -> Figure:
    """Return one bar per contact, coloured by its mode, with a tick and the normal impulse at each impact.

    Joints with dry friction have a bar each below them.
    """
    modes: dict[str, Sequence[ContactMode]] = {name: contact.mode for name, contact in plan.contacts.items()}
    modes |= {f"{name} (joint)": joint.mode for name, joint in plan.joint_friction.items()}
    names = list(modes)
    figure, axes = new_figure(title, 1, 1, look, 0.15 + 0.34 * len(names), legend=True)
    panel, time = axes[0, 0], np.maximum.accumulate(plan.trajectory.time)
    start, end = float(time[0]), float(time[-1])
    for row, name in enumerate(names):
        for span in mode_spans(time, modes[name]):
            panel.broken_barh([(span.start, span.end - span.start)], (row - BAR / 2, BAR), facecolors=MODES[span.mode])
        labelled = -np.inf
        own = sorted((entry for entry in plan.impulses if entry.contact == name), key=lambda entry: entry.time)
        for impulse in own:
            panel.vlines(
                impulse.time, row - BAR / 2 - 0.08, row + BAR / 2, colors=MODES[ContactMode.IMPACT], linewidth=1.8
            )
            # Labels of impacts in quick succession would cover each other.
            if impulse.time - labelled >= (0.16 if look.narrow else 0.08) * (end - start):
                labelled = impulse.time
                panel.annotate(
                    f"{impulse.normal:.2g}",
                    (impulse.time, row - BAR / 2 - 0.08),
                    ha="center",
                    va="bottom",
                    fontsize=TEXT,
                    color=BLACK,
                )
    panel.set_yticks(range(len(names)), names)
    panel.set_ylim(len(names) - 0.6, -0.85)
    panel.set_xlim(start, end if end > start else start + 1.0)
    panel.set_xlabel("time (s)", fontsize=TEXT, labelpad=2)
    panel.spines["left"].set_visible(False)
    panel.tick_params(axis="y", length=0, labelsize=TEXT)
    longest = max(len(name) for name in names)
    figure.subplots_adjust(left=min(0.15 + 0.068 * longest, 0.4 * look.inches) / look.inches)
    shown = [ContactMode.FLIGHT, ContactMode.STICK, ContactMode.SLIP]
    shown += [ContactMode.TOUCH] if any(ContactMode.TOUCH in own for own in modes.values()) else []
    handles: list[Patch | Line2D] = [Patch(facecolor=MODES[mode]) for mode in shown]
    handles.append(Line2D([], [], color=MODES[ContactMode.IMPACT], linewidth=1.8))
    impact = "impact, N s" if look.narrow else "impact with its impulse (N s)"
    add_legend(figure, handles, [*map(str, shown), impact])
    return figure


def friction_of(plan: Plan, contact: str) -> float | None:
    """Return the friction coefficient of a contact: its own, else that of its surface, else None."""
    own, ground = _section(_section(plan.task, "contacts"), contact), _section(plan.task, "ground")
    named = {**_section(ground, "walls"), **_section(plan.task, "surfaces")}
    for section in (own, _section(named, str(own.get("surface"))) or ground):
        if section.get("friction") is not None:
            return float(section["friction"])
    return None


def _section(task: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    value = task.get(key)
    return value if isinstance(value, Mapping) else {}
