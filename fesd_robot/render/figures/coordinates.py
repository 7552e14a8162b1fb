"""Positions, velocities and controls over time, with limits, goal, waypoints and reference."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fesd_robot.orientations import columns_with_angles, with_angles
from fesd_robot.plans import Plan
from fesd_robot.render.figures.background import Phases, legend_of, shade
from fesd_robot.render.figures.lines import draw_series, draw_steps
from fesd_robot.render.figures.look import Look, add_legend, name_panel, note_panel, set_range, small_multiples
from fesd_robot.render.figures.robot_motion import RobotMotion
from fesd_robot.render.palette import GREEN, GREY, VERMILION

FAR = 1.0
"""A limit farther from the curve than this many of its ranges is written instead of drawn."""

LIMIT: dict[str, Any] = {"color": VERMILION, "linestyle": (0, (4, 2)), "linewidth": 0.8}


class Aim(NamedTuple):
    """A value that a goal or waypoint asks for at a time, s, with its tolerance, None where it gives none."""

    word: str
    time: float
    value: float
    tolerance: float | None


def coordinates_figure(
    plan: Plan,
    kind: Literal["configuration", "velocity"],
    title: str,
    phases: Phases,
    look: Look,
    robot: RobotMotion | None,
) -> Figure:
    """Return one panel per coordinate of the configuration, orientations as roll, pitch and yaw, or the velocity."""
    series = columns_with_angles(getattr(plan.trajectory, kind))
    units: Mapping[str, str] = {**dict.fromkeys(series, "rad"), **getattr(plan.units, kind)}
    limits, references = _limits(robot, kind), _references(robot) if kind == "configuration" else {}
    figure, panels = small_multiples(title, len(series), look)
    marks: dict[str, Line2D] = {}
    for panel, (name, values) in zip(panels, series.items(), strict=True):
        shade(panel, phases)
        draw_series(panel, plan.trajectory.time, values)
        shown = [values]
        name_panel(panel, name, units.get(name))
        if name in references and robot is not None:
            time, reference = robot.reference[0], references[name]
            marks["reference"] = panel.plot(time, reference, color=GREY, linestyle="dotted", linewidth=1.1, zorder=1)[0]
            shown.append(reference)
        for aim in _aims(plan, kind, name, values):
            marks[aim.word] = _draw_aim(panel, aim)
            shown.append(np.array([aim.value]))
        marks |= _draw_limits(panel, limits.get(name), shown)
        set_range(panel, shown, units.get(name))
        panel.set_xlim(*_span(plan))
    handles, labels = legend_of(phases)
    add_legend(figure, [*handles, *marks.values()], [*labels, *marks])
    return figure


def controls_figure(plan: Plan, title: str, phases: Phases, look: Look, robot: RobotMotion | None) -> Figure:
    """Return one panel of steps per control; the last interval ends with the trajectory."""
    controls = {name: values for name, values in plan.controls.items() if name != "time"}
    figure, panels = small_multiples(title, len(controls), look)
    bounds = {}
    if robot is not None:
        drive = robot.actuation
        bounds = {name: (drive.lower[i], drive.upper[i]) for i, name in enumerate(drive.names)}
    marks: dict[str, Line2D] = {}
    for panel, (name, values) in zip(panels, controls.items(), strict=True):
        shade(panel, phases)
        draw_steps(panel, plan.controls["time"], float(plan.trajectory.time[-1]), values)
        shown = [values, np.zeros(1)]
        name_panel(panel, name, plan.units.controls.get(name))
        marks |= _draw_limits(panel, bounds.get(name), shown)
        set_range(panel, shown, plan.units.controls.get(name))
        panel.set_xlim(*_span(plan))
    handles, labels = legend_of(phases)
    add_legend(figure, [*handles, *marks.values()], [*labels, *marks])
    return figure


def _span(plan: Plan) -> tuple[float, float]:
    """Return the range of the time axis, s."""
    start, end = float(plan.trajectory.time[0]), float(np.max(plan.trajectory.time))
    return start, end if end > start else start + 1.0


def _draw_aim(panel: Axes, aim: Aim) -> Line2D:
    if aim.tolerance:
        panel.vlines(aim.time, aim.value - aim.tolerance, aim.value + aim.tolerance, colors=GREEN, linewidth=1.0)
    face = GREEN if aim.word == "goal" else "white"
    (mark,) = panel.plot(
        [aim.time], [aim.value], "D", color=GREEN, markerfacecolor=face, markersize=3.5, clip_on=False, zorder=4
    )
    return mark


def _draw_limits(panel: Axes, bounds: tuple[float, float] | None, shown: list[np.ndarray]) -> dict[str, Line2D]:
    """Draw the limits that are near the curve, and write down those that are far; `shown` grows by those drawn."""
    if bounds is None:
        return {}
    values = np.concatenate(shown)
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    reach = FAR * (high - low) + 1e-12
    far, drawn = [], {}
    for word, bound in zip(("≥", "≤"), bounds, strict=True):
        if not np.isfinite(bound):
            continue
        if low - reach <= bound <= high + reach:
            drawn = {"limit": panel.axhline(bound, **LIMIT)}
            shown.append(np.array([bound]))
        else:
            far.append(f"{word} {bound:.3g}")
    if far:
        both = len(far) == 2 and bounds[0] == -bounds[1]
        text = f"|·| ≤ {bounds[1]:.3g}" if both else ", ".join(far)
        note_panel(panel, text)
    return drawn


def _limits(robot: RobotMotion | None, kind: str) -> dict[str, tuple[float, float]]:
    if robot is None:
        return {}
    limits = robot.limits
    if kind == "configuration":
        names, low, high = robot.robot.configuration_names, limits.lower_position, limits.upper_position
    else:
        names, low, high = robot.robot.velocity_names, limits.lower_velocity, limits.upper_velocity
    found = {name: (float(low[i]), float(high[i])) for i, name in enumerate(names)}
    return found if kind == "velocity" else {**robot.task.limits.position, **found}  # angles have the task's only


def _references(robot: RobotMotion | None) -> dict[str, np.ndarray]:
    """Return the reference of every coordinate whose deviation from it costs something."""
    if robot is None:
        return {}
    weights = robot.task.costs.configuration or {}
    reference = columns_with_angles(dict(zip(robot.robot.configuration_names, robot.reference[1].T, strict=True)))
    return {name: values for name, values in reference.items() if weights.get(name, 0.0) > 0}


def _aims(plan: Plan, kind: str, name: str, values: np.ndarray) -> Iterator[Aim]:
    """Yield the aims of waypoints and goal for a coordinate.

    Args:
        values: of the coordinate at all samples.
    """
    waypoints, end = plan.task.get("waypoints") or [], float(plan.trajectory.time[-1])
    for number, waypoint in enumerate(waypoints):
        asked = with_angles(waypoint.get(kind) or {}).get(name)
        if asked is not None:
            tolerance = ((waypoint.get("tolerance") or {}).get(kind) or {}).get(name)
            yield Aim("waypoint", _time_of(plan, number), float(asked), tolerance)
    suffix = " velocity" if kind == "velocity" else ""
    first = float(values[0])
    for entry in plan.outcome.goal if plan.outcome else []:
        if entry.name == f"{name}{suffix}":
            yield Aim("goal", end, entry.goal, entry.tolerance)
        elif entry.name == f"change of {name}{suffix}":
            yield Aim("goal", end, first + entry.goal, entry.tolerance)
        elif entry.name == f"{name}{suffix}, mirrored":
            yield Aim("goal", end, entry.goal, entry.tolerance)


def _time_of(plan: Plan, number: int) -> float:
    """Return the time of a waypoint, s: the end of the control interval nearest to that of the task."""
    waypoints, starts, end = plan.task["waypoints"], plan.controls["time"], float(plan.trajectory.time[-1])
    time, duration = waypoints[number]["time"], plan.task["horizon"]["duration"]
    if time is None:
        share = (number + 1) / (len(waypoints) + 1)
    elif isinstance(duration, dict):  # free: the task's time is that of a duration in the middle of its bounds
        share = time / (0.5 * (duration["lower"] + duration["upper"]))
    else:
        share = time / duration
    return end * round(share * len(starts)) / len(starts)
