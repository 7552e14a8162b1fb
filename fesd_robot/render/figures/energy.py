"""Power of the controls, energy of the robot, and the path of its centre of mass."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from fesd_robot.render.figures.background import Phases, legend_of, shade
from fesd_robot.render.figures.contacts import stages_of
from fesd_robot.render.figures.lines import LINE, draw_series, edges_of, with_steps
from fesd_robot.render.figures.look import TEXT, Look, add_legend, name_panel, new_figure, note_panel, set_range
from fesd_robot.render.figures.robot_motion import RobotMotion
from fesd_robot.render.palette import BLACK, GREY, SERIES, series_color

NAMED_CONTROLS = 5
"""So many controls have a curve of their own beside their sum."""


def energy_figure(robot: RobotMotion, title: str, phases: Phases, look: Look) -> Figure:
    """Return the power of the controls, and the energy of the robot by kind; potential energy is zero at the start."""
    time = robot.plan.trajectory.time
    figure, axes = new_figure(title, *((2, 1) if look.narrow else (1, 2)), look, 1.5, legend=True, share_time=False)
    (power, energy) = axes.flat
    for panel in (power, energy):
        shade(panel, phases)
        panel.tick_params(labelbottom=True)
        panel.axhline(0.0, color=GREY, linewidth=0.5, alpha=0.6, zorder=0)
    edges = edges_of(robot.plan.controls["time"], [*phases.switches, *phases.impacts])
    stepped = {name: with_steps(time, each, edges, stages_of(robot.plan)) for name, each in robot.power.items()}
    times = next(iter(stepped.values()))[0] if stepped else time  # a body that is let go has no controls
    powers = {name: values for name, (_, values) in stepped.items()}
    single = {name: each for name, each in powers.items() if len(powers) <= NAMED_CONTROLS}
    total = np.sum([np.zeros(len(times)), *powers.values()], axis=0)
    for number, (name, values) in enumerate(single.items()):
        draw = draw_series(power, times, values, series_color(number + 1))
        draw.set_label(name)
    if len(powers) > 1:
        sum_of_all = draw_series(power, times, total, BLACK)
        sum_of_all.set_label("all")
    work = float(np.sum(0.5 * (total[1:] + total[:-1]) * np.diff(times)))
    name_panel(power, "power of the controls", "W")
    note_panel(power, f"work {work:.3g} J")
    set_range(power, [total, *single.values(), np.zeros(1)], "W")
    potential = robot.energies["potential"] - robot.energies["potential"][0]
    kinds = {"kinetic": robot.energies["kinetic"], "potential": potential}
    kinds["total"] = kinds["kinetic"] + potential
    for color, (name, values) in zip((SERIES[1], SERIES[4], BLACK), kinds.items(), strict=True):
        draw_series(energy, time, values, color).set_label(name)
    name_panel(energy, "energy", "J")
    set_range(energy, [*kinds.values(), np.zeros(1)], "J")
    for panel in (power, energy):
        if panel.get_legend_handles_labels()[1]:
            panel.legend(
                fontsize=TEXT,
                framealpha=0.7,
                edgecolor="none",
                handlelength=1.0,
                labelspacing=0.2,
                borderaxespad=0.1,
                loc="best",
            )
        panel.set_xlabel("time (s)", fontsize=TEXT, labelpad=2)
        panel.set_xlim(float(time[0]), float(np.max(time)))
    add_legend(figure, *legend_of(phases))
    return figure


def center_of_mass_figure(robot: RobotMotion, title: str, phases: Phases, look: Look) -> Figure:
    """Return the path of the centre of mass over the ground, and its two coordinates over time."""
    time, (x, _, z) = robot.plan.trajectory.time, robot.center_of_mass.T
    figure, axes = new_figure(title, *((3, 1) if look.narrow else (1, 3)), look, 1.3, legend=True, share_time=False)
    path, along, up = axes.flat
    for panel, values, name in ((along, x, "x"), (up, z, "z")):
        shade(panel, phases)
        draw_series(panel, time, values)
        name_panel(panel, name, "m")
        set_range(panel, [values], "m")
        panel.set_xlabel("time (s)", fontsize=TEXT, labelpad=2)
        panel.tick_params(labelbottom=True)
        panel.set_xlim(float(time[0]), float(np.max(time)))

    path.plot(x, z, color=SERIES[1], linewidth=LINE)
    path.plot(x[:1], z[:1], "o", color=SERIES[1], markersize=3.5)
    path.plot(x[-1:], z[-1:], "s", color=SERIES[1], markersize=3.5)
    room = 0.05 * max(float(np.ptp(x)), 0.05)
    line = robot.ground.outline(float(x.min()) - room, float(x.max()) + room)
    if robot.ground.untouched:
        line = line[:0]
    path.plot(line[:, 0], line[:, 1], color=GREY, linewidth=1.0)
    path.set_xlim(float(x.min()) - room, float(x.max()) + room)
    set_range(path, [z, line[:, 1]], "m")
    name_panel(path, "path: z over x", "m")
    path.set_xlabel("x (m)", fontsize=TEXT, labelpad=2)
    note_panel(path, "● start ■ end")
    add_legend(figure, *legend_of(phases))
    return figure
