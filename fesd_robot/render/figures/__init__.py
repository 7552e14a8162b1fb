"""Figures of a plan in physical time, of a size and type that a paper can print."""

from __future__ import annotations

import fesd_robot.render.matplotlib_settings  # noqa: F401  before Matplotlib is

# isort: split
import io
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from fesd_robot.errors import DimensionError
from fesd_robot.plans import ANIMATION_FILE, Plan
from fesd_robot.render.figures.animation import animation
from fesd_robot.render.figures.background import phases_of
from fesd_robot.render.figures.contacts import cones_figure, contacts_figure, rigid_contacts, timeline_figure
from fesd_robot.render.figures.coordinates import controls_figure, coordinates_figure
from fesd_robot.render.figures.energy import center_of_mass_figure, energy_figure
from fesd_robot.render.figures.look import DPI, Look
from fesd_robot.render.figures.robot_motion import RobotMotion, robot_motion
from fesd_robot.render.figures.snapshots import snapshots_figure
from fesd_robot.running import in_other_process
from fesd_robot.writing import write_atomically

__all__ = ["Look", "build_figures", "robot_motion", "write_animation", "write_figures"]

_METADATA: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
"""The same plan gives the same bytes."""

_SETTINGS: Any = {"svg.hashsalt": "fesd_robot", "pdf.fonttype": 42}
"""Publishers ask for fonts of type 42."""


def write_figures(plan: Plan, folder: Path, robot: RobotMotion | None = None, look: Look | None = None) -> list[Path]:
    """Write the figures of a plan; files of the same names are replaced.

    Args:
        plan: what to show.
        folder: where the files go; created if it is missing.
        robot: of the plan, `robot_motion`; without it there are no snapshots, energy, limits and reference.
        look: formats and width; PNG files of two columns' width by default.

    Returns:
        The files: snapshots, positions, velocities, controls, contacts, friction_cones, contact_timeline, energy and
        center_of_mass; none of a kind the plan lacks.

    Raises:
        DimensionError: an array of the plan has another length than its time.
    """
    look = Look() if look is None else look
    figures = list(build_figures(plan, robot, look).items())
    with in_other_process(partial(_save, figures[1::2], Path(folder), look)):
        _save(figures[::2], Path(folder), look)
    return [Path(folder) / f"{name}.{kind}" for name, _ in figures for kind in look.formats]


def _save(figures: Sequence[tuple[str, Figure]], folder: Path, look: Look) -> None:
    for name, figure in figures:
        for kind in look.formats:
            content = io.BytesIO()
            with matplotlib.rc_context(_SETTINGS):
                figure.savefig(content, format=kind, dpi=DPI, metadata=_METADATA[kind])
            write_atomically(folder / f"{name}.{kind}", content.getvalue())


def write_animation(robot: RobotMotion, folder: Path) -> Path:
    """Write the motion as a GIF into a folder, and return the file, `ANIMATION_FILE`."""
    return write_atomically(Path(folder) / ANIMATION_FILE, animation(robot, _title(robot.plan, "in real time")))


def build_figures(plan: Plan, robot: RobotMotion | None = None, look: Look | None = None) -> dict[str, Figure]:
    """Return the figures that `write_figures` writes, by name, without touching a file."""
    _check(plan)
    look, phases = Look() if look is None else look, phases_of(plan)
    trajectory, figures = plan.trajectory, dict[str, Figure]()
    if robot is not None:
        figures["snapshots"] = snapshots_figure(robot, _title(plan, "the motion"), phases, look)
    if trajectory.configuration:
        figures["positions"] = coordinates_figure(plan, "configuration", _title(plan, "positions"), phases, look, robot)
    if trajectory.velocity:
        figures["velocities"] = coordinates_figure(plan, "velocity", _title(plan, "velocities"), phases, look, robot)
    if set(plan.controls) - {"time"}:
        figures["controls"] = controls_figure(plan, _title(plan, "controls"), phases, look, robot)
    if plan.contacts:
        figures["contacts"] = contacts_figure(plan, _title(plan, "contacts"), phases, look)
        if rigid_contacts(plan):
            figures["friction_cones"] = cones_figure(plan, _title(plan, "forces in their friction cones"), look)
        figures["contact_timeline"] = timeline_figure(plan, _title(plan, "contact timeline"), look)
    if robot is not None and plan.controls:
        figures["energy"] = energy_figure(robot, _title(plan, "power and energy"), phases, look)
    if robot is not None:
        figures["center_of_mass"] = center_of_mass_figure(robot, _title(plan, "centre of mass"), phases, look)
    return figures


def _title(plan: Plan, what: str) -> str:
    return ("" if plan.status.solved else "NOT SOLVED: ") + f"{plan.name}: {what}"


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
