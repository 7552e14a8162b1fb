"""Figures of a plan in physical time."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fesd_robot.errors import DimensionError
from fesd_robot.plans.plan import ContactHistory, Plan
from fesd_robot.render.files import write_atomically
from fesd_robot.render.palette import BLACK, GREY, SERIES
from fesd_robot.render.series import DPI, TEXT, draw_series, mark_times, name_panel, new_figure, small_multiples
from fesd_robot.render.timeline import timeline_figure

CONTACT_COLUMNS = 4


def write_figures(plan: Plan, folder: Path) -> list[Path]:
    """Write the figures of a plan as PNG files.

    Args:
        plan: what to show.
        folder: where the files go; created if it is missing.

    Returns:
        The files: positions, velocities, controls, contacts and contact_timeline; none of a kind the plan lacks.

    Raises:
        DimensionError: an array of the plan has another length than its time.
    """
    paths = []
    for name, figure in build_figures(plan).items():
        content = io.BytesIO()
        figure.savefig(content, format="png", dpi=DPI, metadata={"Software": None})
        paths.append(write_atomically(Path(folder) / f"{name}.png", content.getvalue()))
    return paths


def build_figures(plan: Plan) -> dict[str, Figure]:
    """Return the figures that `write_figures` writes, by name, without touching a file."""
    _check(plan)
    trajectory, units = plan.trajectory, plan.units
    controls = {name: values for name, values in plan.controls.items() if name != "time"}
    figures = {}
    if trajectory.configuration:
        figures["positions"] = _coordinates(plan, "positions", trajectory.configuration, units.configuration)
    if trajectory.velocity:
        figures["velocities"] = _coordinates(plan, "velocities", trajectory.velocity, units.velocity)
    if controls:
        figures["controls"] = _controls(plan, controls, units.controls)
    if plan.contacts:
        figures["contacts"] = _contacts(plan)
        figures["contact_timeline"] = timeline_figure(plan, _title(plan, "contact timeline"))
    return figures


def _title(plan: Plan, what: str) -> str:
    return f"{plan.name}: {what}" + ("" if plan.status.solved else " (NOT SOLVED)")


def _impact_note(plan: Plan) -> str:
    return ", thin lines at impacts" if plan.impulses else ""


def _impact_times(plan: Plan) -> list[float]:
    return [impulse.time for impulse in plan.impulses]


def _coordinates(plan: Plan, what: str, series: Mapping[str, np.ndarray], units: Mapping[str, str]) -> Figure:
    """Return one panel per coordinate; thin vertical lines mark the impacts."""
    figure, panels = small_multiples(_title(plan, what + _impact_note(plan)), len(series))
    for panel, (name, values) in zip(panels, series.items(), strict=True):
        draw_series(panel, plan.trajectory.time, values)
        name_panel(panel, name, units.get(name))
    mark_times(panels, _impact_times(plan))
    return figure


def _controls(plan: Plan, controls: Mapping[str, np.ndarray], units: Mapping[str, str]) -> Figure:
    """Return one panel of steps per control; the last interval ends with the trajectory."""
    figure, panels = small_multiples(_title(plan, "controls"), len(controls))
    starts = plan.controls["time"]
    edges = np.append(starts, max(float(plan.trajectory.time[-1]), float(starts[-1])))
    for panel, (name, values) in zip(panels, controls.items(), strict=True):
        panel.stairs(values, edges, baseline=None, color=SERIES[1], linewidth=1.4)
        panel.axhline(0.0, color=GREY, linewidth=0.6, alpha=0.45, zorder=0)
        name_panel(panel, name, units.get(name))
    return figure


def _contacts(plan: Plan) -> Figure:
    """Return gap, normal force and tangential force inside its friction cone, one column per contact."""
    names = list(plan.contacts)
    columns = min(len(names), CONTACT_COLUMNS)
    blocks = math.ceil(len(names) / columns)
    panel_size = (7.2, 1.9) if columns == 1 else (max(10.8 / columns, 3.0), 1.8)
    figure, axes = new_figure(_title(plan, "contacts" + _impact_note(plan)), 3 * blocks, columns, panel_size)
    for row in range(3 * blocks):
        for other in axes[row, 1:]:
            # One scale per row and block, so that contacts can be compared.
            other.sharey(axes[row, 0])
    for index, name in enumerate(names):
        block, column = divmod(index, columns)
        gap, normal, tangential = axes[3 * block : 3 * block + 3, column]
        _draw_contact(gap, normal, tangential, plan.trajectory.time, plan.contacts[name], _friction(plan, name))
        name_panel(gap, name)
        tangential.set_xlabel("time (s)", fontsize=TEXT)
        tangential.tick_params(labelbottom=True)
        mark_times((gap, normal, tangential), [entry.time for entry in plan.impulses if entry.contact == name])
        if column == 0:
            for panel, label in (
                (gap, "gap (m)"),
                (normal, "normal\nforce (N)"),
                (tangential, "tangential\nforce (N)"),
            ):
                panel.set_ylabel(label, fontsize=TEXT)
    for spare in range(len(names), blocks * columns):
        block, column = divmod(spare, columns)
        for panel in axes[3 * block : 3 * block + 3, column]:
            panel.remove()
    return figure


def _draw_contact(
    gap: Axes, normal: Axes, tangential: Axes, time: np.ndarray, contact: ContactHistory, friction: float | None
) -> None:
    """Draw one contact into its three panels."""
    draw_series(gap, time, contact.gap, SERIES[2])
    gap.axhline(0.0, color=GREY, linewidth=0.6, zorder=0)
    draw_series(normal, time, contact.normal_force)
    if friction is not None:
        limit = friction * contact.normal_force
        tangential.fill_between(time, -limit, limit, color=GREY, alpha=0.25, linewidth=0.0, zorder=0)
        tangential.set_title(f"grey: friction cone, µ = {friction:g}", loc="right", fontsize=TEXT - 1.5, color=BLACK)
    draw_series(tangential, time, contact.tangential_force, SERIES[0])


def _friction(plan: Plan, contact: str) -> float | None:
    """Return the friction coefficient of a contact: its own, else that of the wall or ground it touches, else None."""
    own, ground = _section(_section(plan.task, "contacts"), contact), _section(plan.task, "ground")
    wall = _section(_section(ground, "walls"), str(own.get("surface")))
    for section in (own, wall or ground):
        if section.get("friction") is not None:
            return float(section["friction"])
    return None


def _section(task: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    value = task.get(key)
    return value if isinstance(value, Mapping) else {}


def _check(plan: Plan) -> None:
    """Raise unless every array of the plan has the length of its time."""
    time = plan.trajectory.time
    if time.ndim != 1 or time.size == 0:
        raise DimensionError(f"trajectory.time has shape {time.shape}, expected (n,) with n >= 1")
    expected = [
        (f"trajectory.configuration[{name!r}]", plan.trajectory.configuration[name])
        for name in plan.trajectory.configuration
    ]
    expected += [(f"trajectory.velocity[{name!r}]", values) for name, values in plan.trajectory.velocity.items()]
    for name, contact in plan.contacts.items():
        for field in ("gap", "normal_force", "tangential_force", "mode"):
            expected.append((f"contacts[{name!r}].{field}", np.asarray(getattr(contact, field))))
    lengths = [(name, array, "trajectory.time", time.shape) for name, array in expected]
    if plan.controls:
        starts = plan.controls.get("time", np.empty(0))
        if starts.ndim != 1 or starts.size == 0:
            raise DimensionError(f"controls['time'] has shape {starts.shape}, expected (N,) with N >= 1")
        lengths += [
            (f"controls[{name!r}]", values, "controls['time']", starts.shape) for name, values in plan.controls.items()
        ]
    for name, array, reference, shape in lengths:
        if array.shape != shape:
            raise DimensionError(f"{name} has shape {array.shape}, expected {shape} as {reference}")
